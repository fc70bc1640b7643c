#include "config/interval.hpp"

#include <fmt/format.h>

namespace livetet {

std::string Interval::text() const {
    if (has_low() && has_high()) {
        if (ends == Ends::included) return fmt::format("from {} to {}", low, high);
        return fmt::format("{} {} and {} {}", includes_low() ? "at least" : "above", low,
                           includes_high() ? "at most" : "below", high);
    }
    if (has_low()) return fmt::format("{} {}", includes_low() ? "at least" : "greater than", low);
    if (has_high()) return fmt::format("{} {}", includes_high() ? "at most" : "less than", high);
    return "";
}

}  // namespace livetet
