#pragma once

#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A body at rest and deformed, as linear tets: the motion that warps an image.
struct BodyMotion {
    std::vector<Tet> tets;                ///< first the body's own tets, then those of its rind
    std::size_t own = 0;                  ///< number of the body's own tets
    std::vector<Vector3> rest, deformed;  ///< node positions, metres, RAS
};

/// The motion of a P1 or P2 mesh whose nodes move by `displacement` (metres). A P2 tet becomes
/// eight linear tets through its ten nodes. A grid ends at the body's surface (clipped_grid).
///
/// A rind, `rind` metres thick along the surface normals (0: none), surrounds the body at rest and
/// deformed: half of the voxels that the surface runs through have their centres outside of the
/// mesh. A rigid motion moves the rind rigidly with the body. The two sides of a grid's cut, which
/// lie on each other at rest, have no rind, so that the gap is as wide as they part. Throws Error
/// unless there is one displacement a node.
BodyMotion body_motion(const TetMesh& mesh, std::span<const Vector3> displacement, double rind);

/// b - a for each node.
std::vector<Vector3> differences(std::span<const Vector3> a, std::span<const Vector3> b);

}  // namespace livetet
