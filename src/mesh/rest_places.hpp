#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "mesh/link_crossings.hpp"

namespace livetet {

/// Finds where points of a deformed grid lie in the grid at rest.
///
/// With the grid's trilinear displacement u, a point y of the deformed body is at the rest place x
/// of
///
///     x + u(x) = y,          x <- x + omega (1 + grad u)^-1 (y - u(x) - x),
///
/// found by Newton's iteration. omega begins as 1 and is halved whenever a step is not shorter than
/// the one before: so it settles near the cut where y is in the gap of one, where u jumps and no x
/// solves the equation. Outside of the body u is that of the nearest point of a near cell. The body
/// may be bent by 60 degrees over its length.
class RestPlaces {
  public:
    RestPlaces(const HexLevel& level, const GridFrame& frame);

    /// The rest place of `y`, m. `cells` and `displacement`, m, one a node, are those of the grid
    /// now: cuts change the nodes of cells. At most 60 evaluations of u; allocates nothing.
    Vector3 rest_place(const Vector3& y, std::span<const Hexahedron> cells,
                       std::span<const Vector3> displacement) const;

  private:
    void find_near_cells();
    std::int32_t cell_near(const HexPlace& place) const;
    struct Motion {
        Vector3 u;                 ///< displacement, m
        Eigen::Matrix3d gradient;  ///< of the place of the moved point
    };
    Motion motion_at(const Vector3& x, std::span<const Hexahedron> cells,
                     std::span<const Vector3> displacement) const;

    std::vector<HexPlace> places_;  ///< of the cells
    PlaceNumbers numbers_;
    Vector3 corner_;
    Eigen::Matrix3d in_cells_;                                  ///< cells from metres
    double tolerance_;                                          ///< m
    std::vector<std::pair<std::int64_t, std::int32_t>> cells_;  ///< by the place's number, rising
    int shift_ = 0;  ///< a block has 2^shift_ places along each axis
    std::array<std::int32_t, 3> blocks_{};
    std::vector<std::int32_t> near_;  ///< a cell in or near each block of the grid's box
};

}  // namespace livetet
