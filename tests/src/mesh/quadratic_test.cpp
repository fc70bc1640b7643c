#include "mesh/quadratic.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/shapes.hpp"

namespace livetet {
namespace {

TetMesh named_block() {
    TetMesh mesh = test::block({3, 2, 2}, {0.3, 0.2, 0.2});
    for (const Triangle& t : boundary_triangles(mesh.tets))
        if (std::all_of(t.begin(), t.end(),
                        [&](std::int32_t n) { return mesh.nodes[n].x() < 1e-9; }))
            mesh.triangle_sets["face"].push_back(t);
    mesh.node_sets["face"] = nodes_of(mesh.triangle_sets["face"]);
    mesh.node_sets["edge"] =
        test::nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9 && x.y() < 1e-9; });
    return mesh;
}

TEST(QuadraticMesh, HasANodeInTheMiddleOfEachEdgeAndTakesSetsAlong) {
    const TetMesh linear = named_block(), mesh = quadratic_mesh(linear);
    check_tet_mesh(mesh, "test");
    EXPECT_EQ(corner_count(mesh), static_cast<std::int32_t>(linear.nodes.size()));
    EXPECT_EQ(mesh.nodes.size(), 7u * 5 * 5);  // Kuhn's subdivision: the grid of half the spacing
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        for (int k = 0; k < 6; ++k)
            EXPECT_LT(
                (mesh.nodes[mesh.edge_nodes[e][k]] - (mesh.nodes[mesh.tets[e][tet_edges[k][0]]] +
                                                      mesh.nodes[mesh.tets[e][tet_edges[k][1]]]) /
                                                         2)
                    .norm(),
                1e-15);
    EXPECT_EQ(mesh.node_sets.at("face").size(), 25u);
    EXPECT_EQ(mesh.node_sets.at("edge").size(), 5u);
    EXPECT_EQ(surface_nodes(mesh).size(), 7u * 5 * 5 - 5 * 3 * 3);
}

TEST(SurfaceNodes, AmongGivenOnesAreThoseOfThemOnTheSurface) {
    for (const TetMesh& mesh : {named_block(), quadratic_mesh(named_block())}) {
        const std::vector<std::int32_t> surface = surface_nodes(mesh);
        const auto count = static_cast<std::int32_t>(mesh.nodes.size());
        for (const std::int32_t step : {1, 2, 3, 7, 40}) {
            std::vector<std::int32_t> nodes, expected;
            for (std::int32_t n = step / 2; n < count; n += step) nodes.push_back(n);
            std::set_intersection(nodes.begin(), nodes.end(), surface.begin(), surface.end(),
                                  std::back_inserter(expected));
            EXPECT_EQ(surface_nodes_among(mesh, nodes), expected) << step;
        }
        EXPECT_TRUE(surface_nodes_among(mesh, {}).empty());
    }
}

TEST(EdgeNodes, OfSomeTrianglesAreThoseOfTheMeshOnTheirEdges) {
    const TetMesh mesh = quadratic_mesh(named_block());
    std::vector<Triangle> triangles = boundary_triangles(mesh.tets);
    triangles.resize(5);
    const EdgeNodes all(mesh), some(mesh, triangles);
    for (const Triangle& t : triangles) EXPECT_EQ(traction_nodes(t, some), traction_nodes(t, all));
    const auto& far = mesh.tets.back();
    EXPECT_GE(all.between(far[0], far[3]), 0);
    EXPECT_EQ(some.between(far[0], far[3]), -1);
    EXPECT_TRUE(EdgeNodes(named_block(), triangles).empty());
}

TEST(QuadraticMesh, InterpolatesQuadraticFieldsExactly) {
    const TetMesh mesh = quadratic_mesh(named_block());
    const EdgeNodes edges(mesh);
    const auto field = [](const Vector3& x) {
        return Vector3(x.x() * x.y(), x.z() * x.z() - x.x(), 1 + x.y() * x.z());
    };
    std::vector<Vector3> values, points;
    for (const Vector3& x : mesh.nodes) values.push_back(field(x));
    for (int i = 0; i < 20; ++i)
        points.push_back(
            {0.29 * i / 20 + 0.003, 0.19 * ((7 * i) % 20) / 20, 0.19 * ((3 * i) % 20) / 20});
    const BarycentricMap map = map_into(mesh, points);
    for (std::size_t i = 0; i < points.size(); ++i)
        EXPECT_LT((interpolate(map, edges, i, values) - field(points[i])).norm(), 1e-12);
}

TEST(QuadraticLevel, StandsOnTheLinearOne) {
    const MeshHierarchy hierarchy = with_quadratic_level(make_hierarchy({named_block()}, "test"));
    ASSERT_EQ(hierarchy.levels.size(), 2u);
    const auto& map = hierarchy.transfers.front();
    for (std::size_t n = 0; n < map.size(); ++n) {
        Vector3 x = Vector3::Zero();
        for (int k = 0; k < 4; ++k)
            x += map.weights[n][k] * hierarchy.levels[1].nodes[map.nodes[n][k]];
        EXPECT_LT((x - hierarchy.levels[0].nodes[n]).norm(), 1e-15);
    }
}

}  // namespace
}  // namespace livetet
