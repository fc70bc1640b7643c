// Ten-node tets that open as the four-node tets below them do.

#include "mesh/opened_quadratic.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "mesh/mesh_pieces.hpp"
#include "mesh/openable_tets.hpp"
#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A box of 60 mm in ten-node tets, the same in four-node ones, and a coarser level.
std::vector<TetMesh> levels_of_box() {
    MeshHierarchy linear = make_hierarchy({test::block({6, 6, 6}, Vector3::Constant(0.06)),
                                           test::block({3, 3, 3}, Vector3::Constant(0.06))},
                                          "a box");
    linear.levels.front().node_sets["table"] =
        test::nodes_where(linear.levels.front(), [](const Vector3& x) { return x.z() < 1e-9; });
    linear.levels.front().triangle_sets["border"] = boundary_triangles(linear.levels.front().tets);
    return with_quadratic_level(std::move(linear)).levels;
}

/// The rectangle with a corner at `from` and two edges.
TriangleMesh rectangle(const Vector3& from, const Vector3& a, const Vector3& b) {
    return {{from, from + a, from + b, from + a + b}, {{0, 1, 3}, {0, 3, 2}}};
}

const Vector3& node_of(const TetMesh& mesh, std::size_t e, int i) {
    return mesh.nodes[i < 4 ? mesh.tets[e][i] : mesh.edge_nodes[e][i - 4]];
}

/// It is the quadratic form of the opened four-node tets but for its numbers: each pair of ends has
/// one midpoint, which no other has.
void expect_quadratic_form(const TetMesh& mesh, const TetMesh& linear) {
    check_tet_mesh(mesh, "opened");
    const TetMesh wanted = quadratic_mesh(linear);
    ASSERT_EQ(mesh.nodes.size(), wanted.nodes.size());
    std::map<std::int32_t, std::int32_t> number;  // of a node of `wanted` in `mesh`
    std::set<std::int32_t> used;
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        for (int i = 0; i < 10; ++i) {
            EXPECT_EQ(node_of(mesh, e, i), node_of(wanted, e, i));
            const std::int32_t n = i < 4 ? mesh.tets[e][i] : mesh.edge_nodes[e][i - 4],
                               w = i < 4 ? wanted.tets[e][i] : wanted.edge_nodes[e][i - 4];
            ASSERT_EQ(number.try_emplace(w, n).first->second, n) << e << ", node " << i;
            used.insert(n);
        }
    EXPECT_EQ(used.size(), mesh.nodes.size());
    const auto renumbered = [&](std::vector<std::int32_t> nodes) {
        for (std::int32_t& n : nodes) n = number.at(n);
        std::sort(nodes.begin(), nodes.end());
        return nodes;
    };
    EXPECT_EQ(mesh.node_sets.at("table"), renumbered(wanted.node_sets.at("table")));
    const auto &border = mesh.triangle_sets.at("border"),
               &wanted_border = wanted.triangle_sets.at("border");
    ASSERT_EQ(border.size(), wanted_border.size());
    for (std::size_t i = 0; i < border.size(); ++i)
        for (int k = 0; k < 3; ++k) EXPECT_EQ(border[i][k], number.at(wanted_border[i][k]));
}

/// A quadratic field is carried over exactly: nodes keep their numbers, moved ones take its values
/// where they are now.
void expect_carried(const TetMesh& before, const TetMesh& after, const OpenedNodes& nodes) {
    const auto field = [](const Vector3& x) -> Vector3 {
        return {x.x() * x.y() - 2 * x.z() * x.z(), 0.3 * x.x(), x.y() * x.y() + 0.01 * x.z()};
    };
    std::vector<Vector3> u;
    for (const Vector3& x : before.nodes) u.push_back(field(x));
    carry_values(u, nodes);
    ASSERT_EQ(u.size(), after.nodes.size());
    for (std::size_t n = 0; n < u.size(); ++n)
        EXPECT_LT((u[n] - field(after.nodes[n])).norm(), 1e-14) << n;
    std::set<std::int32_t> moved;
    for (const MovedNode& m : nodes.moved) {
        moved.insert(m.node);
        EXPECT_LT((before.nodes[m.node] + m.way - after.nodes[m.node]).norm(), 1e-15);
    }
    EXPECT_EQ(moved.size(), nodes.moved.size());
    for (std::size_t n = 0; n < before.nodes.size(); ++n)
        EXPECT_EQ(moved.contains(static_cast<std::int32_t>(n)), before.nodes[n] != after.nodes[n]);
    for (std::size_t k = 0; k < nodes.originals.size(); ++k)
        EXPECT_EQ(after.nodes[before.nodes.size() + k], after.nodes[nodes.originals[k]]);
}

/// Three cuts, one after another, of which the last parts the body.
TEST(OpenedQuadratic, IsTheQuadraticFormOfTheOpenedTets) {
    std::vector<TetMesh> levels = levels_of_box();
    OpenableTets tets({levels.begin() + 1, levels.end()}, "box");
    const TriangleMesh cuts[] = {
        rectangle({0.0283, -0.1, 0.0312}, {0.002, 0.2, 0.01}, {0.001, 0, 0.1}),
        rectangle({0.0311, -0.1, 0.0412}, {0, 0.2, 0}, {0.1, 0, 0.02}),
        rectangle({0.0283, -0.1, -0.0312}, {0.002, 0.2, 0.01}, {0.001, 0, 0.1})};
    std::size_t pieces = 0, moved_midpoints = 0;
    for (const TriangleMesh& cut : cuts) {
        ASSERT_GT(tets.cut(cut), 0U);
        const OpenedLevels opened =
            with_opened_quadratic(levels, tets.open({levels.begin() + 1, levels.end()}));
        tets.keep();
        ASSERT_EQ(opened.levels.size(), levels.size());
        expect_quadratic_form(opened.levels[0], opened.levels[1]);
        expect_carried(levels[0], opened.levels[0], opened.nodes);
        moved_midpoints += opened.nodes.moved.size();
        pieces = mesh_pieces(opened.levels[0]).size();
        const BarycentricMap map = map_into_linear(opened.levels[0], opened.levels[1]);
        for (std::size_t n = 0; n < map.size(); ++n)
            EXPECT_LT(
                (interpolate(map, n, opened.levels[1].nodes) - opened.levels[0].nodes[n]).norm(),
                1e-15);
        levels = opened.levels;
    }
    EXPECT_EQ(pieces, 3U);
    EXPECT_GT(moved_midpoints, 100U);
}

/// Places in the body and half a millimetre outside of it stay in their tets.
TEST(OpenedQuadratic, PlacesStayInTheirTets) {
    const std::vector<TetMesh> levels = levels_of_box();
    OpenableTets tets({levels.begin() + 1, levels.end()}, "box");
    tets.cut(rectangle({0.0283, -0.1, -0.1}, {0.002, 0.3, 0.01}, {0.001, 0, 0.3}));
    const OpenedLevels opened =
        with_opened_quadratic(levels, tets.open({levels.begin() + 1, levels.end()}));
    const TetMesh &before = levels.front(), &after = opened.levels.front();
    std::vector<Vector3> places, points;
    for (const double x : {0.003, 0.021, 0.027, 0.033, 0.038, 0.055})
        for (const double y : {0.001, 0.022, 0.048})
            for (const double z : {0.013, 0.041, 0.06}) {
                places.emplace_back(x, y, z);
                points.emplace_back(x, y, z == 0.06 ? 0.0605 : z);
            }
    const PointSampler cut = PointSampler(before, points).after_cut(before, after);
    const MeshPiece piece = mesh_pieces(after).back();
    std::vector<Vector3> pieces(after.nodes.size(), Vector3::Zero());
    for (const std::int32_t n : nodes_of_pieces({&piece, 1}, after)) pieces[n] = Vector3::Ones();
    for (std::size_t i = 0; i < places.size(); ++i) {
        EXPECT_LT((cut.sample(i, after.nodes) - places[i]).norm(), 1e-15);
        if (std::abs(places[i].x() - 0.03) < 0.005) continue;
        const bool is_right = places[i].x() > 0.03;
        EXPECT_NEAR(cut.sample(i, pieces).x(), is_right == (piece.centroid.x() > 0.03), 1e-14);
    }
}

/// A blade's place at rest in a body that is bent as ten nodes can be.
TEST(OpenedQuadratic, RestPlacesFollowTheMidpoints) {
    const std::vector<TetMesh> levels = levels_of_box();
    const OpenableTets tets({levels.begin() + 1, levels.end()}, "box");
    const auto bend = [](const Vector3& x) -> Vector3 {
        return {3 * x.z() * x.z() - 2 * x.x() * x.y(), 0.1 * x.x(), -4 * x.x() * x.x()};
    };
    std::vector<Vector3> u;
    for (const Vector3& x : levels.front().nodes) u.push_back(bend(x));
    for (const Vector3& x : {Vector3(0.021, 0.032, 0.017), Vector3(0.0551, 0.0127, 0.0413)})
        EXPECT_LT((tets.rest_place(x + bend(x), levels.front(), u) - x).norm(), 2e-9);
}

}  // namespace
}  // namespace livetet
