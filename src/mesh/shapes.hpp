#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>

#include "mesh/tet_mesh.hpp"

/// Meshes of simple shapes, for tests, benchmarks and examples.
namespace livetet::shapes {

/// The box [0, size] of n[0] x n[1] x n[2] bricks with six tets each (Kuhn's subdivision: one for
/// each order of the three axes).
inline TetMesh box(const Vector3& size, std::array<int, 3> n) {
    TetMesh mesh;
    const auto node = [&](int i, int j, int k) { return i + (n[0] + 1) * (j + (n[1] + 1) * k); };
    for (int k = 0; k <= n[2]; ++k)
        for (int j = 0; j <= n[1]; ++j)
            for (int i = 0; i <= n[0]; ++i)
                mesh.nodes.push_back(size.cwiseProduct(Vector3(static_cast<double>(i) / n[0],
                                                               static_cast<double>(j) / n[1],
                                                               static_cast<double>(k) / n[2])));
    constexpr int orders[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
            for (int i = 0; i < n[0]; ++i)
                for (int o = 0; o < 6; ++o) {
                    int at[3] = {i, j, k};
                    Tet t{node(i, j, k), 0, 0, 0};
                    for (int step = 0; step < 3; ++step) {
                        ++at[orders[o][step]];
                        t[step + 1] = node(at[0], at[1], at[2]);
                    }
                    // Odd permutations of the axes have the opposite winding.
                    if (o >= 3) std::swap(t[2], t[3]);
                    mesh.tets.push_back(t);
                }
    return mesh;
}

/// A sphere around `centre`: an icosahedron whose triangles are split into four `splits` times,
/// with the nodes projected onto the sphere.
inline TriangleMesh sphere(double radius, int splits, const Vector3& centre = Vector3::Zero()) {
    const double g = std::numbers::phi;
    TriangleMesh mesh;
    mesh.nodes = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                  {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
    mesh.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                      {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                      {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                      {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    for (int s = 0; s < splits; ++s) {
        std::map<std::pair<int, int>, std::int32_t> middles;
        const auto middle = [&](std::int32_t a, std::int32_t b) {
            const auto [place, fresh] = middles.try_emplace(
                std::minmax(a, b), static_cast<std::int32_t>(mesh.nodes.size()));
            if (fresh) mesh.nodes.push_back((mesh.nodes[a] + mesh.nodes[b]) / 2);
            return place->second;
        };
        std::vector<Triangle> split;
        for (const auto& [a, b, c] : mesh.triangles) {
            const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
            split.insert(split.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
        }
        mesh.triangles = std::move(split);
    }
    for (Vector3& x : mesh.nodes) x = centre + radius * x.normalized();
    return mesh;
}

/// Mean length of the triangles' edges.
inline double mean_edge(const TriangleMesh& surface) {
    double sum = 0;
    for (const auto& [a, b, c] : surface.triangles)
        for (const auto& [i, j] : {std::pair{a, b}, {b, c}, {c, a}})
            sum += (surface.nodes[i] - surface.nodes[j]).norm();
    return sum / (3.0 * static_cast<double>(surface.triangles.size()));
}

}  // namespace livetet::shapes
