#pragma once

#include <fmt/format.h>

#include <string>

#include "base/instruction_set.hpp"

namespace livetet {

/// What `--version` prints: the version, and on a second line what the numerical libraries are
/// compiled for. For the programs' main files, which know LIVETET_VERSION.
inline std::string version_text() {
    std::string text = LIVETET_VERSION;
    if (const std::string_view set = instruction_set(); !set.empty())
        text += fmt::format("\nnumerical libraries for {}", set);
    return text;
}

}  // namespace livetet
