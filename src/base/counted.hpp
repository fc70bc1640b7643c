#pragma once

#include <fmt/format.h>

#include <concepts>
#include <string>
#include <string_view>

namespace livetet {

/// A number with its noun: "1 frame", "2 frames", "0 frames".
template <std::integral Number>
std::string counted(Number count, std::string_view noun) {
    return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

/// The same for nouns whose plural has no s: "1 hexahedron", "2 hexahedra".
template <std::integral Number>
std::string counted(Number count, std::string_view one, std::string_view many) {
    return fmt::format("{} {}", count, count == 1 ? one : many);
}

}  // namespace livetet
