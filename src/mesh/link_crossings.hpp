#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "geometry/triangle_mesh.hpp"
#include "mesh/place_numbers.hpp"

namespace livetet {

/// Where a grid lies: the cell at place p reaches from `corner` + `axes` p by the columns of
/// `axes`, the edges of a cell, m.
struct GridFrame {
    Vector3 corner = Vector3::Zero();
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();

    Vector3 centre(const HexPlace& place) const {
        return corner + axes * (Vector3(place[0], place[1], place[2]) + Vector3::Constant(0.5));
    }
};

/// The frame of a mesh's grid; `level` is its `hex_level_of`.
GridFrame grid_frame(const TetMesh& mesh, const HexLevel& level);

/// Finds the links of a grid whose centres lie on different sides of triangles: of many surfaces,
/// one after another. Surfaces that share an edge, with the same coordinates of its ends, leave no
/// hole between them. The rule is that of `crossed_links`.
class LinkCrossings {
  public:
    /// O(links log(links)).
    LinkCrossings(const HexLevel& level, const GridFrame& frame);

    /// Sets the entries of `cut`, one a link of the level, of links that the surface crosses.
    /// Returns how many of them were not set. O(triangles + centres near them, log(links) each).
    /// Throws Error, naming `where`, if a corner of a triangle is more than 1e6 cells from the grid
    /// or not finite; then nothing is set.
    std::size_t mark(const TriangleMesh& surface, std::span<std::uint8_t> cut,
                     const std::string& where) const;

  private:
    PlaceNumbers numbers_;
    GridFrame frame_;
    std::vector<std::pair<std::int64_t, std::int32_t>> links_;  ///< by number, rising
};

}  // namespace livetet
