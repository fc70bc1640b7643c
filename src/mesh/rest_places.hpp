#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "mesh/link_crossings.hpp"
#include "mesh/rest_iteration.hpp"

namespace livetet {

/// Finds where points of a deformed grid lie in the grid at rest (see find_rest_place), with the
/// grid's trilinear displacement. Outside of the body that is the displacement of the nearest point
/// of a near cell.
class RestPlaces {
  public:
    RestPlaces(const HexLevel& level, const GridFrame& frame);

    /// The rest place of `y`, m. `cells` and `displacement`, m, one a node, are those of the grid
    /// now: cuts change the nodes of cells. At most 60 evaluations of u; allocates nothing.
    Vector3 rest_place(const Vector3& y, std::span<const Hexahedron> cells,
                       std::span<const Vector3> displacement) const;
    /// Whether a place at rest is in a cell.
    bool holds(const Vector3& x) const;

  private:
    void find_near_cells();
    std::optional<std::int32_t> cell_at(const HexPlace& place) const;
    std::int32_t cell_near(const HexPlace& place) const;
    RestMotion motion_at(const Vector3& x, std::span<const Hexahedron> cells,
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
