#pragma once

#include <span>
#include <vector>

#include "base/lists.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The nodes of a mesh of tets that move onto a cut, as far as its angles and its boundary allow.
class MovableNodes {
  public:
    /// `mesh` outlives it; meanwhile its nodes move, but its tets stay.
    explicit MovableNodes(TetMesh& mesh);

    std::span<const std::int32_t> tets_at(std::int32_t node) const { return stars_[node]; }
    std::span<const std::int32_t> boundary_at(std::int32_t node) const {
        return at_boundary_[node];
    }
    const Triangle& triangle(std::int32_t i) const { return boundary_[i]; }

    /// Whether the boundary keeps its place, but for a slight slope, as one of its nodes moves.
    bool keeps_boundary(std::int32_t node, const Vector3& way) const;
    /// The shortest way by which a node reaches the plane at `point` with the unit vector `normal`:
    /// for a node of the boundary along that. Zero if there is none.
    Vector3 way_to_plane(std::int32_t node, const Vector3& point, const Vector3& normal) const;
    /// Moves a node by the way or a part of it, or not at all. No angle between the faces of a tet
    /// becomes smaller than 15 degrees, but where one was already. Returns the way that it moved.
    Vector3 move(std::int32_t node, const Vector3& way);

  private:
    double least_angle_around(std::int32_t node) const;
    Vector3 normal_of(std::int32_t triangle) const;

    TetMesh& mesh_;
    Lists stars_;
    std::vector<Triangle> boundary_;
    Lists at_boundary_;  ///< the boundary's triangles at each node
};

}  // namespace livetet
