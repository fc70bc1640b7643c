#include "config/uncertain.hpp"

#include <charconv>

namespace livetet {

namespace {

/// The number that is all of `text` but blanks around it.
std::optional<double> number_in(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    if (text.starts_with('+')) text.remove_prefix(1);
    double x = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), x);
    if (error != std::errc{} || end != text.data() + text.size()) return {};
    return x;
}

}  // namespace

std::string text_of(const Uncertain& x) {
    return x.spread == 0 ? fmt::format("{}", x.value) : fmt::format("{} +- {}", x.value, x.spread);
}

std::string spread_note(const Uncertain& x) {
    if (x.spread == 0) return "";
    return fmt::format(", from value - spread = {:.6g} to value + spread = {:.6g}", x.lowest(),
                       x.highest());
}

std::optional<Uncertain> parse_uncertain(std::string_view text) {
    constexpr std::string_view sign = "+-";
    const std::size_t at = text.find(sign);
    const auto value = number_in(text.substr(0, at));
    if (!value) return {};
    if (at == std::string_view::npos) return Uncertain(*value);
    const auto spread = number_in(text.substr(at + sign.size()));
    if (!spread || !(*spread >= 0)) return {};
    return Uncertain(*value, *spread);
}

}  // namespace livetet
