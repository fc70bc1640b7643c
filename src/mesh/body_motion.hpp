#pragma once

#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A body at rest and deformed, as tets of four nodes, linear in each: what carries an image along.
struct BodyMotion {
    std::vector<Tet> tets;                ///< the body's own, then those of its rind
    std::size_t own = 0;                  ///< how many are the body's own
    std::vector<Vector3> rest, deformed;  ///< of each node, metres, RAS
};

/// The motion of a P1 or P2 mesh (each tet of the latter in eight, through its ten nodes) whose
/// nodes went by `displacement`, metres. About it lies a rind, `rind` metres thick (0: none) along
/// the normals of the surface, at rest and deformed: in voxels, half of which lie outside of a
/// surface that runs through them, a body ends a little beyond its mesh. A rigid motion carries the
/// rind as it carries the body. Throws Error where displacements are not one a node.
BodyMotion body_motion(const TetMesh& mesh, std::span<const Vector3> displacement, double rind);

/// b - a, row by row.
std::vector<Vector3> differences(std::span<const Vector3> a, std::span<const Vector3> b);

}  // namespace livetet
