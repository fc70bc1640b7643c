#pragma once

#include <cstdint>

#include "mesh/tet_mesh.hpp"

namespace livetet::testing_meshes {

/// A cube of 1 cm in six tets, with regions and sets.
inline TetMesh cube() {
    TetMesh mesh;
    for (int i = 0; i < 8; ++i)
        mesh.nodes.emplace_back(0.01 * (i & 1), 0.01 * (i >> 1 & 1), 0.01 * (i >> 2 & 1));
    mesh.tets = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                 {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
    mesh.regions = {1, 1, 1, 2, 2, 2};
    mesh.triangle_sets["bottom"] = {{0, 2, 3}, {0, 3, 1}};
    mesh.node_sets["bottom"] = {0, 1, 2, 3};
    mesh.node_sets["a/b.%2f"] = {7};
    return mesh;
}

inline void expect_same(const TetMesh& a, const TetMesh& b, double tolerance = 0) {
    ASSERT_EQ(a.nodes.size(), b.nodes.size());
    for (std::size_t n = 0; n < a.nodes.size(); ++n)
        EXPECT_LE((a.nodes[n] - b.nodes[n]).norm(), tolerance) << n;
    EXPECT_EQ(a.tets, b.tets);
    EXPECT_EQ(a.regions, b.regions);
    EXPECT_EQ(a.node_sets, b.node_sets);
    EXPECT_EQ(a.triangle_sets, b.triangle_sets);
}

}  // namespace livetet::testing_meshes
