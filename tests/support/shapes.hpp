#pragma once

#include <array>

#include "mesh/tet_mesh.hpp"

namespace livetet::test {

/// A block [0, a] x [0, b] x [0, c] m of nx x ny x nz cells, six tets each (Kuhn): conforming, positively oriented.
inline TetMesh block(std::array<int, 3> cells, Vector3 size) {
    TetMesh mesh;
    const auto node = [&](int i, int j, int k) { return i + (cells[0] + 1) * (j + (cells[1] + 1) * k); };
    for (int k = 0; k <= cells[2]; ++k)
        for (int j = 0; j <= cells[1]; ++j)
            for (int i = 0; i <= cells[0]; ++i)
                mesh.nodes.emplace_back(size.x() * i / cells[0], size.y() * j / cells[1], size.z() * k / cells[2]);
    constexpr int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (int k = 0; k < cells[2]; ++k)
        for (int j = 0; j < cells[1]; ++j)
            for (int i = 0; i < cells[0]; ++i)
                for (const auto& order : orders) {
                    std::array<int, 3> at{i, j, k};
                    Tet t{node(i, j, k), 0, 0, 0};
                    for (int s = 0; s < 3; ++s) {
                        ++at[order[s]];
                        t[s + 1] = node(at[0], at[1], at[2]);
                    }
                    if (signed_volume(mesh, t) < 0) std::swap(t[2], t[3]);
                    mesh.tets.push_back(t);
                }
    return mesh;
}

/// The nodes for which `chosen(x)` holds.
template <class Chosen>
std::vector<std::int32_t> nodes_where(const TetMesh& mesh, Chosen&& chosen) {
    std::vector<std::int32_t> nodes;
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        if (chosen(mesh.nodes[n])) nodes.push_back(static_cast<std::int32_t>(n));
    return nodes;
}

}  // namespace livetet::test
