#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

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

/// Places of a hexahedron's nodes in its own coordinates from 0 to 1, in the order of a format that
/// has the corners round the lower and then the upper face first: corners, middles of `edges` and
/// `faces`, given by their corners, and of the cell.
template <std::size_t edge_count, std::size_t face_count>
std::vector<Vector3> places_of_27(const int (&edges)[edge_count][2],
                                  const int (&faces)[face_count][4]) {
    std::vector<Vector3> at{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                            {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    for (const auto& [a, b] : edges) at.push_back((at[a] + at[b]) / 2);
    for (const auto& [a, b, c, d] : faces) at.push_back((at[a] + at[b] + at[c] + at[d]) / 4);
    at.emplace_back(0.5, 0.5, 0.5);
    return at;
}

/// Where a bent cell of some 10 mm has a place of these, mm: quadratic, so that the middles that 20
/// nodes leave out are where their shape functions have them.
inline Vector3 bent(const Vector3& x) {
    return {10 * x.x() + x.y() * x.y(), 10 * x.y() + 2 * x.x() * x.z(), 10 * x.z()};
}

/// That a mesh is that cell alone, each node in its place.
inline void expect_bent_cell(const TetMesh& mesh) {
    ASSERT_EQ(mesh.quadratic_hexahedra.size(), 1U);
    ASSERT_EQ(mesh.nodes.size(), 27U);
    for (int p = 0; p < 27; ++p) {
        const Vector3 exact = 1e-3 * bent({p % 3 / 2.0, p / 3 % 3 / 2.0, p / 9 / 2.0});
        EXPECT_LT((mesh.nodes[mesh.quadratic_hexahedra[0][p]] - exact).norm(), 1e-15) << p;
    }
}

}  // namespace livetet::testing_meshes
