#include "apps/scene/mesh_options.hpp"

#include <limits>
#include <string_view>

#include "io/text.hpp"

namespace livetet {

std::optional<std::pair<double, double>> range_of(const std::string& text) {
    const std::size_t colon = text.find(':');
    if (colon == std::string::npos || text.size() < 2) return {};
    const std::string_view low = trim(std::string_view(text).substr(0, colon));
    const std::string_view high = trim(std::string_view(text).substr(colon + 1));
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const auto from = low.empty() ? -infinity : parse_number(low);
    const auto to = high.empty() ? infinity : parse_number(high);
    if ((low.empty() && high.empty()) || !from || !to || !(*from <= *to)) return {};
    return std::pair(*from, *to);
}

}  // namespace livetet
