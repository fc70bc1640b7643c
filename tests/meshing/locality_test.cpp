#include "meshing/locality.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "mesh/shapes.hpp"

namespace livetet {
namespace {

/// The same body with nodes and tets in random order.
TetMesh shuffled(const TetMesh& mesh) {
    std::mt19937 random(11);
    std::vector<std::int32_t> number(mesh.nodes.size());
    std::iota(number.begin(), number.end(), 0);
    std::shuffle(number.begin(), number.end(), random);
    TetMesh out = mesh;
    for (std::size_t n = 0; n < number.size(); ++n) out.nodes[number[n]] = mesh.nodes[n];
    std::shuffle(out.tets.begin(), out.tets.end(), random);
    for (Tet& t : out.tets) {
        for (std::int32_t& n : t) n = number[n];
        std::rotate(t.begin(), t.begin() + random() % 3, t.begin() + 3);
    }
    return out;
}

double mean_spread(const TetMesh& mesh) {
    double sum = 0;
    for (const Tet& t : mesh.tets) {
        const auto [low, high] = std::minmax_element(t.begin(), t.end());
        sum += *high - *low;
    }
    return sum / static_cast<double>(mesh.tets.size());
}

TEST(Locality, is_the_same_for_every_order_given) {
    TetMesh a = shapes::box({0.15, 0.11, 0.08}, {9, 7, 5}), b = shuffled(a);
    sort_for_locality(a);
    sort_for_locality(b);
    EXPECT_EQ(a.nodes, b.nodes);
    EXPECT_EQ(a.tets, b.tets);
    check_tet_mesh(a, "box");
    EXPECT_NEAR(volume(a), 0.15 * 0.11 * 0.08, 1e-15);
}

TEST(Locality, brings_neighbours_near_and_sorts_tets_by_their_lowest_node) {
    TetMesh mesh = shuffled(shapes::box({0.1, 0.1, 0.1}, {16, 16, 16}));
    const double before = mean_spread(mesh);
    sort_for_locality(mesh);
    EXPECT_LT(mean_spread(mesh), 0.2 * before);
    for (const Tet& t : mesh.tets) ASSERT_EQ(t[0], *std::min_element(t.begin(), t.end()));
    EXPECT_TRUE(std::is_sorted(mesh.tets.begin(), mesh.tets.end()));
}

TEST(Locality, carries_regions_and_sets_along) {
    TetMesh mesh = shuffled(shapes::box({0.1, 0.1, 0.1}, {4, 4, 4}));
    const auto left = [](const Vector3& x) { return x.x() < 0.04; };
    const auto centre = [](const TetMesh& m, const Tet& t) {
        return ((m.nodes[t[0]] + m.nodes[t[1]] + m.nodes[t[2]] + m.nodes[t[3]]) / 4).eval();
    };
    for (const Tet& t : mesh.tets) mesh.regions.push_back(left(centre(mesh, t)) ? 1 : 2);
    for (std::int32_t n = 0; n < static_cast<std::int32_t>(mesh.nodes.size()); ++n)
        if (left(mesh.nodes[n])) mesh.node_sets["left"].push_back(n);
    const std::size_t count = mesh.node_sets["left"].size();
    mesh.triangle_sets["skin"] = boundary_triangles(mesh.tets);
    sort_for_locality(mesh);
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        EXPECT_EQ(mesh.regions[e], left(centre(mesh, mesh.tets[e])) ? 1 : 2);
    EXPECT_EQ(mesh.node_sets["left"].size(), count);
    EXPECT_TRUE(std::is_sorted(mesh.node_sets["left"].begin(), mesh.node_sets["left"].end()));
    for (const std::int32_t n : mesh.node_sets["left"]) EXPECT_TRUE(left(mesh.nodes[n]));
    EXPECT_EQ(nodes_of(mesh.triangle_sets["skin"]), nodes_of(boundary_triangles(mesh.tets)));
}

}  // namespace
}  // namespace livetet
