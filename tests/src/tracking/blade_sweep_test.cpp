// What a blade sweeps, and which links of a grid that cuts: against surfaces known in closed form.

#include "tracking/blade_sweep.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "mesh/hex_cut.hpp"
#include "mesh/mesh_pieces.hpp"
#include "mesh/rest_places.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

constexpr double cell = 0.005;

struct SweptBlock {
    TetMesh mesh = test::hex_grid({12, 10, 8}, cell* Vector3(12, 10, 8));
    HexLevel level = hex_level_of(mesh, "grid");
    GridFrame frame = grid_frame(mesh, level);
    LinkCrossings crossings{level, frame};

    std::vector<std::uint8_t> crossed_by(const CutSurface& surface) const {
        return crossed_links(level, frame, surface, "cut");
    }
};

/// What a blade cuts on its way: `edge_at` by the number of the frame.
template <class EdgeAt>
std::vector<std::uint8_t> cut_by_blade(const SweptBlock& block, int frames, const EdgeAt& edge_at,
                                       const BladeSweep::RestPlace& rest_place) {
    BladeSweep sweep({.longest_edge = cell / 2});
    std::vector<std::uint8_t> cut(block.level.links.size(), 0);
    for (int k = 0; k < frames; ++k)
        block.crossings.mark(sweep.follow(0.04 * k, edge_at(k), rest_place), cut, "blade");
    return cut;
}

const BladeSweep::RestPlace at_rest = [](const Vector3& y) { return y; };

/// From `start` by `way` in equal steps.
auto translated(const BladeEdge& start, const Vector3& way, int frames) {
    return [=](int k) -> std::optional<BladeEdge> {
        const Vector3 moved = static_cast<double>(k) / (frames - 1) * way;
        return BladeEdge{start[0] + moved, start[1] + moved};
    };
}

PlanePatch parallelogram(const BladeEdge& start, const Vector3& way) {
    const Vector3 along = start[1] - start[0];
    return {start[0] + (along + way) / 2, along.cross(way), {}, std::array{along, way}};
}

/// A blade that moves straight through a body at rest parts what `cuts:` with the parallelogram
/// parts: no link more, none less, however long the steps.
TEST(BladeSweep, ATranslatedBladeCutsTheParallelogram) {
    const SweptBlock block;
    for (const auto& [start, way] :
         {std::pair{BladeEdge{Vector3(0.0311, 0.0123, -0.003), Vector3(0.0311, 0.0123, 0.0271)},
                    Vector3(0, 0.0309, 0)},
          std::pair{BladeEdge{Vector3(0.011, 0.003, 0.007), Vector3(0.029, 0.019, 0.033)},
                    Vector3(0.021, 0.013, -0.0042)},
          std::pair{BladeEdge{Vector3(-0.02, 0.0212, 0.0151), Vector3(0.09, 0.0233, 0.0172)},
                    Vector3(0.003, 0.071, 0.0112)}})
        for (const int frames : {9, 25, 150}) {
            const auto cut = cut_by_blade(block, frames, translated(start, way, frames), at_rest);
            EXPECT_GT(std::ranges::count(cut, 1), 20);
            EXPECT_EQ(cut, block.crossed_by(parallelogram(start, way))) << frames << " frames";
        }
}

/// From frame to frame a blade that tilts and swings leaves no link between its two sides.
TEST(BladeSweep, ASwingingBladeLeavesNoHole) {
    const SweptBlock block;
    // Down along a slanted path through the whole width, tilting on the way.
    const auto edge_at = [](int k) -> std::optional<BladeEdge> {
        const double z = 0.045 - 0.05 * k / 60.0, x = 0.03 + 0.004 * std::sin(0.3 * k);
        return BladeEdge{Vector3(x - 0.003, -0.01, z), Vector3(x + 0.002, 0.06, z + 0.001)};
    };
    const auto cut = cut_by_blade(block, 61, edge_at, at_rest);
    EXPECT_EQ(mesh_pieces(without_links(block.mesh, block.level, cut)).size(), 2U);
}

/// In a deformed body the blade meets the tissue that is there: at rest, the sweep carried back.
TEST(BladeSweep, InADeformedBodyTheCutLandsWhereTheTissueWasAtRest) {
    const SweptBlock block;
    Eigen::Matrix3d F = Eigen::Matrix3d(Eigen::AngleAxisd(0.4, Vector3(1, -1, 2).normalized()));
    F = F * Vector3(1.3, 0.8, 0.9).asDiagonal();
    const Vector3 off(0.02, 0.01, -0.03);
    std::vector<Vector3> u;
    for (const Vector3& x : block.mesh.nodes) u.push_back(F * x + off - x);
    const RestPlaces rest(block.level, block.frame);
    // Inside at rest, so that the displacement is known all along the blade.
    const BladeEdge start{Vector3(0.0311, 0.0123, 0.004), Vector3(0.0322, 0.0143, 0.0271)};
    const Vector3 way(0.0041, 0.0309, 0.0022);
    const BladeEdge now{F * start[0] + off, F * start[1] + off};
    const auto cut = cut_by_blade(block, 30, translated(now, F * way, 30), [&](const Vector3& y) {
        return rest.rest_place(y, block.mesh.hexahedra, u);
    });
    EXPECT_EQ(cut, block.crossed_by(parallelogram(start, way)));
    EXPECT_NE(cut, block.crossed_by(parallelogram(now, F * way)));
}

/// The triangles that a blade sweeps between two frames.
std::size_t swept_in_one_step(double seconds, const Vector3& way, bool is_seen_between = true) {
    BladeSweep sweep({.longest_edge = cell / 2});
    const BladeEdge edge{Vector3(0.01, 0.004, 0.0), Vector3(0.01, 0.006, 0.0)};
    (void)sweep.follow(0, edge, at_rest);
    if (!is_seen_between) {
        EXPECT_TRUE(sweep.follow(seconds / 2, {}, at_rest).triangles.empty());
    }
    return sweep.follow(seconds, BladeEdge{edge[0] + way, edge[1] + way}, at_rest).triangles.size();
}

TEST(BladeSweep, AJumpOrAGapBeginsANewSweep) {
    EXPECT_GT(swept_in_one_step(0.04, {0, 0, 0.019}), 0U);
    EXPECT_EQ(swept_in_one_step(0.04, {0, 0, 0.021}), 0U) << "a jump";
    EXPECT_GT(swept_in_one_step(0.49, {0, 0, 0.01}), 0U) << "frames were missed";
    EXPECT_EQ(swept_in_one_step(0.51, {0, 0, 0.01}), 0U) << "a gap";
    EXPECT_EQ(swept_in_one_step(-0.04, {0, 0, 0.01}), 0U) << "time goes back";
    EXPECT_GT(swept_in_one_step(0.2, {0, 0, 0.01}, false), 0U) << "missing in one frame";
    EXPECT_EQ(swept_in_one_step(0.4, {0, 0, 0.01}, false), 0U) << "lost";
    BladeSweep sweep({.longest_edge = cell / 2});
    const BladeEdge edge{Vector3(0.01, 0.004, 0.0), Vector3(0.01, 0.006, 0.0)};
    const BladeEdge next{edge[0] + Vector3(0, 0, 0.01), edge[1] + Vector3(0, 0, 0.01)};
    (void)sweep.follow(0, edge, at_rest);
    sweep.restart();
    EXPECT_TRUE(sweep.follow(0.04, next, at_rest).triangles.empty()) << "told to begin anew";
    const auto torn = [](const Vector3& y) -> Vector3 {
        return y.z() > 0.015 ? y + Vector3(0.1, 0, 0) : y;
    };
    const BladeEdge far{edge[0] + Vector3(0, 0, 0.019), edge[1] + Vector3(0, 0, 0.019)};
    (void)sweep.follow(0.08, next, torn);
    EXPECT_TRUE(sweep.follow(0.12, far, torn).triangles.empty()) << "a jump at rest";
}

TEST(BladeSweep, TellsOfTheWayThatItDoesNotCut) {
    BladeSweep sweep({.longest_edge = cell / 2});
    const BladeEdge edge{Vector3(0.01, 0.004, 0.0), Vector3(0.01, 0.006, 0.0)};
    const auto moved = [&](double z) {
        return BladeEdge{edge[0] + Vector3(0, 0, z), edge[1] + Vector3(0, 0, z)};
    };
    (void)sweep.follow(0, edge, at_rest);
    EXPECT_FALSE(sweep.gap()) << "the first frame";
    (void)sweep.follow(0.04, moved(0.01), at_rest);
    EXPECT_FALSE(sweep.gap());
    (void)sweep.follow(0.08, moved(0.035), at_rest);
    ASSERT_TRUE(sweep.gap()) << "a jump";
    EXPECT_NEAR(sweep.gap()->length, 0.025, 1e-12);
    EXPECT_NEAR(sweep.gap()->before.front().z(), 0.01, 1e-12);
    EXPECT_NEAR(sweep.gap()->after.front().z(), 0.035, 1e-12);
    (void)sweep.follow(0.12, {}, at_rest);
    EXPECT_FALSE(sweep.gap());
    (void)sweep.follow(0.4, moved(0.036), at_rest);
    EXPECT_TRUE(sweep.gap()) << "not seen for too long";
    sweep.restart();
    (void)sweep.follow(0.44, moved(0.07), at_rest);
    EXPECT_FALSE(sweep.gap()) << "told to begin anew";
}

TEST(BladeSweep, ItsWorkIsBounded) {
    BladeSweep sweep({.longest_edge = 1e-5});
    int carried = 0;
    const auto count = [&](const Vector3& y) {
        ++carried;
        return y;
    };
    const BladeEdge edge{Vector3(-0.5, 0, 0), Vector3(0.5, 0, 0)};
    (void)sweep.follow(0, edge, count);
    const auto& surface = sweep.follow(
        0.04, BladeEdge{edge[0] + Vector3(0, 0.02, 0), edge[1] + Vector3(0, 0.02, 0)}, count);
    EXPECT_EQ(carried, 2 * 256);
    EXPECT_EQ(surface.triangles.size(), 2U * 255 * 64);
    double area = 0;
    for (const Triangle& t : surface.triangles)
        area += 0.5 * (surface.nodes[t[1]] - surface.nodes[t[0]])
                          .cross(surface.nodes[t[2]] - surface.nodes[t[0]])
                          .norm();
    EXPECT_NEAR(area, 0.02, 1e-12);
}

}  // namespace
}  // namespace livetet
