#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// What keeps a surface from bounding a body. Edges are counted once each, whatever the number of
/// their triangles.
struct SurfaceTopology {
    std::int64_t border_edges = 0;        ///< with one triangle
    std::int64_t non_manifold_edges = 0;  ///< with more than two
    std::int64_t misoriented_edges =
        0;  ///< with two triangles that run through it in the same direction
    std::int64_t degenerate_triangles = 0;  ///< with a node twice, or (nearly) no area
    Vector3 place =
        Vector3::Zero();  ///< metres: the worst kind's first edge or triangle; else the origin

    bool closed() const {
        return border_edges == 0 && non_manifold_edges == 0 && misoriented_edges == 0;
    }
};

/// Counts the border, non-manifold and misoriented edges and the degenerate triangles. Throws Error
/// if the surface has no triangles, an index out of range or a node that is not finite.
SurfaceTopology check_topology(const TriangleMesh& surface);

/// The enclosed volume, in m^3, of a closed surface; negative if it is wound inwards.
double signed_volume(const TriangleMesh& surface);

/// For each triangle the number of its part, parts counted from 0: triangles that share a node
/// belong together.
std::vector<std::int32_t> connected_parts(const TriangleMesh& surface);

/// The parts, each with nodes of its own.
std::vector<TriangleMesh> parts_of(const TriangleMesh& surface);

/// The part with the largest enclosed volume (signed: a cavity's inside-out wall never wins), its
/// nodes renumbered.
TriangleMesh largest_part(const TriangleMesh& surface);

/// A place for messages: "(1.00, 2.00, 3.00) mm" of a position in metres.
std::string place_mm(const Vector3& position);

/// Where many positions lie, the same way: the low and the high corner of their box.
std::string box_mm(std::span<const Vector3> positions);

}  // namespace livetet
