// Rest places of points of a deformed grid, against closed forms.

#include "mesh/rest_places.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <functional>
#include <random>

#include "mesh/hex_cut.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

RestPlaces places_in(const TetMesh& mesh) {
    const HexLevel level = hex_level_of(mesh, "grid");
    return {level, grid_frame(mesh, level)};
}

std::vector<Vector3> field(const TetMesh& mesh, const std::function<Vector3(const Vector3&)>& u) {
    std::vector<Vector3> values;
    for (const Vector3& x : mesh.nodes) values.push_back(u(x));
    return values;
}

/// Trilinear fields hold linear ones: the inverse of the map is known.
TEST(RestPlaces, OfALinearMapAreItsInverse) {
    const TetMesh mesh = test::hex_grid({8, 5, 6}, {0.08, 0.04, 0.06});
    const RestPlaces rest = places_in(mesh);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> share(0.01, 0.99);
    Eigen::Matrix3d sheared = Eigen::Matrix3d::Identity();
    sheared(0, 1) = 0.8;
    const Vector3 off(0.013, -0.004, 0.021);
    for (const Eigen::Matrix3d& F :
         {Eigen::Matrix3d(Eigen::Matrix3d::Identity()),
          Eigen::Matrix3d(Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized())), sheared,
          Eigen::Matrix3d(Vector3(0.4, 1.5, 1.3).asDiagonal()),
          Eigen::Matrix3d(Vector3(2.6, 0.7, 0.6).asDiagonal())}) {
        const auto u = field(mesh, [&](const Vector3& x) -> Vector3 { return F * x + off - x; });
        for (int trial = 0; trial < 100; ++trial) {
            const Vector3 x(0.08 * share(random), 0.04 * share(random), 0.06 * share(random));
            EXPECT_LT((rest.rest_place(F * x + off, mesh.hexahedra, u) - x).norm(), 1e-7) << F;
        }
    }
}

TEST(RestPlaces, OutsideTheBodyFollowTheNearestOfIt) {
    // An L: the block at high x and y is missing.
    const TetMesh mesh = test::hex_grid({6, 6, 2}, {6, 6, 2},
                                        [](const Vector3& x) { return x.x() < 2 || x.y() < 2; });
    const RestPlaces rest = places_in(mesh);
    EXPECT_TRUE(rest.holds({1.5, 5.5, 0.2}));
    EXPECT_TRUE(rest.holds({5.5, 0.5, 1.8}));
    for (const Vector3& x : {Vector3(5, 5, 1), Vector3(-0.1, 3, 1), Vector3(1, 6.1, 1)})
        EXPECT_FALSE(rest.holds(x)) << x.transpose();
    const Vector3 shift(40, -30, 20);
    const std::vector<Vector3> u(mesh.nodes.size(), shift);
    for (const Vector3& x : {Vector3(5, 5, 1), Vector3(-70, 3, 1), Vector3(5, 400, 2)})
        EXPECT_LT((rest.rest_place(x + shift, mesh.hexahedra, u) - x).norm(), 1e-6);
    // Above the end of one arm, which alone moves: as that arm.
    const auto of_arm =
        field(mesh, [](const Vector3& x) { return Vector3(0, 0, x.x() > 4 ? 1 : 0); });
    EXPECT_LT((rest.rest_place({5.5, 1, 4}, mesh.hexahedra, of_arm) - Vector3(5.5, 1, 3)).norm(),
              1e-6);
    EXPECT_LT((rest.rest_place({1, 5.5, 4}, mesh.hexahedra, of_arm) - Vector3(1, 5.5, 4)).norm(),
              1e-6);
}

/// Smooth and large, by 60 degrees: forth by the trilinear field, back by iteration.
TEST(RestPlaces, OfABentBodyAreFound) {
    const TetMesh mesh = test::hex_grid({20, 4, 4}, {0.2, 0.04, 0.04});
    const RestPlaces rest = places_in(mesh);
    const auto bend = [](const Vector3& x) -> Vector3 {
        const double R = 0.19, angle = x.x() / R;
        return Vector3((R - x.z()) * std::sin(angle), x.y(), R - (R - x.z()) * std::cos(angle)) - x;
    };
    const auto u = field(mesh, bend);
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
        Vector3 x = Vector3::Zero(), moved = Vector3::Zero();
        for (const std::int32_t n : mesh.hexahedra[e]) x += mesh.nodes[n] / 8, moved += u[n] / 8;
        EXPECT_LT((rest.rest_place(x + moved, mesh.hexahedra, u) - x).norm(), 1e-6) << e;
    }
}

/// Nothing is in the gap of a cut: its points belong to the cut.
TEST(RestPlaces, InTheGapOfACutLieOnTheCut) {
    const TetMesh whole = test::hex_grid({6, 4, 4}, {6, 4, 4});
    const HexLevel level = hex_level_of(whole, "grid");
    const GridFrame frame = grid_frame(whole, level);
    const TetMesh mesh = without_links(
        whole, level, crossed_links(level, frame, PlanePatch{{3, 0, 0}, {1, 0, 0}}, "cut"));
    std::vector<Vector3> u(mesh.nodes.size(), Vector3::Zero());
    for (const Hexahedron& cell : mesh.hexahedra)
        if (mesh.nodes[cell[0]].x() > 2.9)
            for (const std::int32_t n : cell) u[n] = Vector3(2.5, 0, 0);
    const RestPlaces rest(level, frame);
    for (const double x : {3.2, 4.0, 5.3})
        EXPECT_LT((rest.rest_place({x, 1.7, 2.2}, mesh.hexahedra, u) - Vector3(3, 1.7, 2.2)).norm(),
                  0.1)
            << x;
    EXPECT_LT((rest.rest_place({2.6, 1.7, 2.2}, mesh.hexahedra, u) - Vector3(2.6, 1.7, 2.2)).norm(),
              1e-6);
    EXPECT_LT((rest.rest_place({5.9, 1.7, 2.2}, mesh.hexahedra, u) - Vector3(3.4, 1.7, 2.2)).norm(),
              1e-6);
}

/// Thin and long across its box: the table of near cells has blocks of many places.
TEST(RestPlaces, OfASparseGridInALargeBoxAreFound) {
    std::vector<HexPlace> places;
    std::vector<HexLink> links;
    for (int i = 0; i < 400; ++i)
        for (const HexPlace& step : {HexPlace{0, 0, 0}, {1, 0, 0}, {1, 1, 0}}) {
            const auto next = static_cast<std::int32_t>(places.size());
            places.push_back({i + step[0], i + step[1], i});
            if (step[0] == 1) links.push_back({next - 1, next, step[1] == 0 ? 0 : 1});
            if (i > 0 && step[0] == 0) links.push_back({next - 1, next, 2});
        }
    const HexLevel level = make_hex_level(places, links);
    const RestPlaces rest(level, GridFrame{});
    std::vector<Vector3> u(static_cast<std::size_t>(level.nodes), Vector3(0.3, 0, 0));
    for (const std::int32_t n : level.cells.back()) u[n] = Vector3(0.3, 7, 0);
    EXPECT_LT(
        (rest.rest_place({200.8, 200.5, 200.5}, level.cells, u) - Vector3(200.5, 200.5, 200.5))
            .norm(),
        1e-6);
    EXPECT_LT(
        (rest.rest_place({400.8, 407.5, 399.5}, level.cells, u) - Vector3(400.5, 400.5, 399.5))
            .norm(),
        1e-6);
}

}  // namespace
}  // namespace livetet
