// Blades that cut a grid or tets while they are tracked, against bodies made with the cut in them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "apps/live/tracked_model.hpp"
#include "apps/scene/cuts.hpp"
#include "base/error.hpp"
#include "geometry/umeyama.hpp"
#include "mesh/hex_cut.hpp"
#include "mesh/mesh_pieces.hpp"
#include "mesh/quadratic.hpp"
#include "support/hex_grids.hpp"
#include "support/shapes.hpp"
#include "tracking/poses.hpp"

namespace livetet {
namespace {

constexpr double blade_frame_s = 0.04;
constexpr double cell_edge = 0.01;  // m

enum class Cells { hexahedra, tets, ten_node_tets };
constexpr Cells all_cells[] = {Cells::hexahedra, Cells::tets, Cells::ten_node_tets};

TrackedPose pose_at(const Vector3& place) {
    return {Eigen::Matrix3d::Identity(), place, PoseStatus::ok};
}

/// A block of 120 x 60 x 60 mm on a table, in cells of 10 mm, a sensor on its top and a blade of
/// 80 mm along y. The reference rests at the origin of the image.
struct BladeBlock {
    MeshHierarchy hierarchy = make_hierarchy(
        {test::hex_grid({12, 6, 6}, {12 * cell_edge, 6 * cell_edge, 6 * cell_edge})}, "a grid");
    Scene scene;

    BladeBlock() {
        scene.fix.emplace_back().half_space_mm = {0, 0, 0.1, 0, 0, 1};
        scene.materials = {{.young_Pa = 3000, .poisson = {0.4, 0.02}}};
        scene.time.scheme = TimeScheme::static_equilibrium;
        scene.solver.threads = 1;
        scene.solver.relative_tolerance = 1e-7;
        scene.track.emplace();
        scene.track->cut_interval_s = 0.2;
        scene.track->smoothing_Hz = 0;
        scene.track->sensors[0].may_slip = false;
        ToolOptions& scalpel = scene.track->tools.emplace_back();
        scalpel.tool = "Scalpel";
        scalpel.blade_mm = {0, -40, 0, 0, 40, 0};
    }
    /// The same block in two levels of tets, if it is not to be of hexahedra.
    void make_of(Cells cells) {
        if (cells == Cells::hexahedra) return;
        if (cells == Cells::ten_node_tets) scene.elements = Elements::p2;
        const Vector3 size(12 * cell_edge, 6 * cell_edge, 6 * cell_edge);
        hierarchy =
            make_hierarchy({test::block({12, 6, 6}, size), test::block({6, 3, 3}, size)}, "tets");
    }
    /// A place of which frames state the error, beyond the cut from the sensor.
    void add_target() {
        TargetOptions& target = scene.track->targets.emplace_back();
        target.name = "Beyond";
        target.point_mm = Vector3(38, 30, 45);
    }
    static Vector3 sensor_place() { return {0.0932, 0.0321, 0.06}; }
    const TetMesh& mesh() const { return hierarchy.levels.front(); }
};

/// A run of a block, frame by frame.
class BladeRun {
  public:
    explicit BladeRun(const BladeBlock& block)
        : model_(make_tracked_model(block.scene, with_scene_cuts(block))),
          tracked_(track_model(block.scene, model_, tool_finder({"Reference", "Sensor", "Scalpel"}),
                               {}, {}, MisplacedSensor::refuse)) {}

    /// Follows the sensor displaced by `pull` and the blade's middle at `blade`; none: not seen.
    const Frame& step(const Vector3& pull, const std::optional<Vector3>& blade = {}) {
        frame_ = &tracked_.advance(next_sample(pull, blade), {}, passed_);
        passed_.clear();
        return *frame_;
    }
    /// A sample that no frame is computed for.
    void miss(const Vector3& pull, const std::optional<Vector3>& blade) {
        passed_.push_back(next_sample(pull, blade));
    }
    void rest(int frames, const Vector3& pull = Vector3::Zero()) {
        for (int k = 0; k < frames; ++k) step(pull);
    }
    /// Leads the blade straight from one place to another, 4 mm a frame.
    void cut(const Vector3& from, const Vector3& to, const Vector3& pull = Vector3::Zero()) {
        const int frames = static_cast<int>(std::ceil((to - from).norm() / 0.004));
        for (int k = 0; k <= frames; ++k) step(pull, from + double(k) / frames * (to - from));
    }
    const Frame& frame() const { return *frame_; }
    const TetMesh& mesh() const { return model_.body.mesh(); }
    TrackedBody& tracked() { return tracked_; }

    /// u at each corner of each cell, m.
    std::vector<Vector3> at_corners() const {
        std::vector<Vector3> u;
        for (const Hexahedron& cell : mesh().hexahedra)
            for (const std::int32_t n : cell) u.push_back(frame_->displacement[n]);
        return u;
    }

    /// u at places at rest, m.
    std::vector<Vector3> at(const std::vector<Vector3>& places) const {
        return PointSampler(mesh(), places).sample(frame_->displacement);
    }

  private:
    TrackerSample next_sample(const Vector3& pull, const std::optional<Vector3>& blade) {
        time_s_ += blade_frame_s;
        return {time_s_,
                {pose_at(Vector3::Zero()), pose_at(BladeBlock::sensor_place() + pull),
                 blade ? pose_at(*blade) : TrackedPose{}}};
    }
    static MeshHierarchy with_scene_cuts(const BladeBlock& block) {
        return block.scene.cuts.empty() ? block.hierarchy
                                        : with_cuts(block.scene, MeshHierarchy(block.hierarchy));
    }
    double time_s_ = 0;
    TrackedModel model_;
    TrackedBody tracked_;
    std::vector<TrackerSample> passed_;
    const Frame* frame_ = nullptr;
};

/// The plane x = 46 mm, from above the block down to `depth` m above the table.
const Vector3 above(0.046, 0.03, 0.07);
Vector3 down_to(double depth) { return {0.046, 0.03, depth}; }

/// The same cut as one of the scene.
void cut_in_scene(BladeBlock& block, double depth) {
    block.scene.track->tools.clear();
    CutOptions& cut = block.scene.cuts.emplace_back();
    const Vector3 middle = (above + down_to(depth)) / 2;
    cut.point_mm = 1e3 * middle;
    cut.edges_mm = {0, 80, 0, 0, 0, 1e3 * (0.07 - depth)};
}

double farthest_apart(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
    EXPECT_EQ(a.size(), b.size());
    double distance = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
        distance = std::max(distance, (a[i] - b[i]).norm());
    return distance;
}

/// Cut while it is tracked, then pulled away from the cut, a body comes to rest as one that was
/// made with the cut in it.
void expect_grid_as_made_with_the_cut(double poisson) {
    const Vector3 pull(0.006, 0, 0.001);
    BladeBlock block, made;
    for (BladeBlock* b : {&block, &made}) b->scene.materials[0].poisson = poisson;
    cut_in_scene(made, 0.022);
    BladeRun live(block), expected(made), uncut(block);
    for (BladeRun* run : {&live, &expected, &uncut}) run->rest(30);
    ASSERT_EQ(live.frame().cut, nullptr);
    live.cut(above, down_to(0.022));
    for (BladeRun* run : {&live, &expected, &uncut}) run->rest(140, pull);
    ASSERT_NE(live.frame().cut, nullptr);
    EXPECT_EQ(live.frame().cut->pieces, 1U);
    EXPECT_EQ(live.mesh().nodes.size(), expected.mesh().nodes.size());
    EXPECT_EQ(live.frame().displacement.size(), live.mesh().nodes.size());
    EXPECT_GT(live.frame().press, 0.005) << "else the sensor is not followed";
    EXPECT_LT(farthest_apart(live.at_corners(), expected.at_corners()), 1e-6);
    EXPECT_GT(farthest_apart(live.at_corners(), uncut.at_corners()), 1e-3) << "the cut opens";
}

TEST(TrackedCuts, ABodyComesToRestAsOneMadeWithTheCut) {
    for (const double poisson : {0.4, 0.499}) {  // by displacements, and with pressures
        SCOPED_TRACE(poisson);
        expect_grid_as_made_with_the_cut(poisson);
    }
}

/// The same for tets, which a cut of the scene splits where a blade's moves nodes: they differ by
/// less than what the cut does.
void expect_tets_as_made_with_the_cut(Cells cells, double poisson) {
    const Vector3 pull(0.006, 0, 0.001);
    BladeBlock block, made;
    for (BladeBlock* b : {&block, &made}) {
        b->make_of(cells);
        b->scene.materials[0].poisson = poisson;
    }
    cut_in_scene(made, 0.022);
    BladeRun live(block), expected(made), uncut(block);
    for (BladeRun* run : {&live, &expected, &uncut}) run->rest(30);
    live.cut(above, down_to(0.022));
    for (BladeRun* run : {&live, &expected, &uncut}) run->rest(140, pull);
    ASSERT_NE(live.frame().cut, nullptr);
    EXPECT_EQ(live.frame().cut->pieces, 1U);
    EXPECT_EQ(live.frame().displacement.size(), live.mesh().nodes.size());
    EXPECT_GT(live.frame().press, 0.005) << "else the sensor is not followed";
    std::vector<Vector3> places;
    for (const double x : {0.01, 0.035, 0.057, 0.08, 0.11})
        for (const double y : {0.01, 0.03, 0.05})
            for (const double z : {0.02, 0.04, 0.059}) places.emplace_back(x, y, z);
    const double apart = farthest_apart(live.at(places), expected.at(places));
    EXPECT_LT(apart, 0.06 * pull.norm());  // 0.7 % in cells of a third
    EXPECT_GT(farthest_apart(live.at(places), uncut.at(places)), 5 * apart) << "the cut opens";
}

TEST(TrackedCuts, ABodyOfTetsComesToRestAsOneMadeWithTheCut) {
    for (const double poisson : {0.4, 0.499}) {  // by displacements, and with pressures
        SCOPED_TRACE(poisson);
        expect_tets_as_made_with_the_cut(Cells::tets, poisson);
    }
    SCOPED_TRACE("ten nodes");
    expect_tets_as_made_with_the_cut(Cells::ten_node_tets, 0.4);
}

/// Nodes are appended, and say whose copies they are; before a press the copies lie on them.
TEST(TrackedCuts, CopiesFollowTheNodesThatTheyAreCopiesOf) {
    const BladeBlock block;
    BladeRun run(block);
    run.rest(30);
    const std::size_t loaded = run.mesh().nodes.size();
    std::size_t openings = 0, before = loaded;
    for (double z = 0.07; z > 0.02; z -= 0.002) {
        run.step({0, 0, 0}, Vector3(0.046, 0.03, z));
        if (!run.frame().cut) continue;
        const CutMesh& cut = *run.frame().cut;
        openings += cut.mesh.nodes.size() > before;
        before = cut.mesh.nodes.size();
        ASSERT_EQ(cut.mesh.nodes.size(), loaded + cut.originals.size());
        ASSERT_EQ(run.frame().displacement.size(), cut.mesh.nodes.size());
        for (std::size_t k = 0; k < cut.originals.size(); ++k) {
            ASSERT_LT(cut.originals[k], static_cast<std::int32_t>(loaded + k));
            EXPECT_EQ(cut.mesh.nodes[loaded + k], cut.mesh.nodes[cut.originals[k]]);
        }
    }
    EXPECT_GE(openings, 2U) << "it opens while the blade goes on";
    EXPECT_EQ(openings, run.frame().cut->openings);
}

/// Not where the blade is in the image, but where the tissue that it meets is at rest.
TEST(TrackedCuts, APulledBodyIsCutWhereItsTissueWasAtRest) {
    BladeBlock block;
    block.scene.track->sensors[0].patch_radius_mm = 70;  // the whole top
    const Vector3 pull(0.02, 0, 0);
    BladeRun run(block);
    run.rest(30);
    for (int k = 0; k <= 60; ++k) run.step(std::min(1.0, k / 20.0) * pull);
    run.cut({0.082, 0.03, 0.07}, {0.082, 0.03, 0.047}, pull);
    run.rest(10, pull);
    ASSERT_NE(run.frame().cut, nullptr);
    for (std::size_t k = 0; k < run.frame().cut->originals.size(); ++k) {
        const std::size_t n = run.mesh().nodes.size() - 1 - k;
        const Vector3& x = run.mesh().nodes[n];
        // The blade cuts layers that moved by 15 to 20 mm.
        EXPECT_NEAR(x.x(), 0.06, 1e-9) << x.transpose();
        EXPECT_GT(x.z(), 0.035);
    }
}

/// A patch that is cut through goes on as one: each side follows the sensor.
TEST(TrackedCuts, ACutThroughAPatchLeavesBothSidesInIt) {
    const BladeBlock block;
    BladeRun run(block);
    run.rest(40);
    const std::vector<std::int32_t> before = run.tracked().driven();
    ASSERT_FALSE(before.empty());
    run.cut({0.096, 0.03, 0.07}, {0.096, 0.03, 0.032});
    const Vector3 pull(0, 0, 0.005);
    run.rest(40, pull);
    const std::vector<std::int32_t>& driven = run.tracked().driven();
    EXPECT_GT(driven.size(), before.size());
    for (const std::int32_t n : driven)
        EXPECT_NEAR(run.frame().displacement[n].z(), 0.005, 1e-6) << n;
}

std::string said_while(const std::function<void()>& work) {
    testing::internal::CaptureStderr();
    work();
    return testing::internal::GetCapturedStderr();
}

/// What is cut off of a static body stays where it was, and is told once, with volume and place.
TEST(TrackedCuts, APieceThatIsCutOffRestsInAStaticScene) {
    BladeBlock block;
    BladeRun run(block);
    run.rest(30);
    for (int k = 0; k <= 30; ++k) run.step(std::min(1.0, k / 20.0) * Vector3(0, 0, -0.006));
    // From the side through the upper corner at low x, away from the sensor.
    const std::string said = said_while([&] {
        run.cut({0.022, 0.03, 0.07}, {0.022, 0.03, 0.038}, {0, 0, -0.006});
        run.cut({0.022, 0.03, 0.038}, {-0.01, 0.03, 0.038}, {0, 0, -0.006});
        run.rest(10, {0, 0, -0.006});
    });
    ASSERT_NE(run.frame().cut, nullptr);
    EXPECT_EQ(run.frame().cut->pieces, 2U);
    EXPECT_EQ(run.frame().cut->free_pieces, 1U);
    EXPECT_NE(said.find("a cut freed 1 piece that neither fix nor drive holds: 24 ml at (10.0, "
                        "30.0, 50.0) mm"),
              std::string::npos)
        << said;
    EXPECT_NE(said.find("rests where it is"), std::string::npos) << said;
    EXPECT_EQ(said.find("cut off"), said.rfind("cut off", said.size() - 60)) << said;
    std::vector<std::int32_t> piece;
    for (const Hexahedron& cell : run.mesh().hexahedra)
        if (run.mesh().nodes[cell[7]].x() < 0.021 && run.mesh().nodes[cell[0]].z() > 0.039)
            piece.insert(piece.end(), cell.begin(), cell.end());
    const auto before = run.frame().displacement;
    std::vector<Vector3> rest, at;
    for (const std::int32_t n : piece) {
        rest.push_back(run.mesh().nodes[n]);
        at.push_back(rest.back() + before[n]);
    }
    EXPECT_LT(fit_points(rest, at, Scaling::rigid).fre, 1e-9) << "it has its shape at rest";
    run.rest(60);  // the press is taken back
    double moved = 0, rest_moved = 0;
    for (const std::int32_t n : piece)
        moved = std::max(moved, (run.frame().displacement[n] - before[n]).norm());
    for (std::size_t n = 0; n < before.size(); ++n)
        rest_moved = std::max(rest_moved, (run.frame().displacement[n] - before[n]).norm());
    EXPECT_EQ(moved, 0);
    EXPECT_GT(rest_moved, 0.005);
}

/// In a dynamic scene it flies on.
TEST(TrackedCuts, APieceThatIsCutOffMovesFreelyInADynamicScene) {
    for (const TimeScheme scheme :
         {TimeScheme::newmark, TimeScheme::generalized_alpha, TimeScheme::implicit_euler}) {
        BladeBlock block;
        block.scene.time.scheme = scheme;
        block.scene.gravity_m_per_s2 = {0, 0, -1};
        BladeRun run(block);
        run.rest(60);
        const std::string said = said_while([&] {
            run.cut({0.022, 0.03, 0.07}, {0.022, 0.03, 0.038});
            run.cut({0.022, 0.03, 0.038}, {-0.01, 0.03, 0.038});
            run.rest(6);
        });
        EXPECT_NE(said.find("moves freely"), std::string::npos) << said;
        ASSERT_EQ(run.frame().cut->free_pieces, 1U);
        const auto height = [&] {  // of the piece's nodes, mean
            double sum = 0;
            int count = 0;
            for (std::size_t e = 0; e < run.mesh().hexahedra.size(); ++e) {
                const Hexahedron& cell = run.mesh().hexahedra[e];
                if (run.mesh().nodes[cell[7]].x() > 0.021 || run.mesh().nodes[cell[0]].z() < 0.039)
                    continue;
                for (const std::int32_t n : cell) sum += run.frame().displacement[n].z(), ++count;
            }
            return sum / count;
        };
        std::vector<double> heights;
        for (int k = 0; k < 12; ++k) {
            heights.push_back(height());
            run.step({0, 0, 0});
        }
        // It falls by g dt^2 more in each frame than in the one before.
        for (std::size_t k = 2; k < heights.size(); ++k)
            EXPECT_NEAR(heights[k] - 2 * heights[k - 1] + heights[k - 2],
                        -blade_frame_s * blade_frame_s, 2e-4)
                << k << " of scheme " << static_cast<int>(scheme);
    }
}

/// Three nodes hold a static body, and neither of its halves: the cut is not made.
TEST(TrackedCuts, ACutThatWouldFreeTheWholeBodyIsNotMade) {
    BladeBlock block;
    block.scene.fix.clear();
    for (const Vector3& x : {Vector3(0, 30, 0), Vector3(120, 0, 0), Vector3(120, 60, 0)})
        block.scene.fix.emplace_back().sphere_mm = {x.x(), x.y(), x.z(), 1};
    BladeRun run(block);
    run.rest(30);
    const std::string said = said_while([&] {
        run.cut(above, down_to(-0.01));
        run.rest(10);
    });
    EXPECT_NE(said.find("a cut is not made: it would free the whole body"), std::string::npos)
        << said;
    ASSERT_NE(run.frame().cut, nullptr) << "it was opened before it was through";
    EXPECT_EQ(run.frame().cut->pieces, 1U);
    EXPECT_EQ(mesh_pieces(run.mesh()).size(), 1U);
    run.rest(60, {0.003, 0, 0});
    EXPECT_TRUE(run.frame().step.converged);
    EXPECT_NEAR(run.frame().press, 0.003, 1e-4);
}

/// As the reference sensor, the blade and the frames say: no cut across what was not seen.
TEST(TrackedCuts, NothingIsCutWhereTheBladeOrTheReferenceWasNotSeen) {
    const BladeBlock block;
    BladeRun run(block);
    run.rest(30);
    run.step({0, 0, 0}, above);
    for (int k = 0; k < 10; ++k) run.step({0, 0, 0});  // lost for 0.4 s
    run.step({0, 0, 0}, down_to(0.052));
    for (int k = 0; k < 10; ++k) run.step({0, 0, 0}, down_to(0.052));
    run.step({0, 0, 0}, down_to(0.02));  // a jump
    for (int k = 0; k < 10; ++k) run.step({0, 0, 0}, down_to(0.02));
    EXPECT_EQ(run.frame().cut, nullptr);
    double time_s = 10;
    const auto unseen = [&](const Vector3& blade) {
        run.tracked().advance(
            {time_s += blade_frame_s,
             {TrackedPose{}, pose_at(BladeBlock::sensor_place()), pose_at(blade)}});
    };
    for (double z = 0.07; z > 0.02; z -= 0.004) unseen(down_to(z));  // without the reference
    EXPECT_EQ(run.tracked().last().cut, nullptr);
}

/// Frames that take as long as eight samples: the blade goes down, then to the side, by 32 mm a
/// frame.
TEST(TrackedCuts, SamplesWithoutAFrameCut) {
    const BladeBlock block;
    BladeRun all(block), some(block), alone(block);
    std::vector<Vector3> way;
    for (int k = 0; k <= 10; ++k) way.push_back(above - Vector3(0, 0, 0.0035 * k));
    for (int k = 1; k <= 6; ++k) way.push_back(way[10] + Vector3(0.0035 * k, 0, 0));
    for (BladeRun* run : {&all, &some, &alone}) run->rest(30);
    for (std::size_t k = 0; k < way.size(); ++k) {
        all.step(Vector3::Zero(), way[k]);
        const bool has_frame = k % 8 == 0;
        if (has_frame) alone.step(Vector3::Zero(), way[k]);
        has_frame ? (void)some.step(Vector3::Zero(), way[k]) : some.miss(Vector3::Zero(), way[k]);
    }
    for (BladeRun* run : {&all, &some, &alone}) run->rest(20);
    ASSERT_NE(all.frame().cut, nullptr);
    ASSERT_NE(some.frame().cut, nullptr);
    EXPECT_EQ(some.frame().cut->parted, all.frame().cut->parted);
    EXPECT_EQ(some.mesh().nodes.size(), all.mesh().nodes.size());
    EXPECT_EQ(some.frame().blade_gaps.count, 0U);
    EXPECT_GT(alone.frame().blade_gaps.count, 0U) << "else the samples between are not needed";
}

/// Samples decide, and no clock: the same samples give the same bits, on any number of threads.
void expect_the_same_bits(Cells cells) {
    std::vector<std::vector<Vector3>> runs;
    for (const int threads : {1, 1, 2}) {
        BladeBlock block;
        block.make_of(cells);
        block.scene.solver.threads = threads;
        block.scene.time.scheme = TimeScheme::newmark;
        BladeRun run(block);
        run.rest(30);
        run.cut(above, down_to(0.03), {0, 0, -0.003});
        run.rest(5, {0.003, 0, 0});
        run.cut({0.066, 0.03, 0.07}, {0.066, 0.03, 0.02}, {0.003, 0, 0});
        run.rest(5, {0.003, 0, 0});
        EXPECT_GE(run.frame().cut->openings, 3U);
        runs.push_back(run.frame().displacement);
    }
    EXPECT_EQ(runs[0], runs[1]);
    EXPECT_EQ(runs[0], runs[2]);
}

TEST(TrackedCuts, TheSameSamplesGiveTheSameBits) {
    for (const Cells cells : all_cells) expect_the_same_bits(cells);
}

/// An opening that is prepared between frames, as a whole or a little at a time until a frame has
/// to finish it, is the one that a frame makes.
void expect_the_same_prepared(Cells cells) {
    std::vector<std::vector<Vector3>> runs;
    for (const int slices : {0, 1, 1000}) {  // between two frames
        BladeBlock block;
        block.make_of(cells);
        block.scene.time.scheme = TimeScheme::newmark;
        BladeRun run(block);
        run.rest(30);
        int unfinished = 0;
        const Vector3 end = down_to(0.03), way = end - above;
        for (int k = 0; k <= 40; ++k) {
            run.step({0, 0, -0.003}, above + std::min(1.0, k / 20.0) * way);
            for (int slice = 0; slice < slices; ++slice)
                unfinished += !run.tracked().prepare_cut([] { return true; });
        }
        EXPECT_EQ(unfinished > 0, slices > 0);
        EXPECT_EQ(unfinished > 40, slices == 1000) << unfinished;
        ASSERT_NE(run.frame().cut, nullptr);
        EXPECT_GE(run.frame().cut->openings, 2U);
        EXPECT_GT(run.frame().cut->prepared_s, 0);
        runs.push_back(run.frame().displacement);
    }
    EXPECT_EQ(runs[0], runs[1]);
    EXPECT_EQ(runs[0], runs[2]);
}

TEST(TrackedCuts, AnOpeningPreparedBetweenFramesIsTheSame) {
    for (const Cells cells : all_cells) {
        SCOPED_TRACE(static_cast<int>(cells));
        expect_the_same_prepared(cells);
    }
}

/// The stated errors are those of a body with the cut, once its responses are known again.
TEST(TrackedCuts, ErrorsAreNotStatedUntilTheResponsesOfTheCutBodyAreKnown) {
    BladeBlock block;
    block.add_target();
    BladeBlock made = block;
    cut_in_scene(made, 0.022);
    BladeRun live(block), expected(made), whole(block);
    const auto known = [](BladeRun& run) {
        while (run.tracked().work_on_responses()) {
        }
        run.step({0, 0, -0.004});
        return run.frame().statement;
    };
    live.rest(60, Vector3::Zero());
    const FrameStatement before = known(live);
    EXPECT_FALSE(before.missing.has(ErrorSource::patches) &&
                 before.missing.has(ErrorSource::materials));
    live.cut(above, down_to(0.022));
    live.rest(6);
    EXPECT_TRUE(live.frame().statement.missing.has(ErrorSource::materials));
    EXPECT_LT(live.frame().statement.computed, 1);
    live.rest(60, {0, 0, -0.004});
    expected.rest(60);
    expected.rest(60, {0, 0, -0.004});
    whole.rest(60);
    whole.rest(60, {0, 0, -0.004});
    const FrameStatement after = known(live), wanted = known(expected), uncut = known(whole);
    EXPECT_LT(farthest_apart(live.at_corners(), expected.at_corners()), 1e-6);
    EXPECT_EQ(live.tracked().driven(), expected.tracked().driven());
    EXPECT_FALSE(after.missing.has(ErrorSource::materials));
    ASSERT_EQ(after.targets.size(), 1U);
    EXPECT_LT((after.targets[0].position - wanted.targets[0].position).norm(), 2e-6);
    const auto of = [](const FrameStatement& s, ErrorSource source) {
        return s.targets[0].by_source[static_cast<std::size_t>(source)];
    };
    // Of the patches, radii of one standard deviation more hold whole nodes: not quite as many.
    for (const ErrorSource source : {ErrorSource::materials, ErrorSource::patches}) {
        const double tolerance = 0.04 * of(wanted, source);
        EXPECT_NEAR(of(after, source), of(wanted, source), tolerance) << name_of(source);
        EXPECT_GT(std::abs(of(uncut, source) - of(wanted, source)), 2 * tolerance)
            << name_of(source);
    }
}

/// Of ten-node tets they are those of a body that a cut of the scene has split, but for that.
TEST(TrackedCuts, ErrorsOfTenNodeTetsAreStatedOnceTheirResponsesAreKnown) {
    BladeBlock block;
    block.make_of(Cells::ten_node_tets);
    block.add_target();
    BladeBlock made = block;
    cut_in_scene(made, 0.022);
    BladeRun live(block), expected(made), whole(block);
    for (BladeRun* run : {&live, &expected, &whole}) run->rest(60);
    live.cut(above, down_to(0.022));
    live.rest(6);
    EXPECT_TRUE(live.frame().statement.missing.has(ErrorSource::materials));
    std::vector<FrameStatement> known;
    for (BladeRun* run : {&live, &expected, &whole}) {
        run->rest(60, {0, 0, -0.004});
        while (run->tracked().work_on_responses()) {
        }
        known.push_back(run->step({0, 0, -0.004}).statement);
        ASSERT_EQ(known.back().targets.size(), 1U);
    }
    const auto of = [&](int run, ErrorSource source) {
        EXPECT_FALSE(known[run].missing.has(source)) << name_of(source);
        return std::sqrt(known[run].targets[0].by_source[static_cast<std::size_t>(source)]);
    };
    const double here = of(0, ErrorSource::materials), there = of(1, ErrorSource::materials);
    EXPECT_NEAR(here, there, 0.15 * there);
    // 25 um of the whole body, 22 of the cut one, and 20 where a blade cut it: of a cut body less.
    EXPECT_LT(std::max(here, there), 0.95 * of(2, ErrorSource::materials));
    EXPECT_GT(std::abs(of(2, ErrorSource::materials) - here), 2 * std::abs(here - there));
    // The cuts of the two levels that are compared are not at the same places.
    const double elements = of(0, ErrorSource::elements) / of(1, ErrorSource::elements);
    EXPECT_GT(elements, 0.5);
    EXPECT_LT(elements, 3);
}

TEST(TrackedCuts, AChangedSceneIsAppliedToTheCutBody) {
    BladeBlock block;
    BladeRun run(block);
    run.rest(30);
    run.cut(above, down_to(0.032));
    run.rest(10);
    ASSERT_NE(run.frame().cut, nullptr);
    Scene edited = block.scene;
    FixOptions& more = edited.fix.emplace_back();
    more.half_space_mm = {0.1, 0, 0, 1, 0, 0};  // the end at x = 0, too
    FixOptions& cut_too = edited.fix.emplace_back();
    cut_too.box_mm = {45, -1, 45, 55, 61, 61};  // around the upper end of the cut
    run.tracked().change(prepare_change(edited, block.mesh()));
    run.rest(60, {0.006, 0, 0});
    for (std::size_t n = 0; n < run.mesh().nodes.size(); ++n) {
        const Vector3& x = run.mesh().nodes[n];
        const bool is_in_box = std::abs(x.x() - 0.05) < 0.004 && x.z() > 0.045;
        if (x.x() < 1e-6 || is_in_box) {
            EXPECT_EQ(run.frame().displacement[n], Vector3(0, 0, 0)) << x.transpose();
        }
    }
    edited.track->tools[0].blade_mm = {0, -50, 1, 0, 50, 1};
    run.tracked().change(prepare_change(edited, block.mesh()));
    run.cut({0.026, 0.03, 0.07}, {0.026, 0.03, 0.03}, {0.006, 0, 0});
    run.rest(10, {0.006, 0, 0});
    EXPECT_TRUE(std::ranges::any_of(run.frame().cut->originals, [&](std::int32_t n) {
        return std::abs(run.mesh().nodes[n].x() - 0.03) < 1e-9;
    })) << "the changed blade cuts";

    BladeBlock bladeless;
    bladeless.scene.track->tools.clear();
    BladeRun other(bladeless);
    other.rest(3);
    EXPECT_THROW(other.tracked().change(prepare_change(block.scene, block.mesh())), Error);
}

/// What is prepared for the scene as it was is prepared once more.
TEST(TrackedCuts, ASceneMayChangeWhileACutIsOpening) {
    const BladeBlock block;
    BladeRun run(block);
    run.rest(30);
    const auto is_opening = [&] { return !run.tracked().prepare_cut([] { return true; }); };
    double z = above.z();
    while (!is_opening() && z > 0.03) run.step({0, 0, 0}, down_to(z -= 0.004));
    ASSERT_GT(z, 0.03);
    ASSERT_EQ(run.frame().cut, nullptr);
    Scene edited = block.scene;
    edited.fix.emplace_back().half_space_mm = {0.1, 0, 0, 1, 0, 0};
    run.tracked().change(prepare_change(edited, block.mesh()));
    EXPECT_FALSE(is_opening());
    run.rest(40, {0.004, 0, 0});
    ASSERT_NE(run.frame().cut, nullptr);
    EXPECT_EQ(run.frame().cut->openings, 1U);
    for (std::size_t n = 0; n < run.mesh().nodes.size(); ++n) {
        if (run.mesh().nodes[n].x() > 1e-6) continue;
        EXPECT_EQ(run.frame().displacement[n], Vector3(0, 0, 0));
    }
}

/// Of each body that is cut at random: 25, or as LIVETET_RANDOM_CUTS says; 700 take 10,000 frames.
int random_cuts() {
    const char* asked = std::getenv("LIVETET_RANDOM_CUTS");
    return asked ? std::atoi(asked) : 25;
}

/// Cuts and presses at random: finite, at rest where it is held, and each free piece is told of.
void cut_and_press_at_random(Cells cells) {
    for (const TimeScheme scheme : {TimeScheme::static_equilibrium, TimeScheme::newmark}) {
        BladeBlock block;
        block.make_of(cells);
        block.scene.time.scheme = scheme;
        block.scene.time.rayleigh_alpha = 10;
        block.scene.solver.relative_tolerance = 1e-2;
        block.scene.track->tools[0].blade_mm = {0, -30, 0, 0, 30, 0};
        BladeRun run(block);
        run.rest(30);
        std::mt19937 random(17);
        std::uniform_real_distribution<double> share(0, 1);
        const auto place = [&] {
            return Vector3(0.12 * share(random), 0.06 * share(random), 0.07 * share(random));
        };
        std::size_t told = 0, free_at_most = 0;
        Vector3 pull = Vector3::Zero();
        for (int cut = 0; cut < random_cuts(); ++cut) {
            const Vector3 from = place(), to = place();
            const Vector3 next =
                0.008 * Vector3(share(random) - 0.5, share(random) - 0.5, share(random) - 0.5);
            const std::string said = said_while([&] {
                const int frames = 3 + static_cast<int>((to - from).norm() / 0.006);
                for (int k = 0; k <= frames; ++k) {
                    const double way = static_cast<double>(k) / frames;
                    const Frame& frame =
                        run.step(pull + way * (next - pull), from + way * (to - from));
                    for (const Vector3& u : frame.displacement) ASSERT_LT(u.norm(), 5.0) << cut;
                }
            });
            pull = next;
            for (std::size_t at = said.find("cut freed "); at != std::string::npos;
                 at = said.find("cut freed ", at + 1))
                if (const int number = std::atoi(said.c_str() + at + 10); number > 0)
                    told += static_cast<std::size_t>(number);
            if (run.frame().cut)
                free_at_most = std::max(free_at_most, run.frame().cut->free_pieces);
        }
        ASSERT_NE(run.frame().cut, nullptr);
        EXPECT_GE(told, free_at_most);
        EXPECT_GT(free_at_most, 0U) << "pieces are cut off";
        EXPECT_GT(run.frame().cut->openings, 10U);
        check_tet_mesh(run.mesh(), "cut at random");
        EXPECT_EQ(mesh_pieces(run.mesh()).size(), run.frame().cut->pieces);
        for (std::size_t n = 0; n < run.mesh().nodes.size(); ++n)
            if (run.mesh().nodes[n].z() < 1e-6) {
                EXPECT_LT(run.frame().displacement[n].norm(), 1e-12) << n;
            }
    }
}

TEST(TrackedCuts, RandomCutsAndPressesKeepTheBodyFinite) {
    cut_and_press_at_random(Cells::hexahedra);
}
TEST(TrackedCuts, RandomCutsAndPressesKeepABodyOfTetsFinite) {
    cut_and_press_at_random(Cells::tets);
}
TEST(TrackedCuts, RandomCutsAndPressesKeepABodyOfTenNodeTetsFinite) {
    cut_and_press_at_random(Cells::ten_node_tets);
}

}  // namespace
}  // namespace livetet
