#pragma once

#include <random>

#include "mesh/tet_mesh.hpp"

namespace livetet::test {

/// A mesh whose inner nodes have moved by up to `most` (m) in each direction, as nodes of a mesher
/// would not lie in rows.
inline TetMesh shaken(TetMesh mesh, double most) {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> any(-most, most);
    std::vector<std::uint8_t> is_outside(mesh.nodes.size(), 0);
    for (const std::int32_t n : nodes_of(boundary_triangles(mesh.tets))) is_outside[n] = 1;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        if (!is_outside[n]) mesh.nodes[n] += Vector3(any(random), any(random), any(random));
    return mesh;
}

}  // namespace livetet::test
