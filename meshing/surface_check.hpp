#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Defects that keep a surface from bounding a body. Each edge counts once, whatever the number of
/// its triangles.
struct SurfaceTopology {
    std::int64_t border_edges = 0;        ///< edges with one triangle
    std::int64_t non_manifold_edges = 0;  ///< edges with more than two triangles
    /// Edges that both of their triangles traverse in the same direction.
    std::int64_t misoriented_edges = 0;
    std::int64_t degenerate_triangles = 0;  ///< with a repeated node, or (nearly) no area
    /// Position of the first defect of the worst kind, metres; the origin if there is none.
    Vector3 place = Vector3::Zero();

    bool closed() const {
        return border_edges == 0 && non_manifold_edges == 0 && misoriented_edges == 0;
    }
};

/// Counts the defects. Throws Error if the surface has no triangles, an index out of range or a
/// node that is not finite.
SurfaceTopology check_topology(const TriangleMesh& surface);

/// The enclosed volume of a closed surface, m^3; negative if it is wound inwards.
double signed_volume(const TriangleMesh& surface);

/// The part number, from 0, of each triangle. Triangles that share a node belong to the same part.
std::vector<std::int32_t> connected_parts(const TriangleMesh& surface);

/// The parts as separate surfaces.
std::vector<TriangleMesh> parts_of(const TriangleMesh& surface);

/// Formats a position (metres) for messages: "(1.00, 2.00, 3.00) mm".
std::string place_mm(const Vector3& position);

/// Formats the bounding box of positions (metres) the same way: low and high corner.
std::string box_mm(std::span<const Vector3> positions);

}  // namespace livetet
