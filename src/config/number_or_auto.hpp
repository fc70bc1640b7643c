#pragma once

#include <optional>

namespace livetet {

/// A number, or the word `auto`: the program determines the number.
struct NumberOrAuto {
    std::optional<double> number{};  ///< none: auto

    bool is_auto() const { return !number; }
    bool operator==(const NumberOrAuto&) const = default;
};

}  // namespace livetet
