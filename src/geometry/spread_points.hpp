#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// Some of a set of points, and how well they cover the set.
struct SpreadPoints {
    std::vector<std::size_t> chosen;  ///< their numbers, in the order of the choice
    double radius = 0;  ///< the largest distance of a point of the set from the nearest chosen one
};

/// `count` of the points, as far from each other as can be: the first, then each time the one that
/// is farthest from those chosen (farthest-point sampling; T. Gonzalez 1985, Theoretical Computer
/// Science 38: no choice of as many has less than half of this radius). Throws Error unless there
/// are 1 to all of the points to choose.
SpreadPoints spread_points(std::span<const Vector3> points, std::size_t count);

}  // namespace livetet
