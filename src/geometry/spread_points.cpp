#include "geometry/spread_points.hpp"

#include <algorithm>
#include <limits>

#include "base/error.hpp"

namespace livetet {

SpreadPoints spread_points(std::span<const Vector3> points, std::size_t count) {
    if (count == 0 || points.size() < count)
        fail("spread points: found {} to choose of {}, expected 1 to {}", count, points.size(),
             points.size());
    std::vector<double> apart(points.size(), std::numeric_limits<double>::infinity());
    SpreadPoints spread;
    std::size_t next = 0;
    while (spread.chosen.size() < count) {
        spread.chosen.push_back(next);
        for (std::size_t i = 0; i < points.size(); ++i)
            apart[i] = std::min(apart[i], (points[i] - points[spread.chosen.back()]).norm());
        next = static_cast<std::size_t>(std::ranges::max_element(apart) - apart.begin());
    }
    spread.radius = apart[next];
    return spread;
}

}  // namespace livetet
