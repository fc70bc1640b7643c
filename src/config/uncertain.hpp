#pragma once

#include <fmt/format.h>

#include <cmath>
#include <concepts>
#include <optional>
#include <string>
#include <string_view>

namespace livetet {

/// A number, and how far it may be off: one standard deviation, 0 if it is taken as exact. It is
/// used like the number.
struct Uncertain {
    double value = 0, spread = 0;

    constexpr Uncertain(double value = 0, double spread = 0)  // NOLINT(google-explicit-constructor)
        : value(value), spread(spread) {}
    constexpr operator double() const { return value; }  // NOLINT(google-explicit-constructor)

    double lowest() const { return value - spread; }
    double highest() const { return value + spread; }
    /// Compares two of them with their spreads; a number is compared with the value.
    template <std::same_as<Uncertain> A, std::same_as<Uncertain> B>
    friend bool operator==(const A& a, const B& b) {
        return a.value == b.value && a.spread == b.spread;
    }
};

/// "0.45" or "0.45 +- 0.03", in the shortest form that reads back to the same numbers.
std::string text_of(const Uncertain& x);
/// The inverse; empty if it is neither, or if the spread is negative.
std::optional<Uncertain> parse_uncertain(std::string_view text);

/// For the message about a value that its check refuses: ", from value - spread = 0 to value +
/// spread = 6000", as the check looks at both; empty without a spread, and for other types.
std::string spread_note(const Uncertain& x);
template <class T>
std::string spread_note(const T&) {
    return "";
}

}  // namespace livetet

/// Formats the value alone.
template <>
struct fmt::formatter<livetet::Uncertain> : fmt::formatter<double> {
    template <class Context>
    auto format(const livetet::Uncertain& x, Context& context) const {
        return fmt::formatter<double>::format(x.value, context);
    }
};
