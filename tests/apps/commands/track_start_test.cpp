// `track.start`: a tracked organ that begins where a solve or a registration left it.

#include "apps/commands/tracked_block.hpp"
#include "apps/live/statement_record.hpp"
#include "mesh/quadratic.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::largest;
using test::livetet;
using test::Tracked;
using test::write_text;

/// The tracked block, pulled up at one end by a solve of another law; the sensor lies on the middle
/// of its top as it is then.
struct StartedBlock : Tracked {
    std::vector<Vector3> u;  ///< of the solve
    Vector3 middle{0.1, 0.05, 0.1};

    explicit StartedBlock(const std::string& more = "", const TetMesh& grid = {}) {
        if (!grid.hexahedra.empty())
            write_hierarchy(folder / "block.h5", make_hierarchy({grid}, "a grid"));
        write_text(folder / "solve.yaml",
                   "mesh: {file: block.h5}\nfix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}]\n"
                   "strain: neohookean\nsolver: {newton_tolerance: 1.0e-8}\n"
                   "loads: [{box_mm: [110, 0, 90, 201, 101, 101], force_N: [0.5, 0, 1.5]}]\n"
                   "output: {file: start.h5}\n" +
                       more);
        const auto solved = livetet(folder, "solve solve.yaml");
        EXPECT_EQ(solved.status, 0) << solved.err;
        const ResultReader result(folder / "start.h5");
        u = result.displacement(0);
        tracker.position_rms_mm = tracker.rotation_rms_deg = 0;
        tracker.image_from_sensor_at_rest.translation = middle + moved(result.mesh(), u);
        record();
        set_track("start: start.h5, targets: [{name: Middle, point_mm: [100, 50, 60]}]");
    }
    Vector3 moved(const TetMesh& mesh, const std::vector<Vector3>& by) const {
        return PointSampler(mesh, std::vector{middle}).sample(0, by);
    }
};

double largest_difference(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
    double most = 0;
    for (std::size_t n = 0; n < a.size(); ++n) most = std::max(most, (a[n] - b[n]).norm());
    return most;
}

TEST(Track, StartsFromAnEquilibriumStaysThereAndGoesOnFromThere) {
    StartedBlock block;
    EXPECT_GT(largest(block.u), 0.004);
    const ResultReader result = block.run();
    const TetMesh& mesh = result.mesh();
    const double off = 0.01 * largest(block.u);
    std::size_t pressed = 0, rested = 0;
    double deepest = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const std::vector<Vector3> now = result.displacement(k);
        const double depth = true_press_depth(block.tracker, result.times_s()[k]);
        if (result.times_s()[k] < block.tracker.rest_s) {
            EXPECT_LT(largest_difference(now, block.u), off) << "frame " << k;
            ++rested;
        }
        if (depth < 0.99 * block.tracker.press_depth) continue;
        const Vector3 motion = block.moved(mesh, now) - block.moved(mesh, block.u);
        deepest = std::max(deepest, -motion.z());
        ++pressed;
    }
    EXPECT_GT(rested, 20U);
    EXPECT_GT(pressed, 5U);
    EXPECT_NEAR(deepest, block.tracker.press_depth, 0.001) << "from where it began";
    EXPECT_LT(largest_difference(result.displacement(result.frame_count() - 1), block.u), 0.001)
        << "the sensor is back";

    // What the start itself may be off by is not hidden.
    const StatementReader statements(result, "result.h5");
    const FrameStatement stated = statements.read(result.frame_count() - 1);
    for (const ErrorSource source : {ErrorSource::law, ErrorSource::materials, ErrorSource::fixed})
        EXPECT_TRUE(stated.missing.has(source));

    const auto replay = livetet(block.folder, "track --replay result.h5");
    EXPECT_EQ(replay.status, 0) << replay.err << replay.out;
}

TEST(Track, StartsOnNodesOfEdgesFromTheCornersOfAResult) {
    StartedBlock block;
    std::string scene = test::text_of(block.folder / "scene.yaml");
    write_text(block.folder / "scene.yaml", scene + "elements: P2\n");
    write_sequence(block.folder / "press.igs.mha", block.recording);
    const ResultReader result = block.run_as_it_is();
    EXPECT_GT(result.mesh().nodes.size(), 3 * block.u.size());
    const std::vector<Vector3> first = result.displacement(0);
    for (std::size_t n = 0; n < block.u.size(); ++n)
        EXPECT_LT((first[n] - block.u[n]).norm(), 0.05 * largest(block.u)) << "node " << n;
}

TEST(Track, AGridWithPressuresStartsFromAnEquilibrium) {
    const std::string with_pressures = "formulation: mixed\n";
    StartedBlock block(with_pressures, test::hex_grid({12, 6, 6}, {0.2, 0.1, 0.1}));
    const std::string scene = test::text_of(block.folder / "scene.yaml");
    write_text(block.folder / "scene.yaml", scene + with_pressures);
    write_sequence(block.folder / "press.igs.mha", block.recording);
    const ResultReader result = block.run_as_it_is();
    const double off = 0.01 * largest(block.u);
    std::size_t rested = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k)
        if (result.times_s()[k] < block.tracker.rest_s) {
            EXPECT_LT(largest_difference(result.displacement(k), block.u), off) << "frame " << k;
            ++rested;
        }
    EXPECT_GT(rested, 20U);
}

TEST(Track, RefusesAStartThatIsNone) {
    StartedBlock block;
    write_sequence(block.folder / "press.igs.mha", block.recording);
    const auto refused = [&](const std::string& track, std::initializer_list<std::string> parts) {
        block.set_track(track);
        expect_refused(livetet(block.folder, "track scene.yaml --every-sample"), parts);
        EXPECT_FALSE(std::filesystem::exists(block.folder / "result.h5")) << track;
    };
    refused("start: none.h5", {"none.h5"});
    refused("start: press.igs.mha", {"press.igs.mha"});
    refused("start: result.h5", {"result.h5", "is read"});
    refused("start: start.h5, tools: [{tool: Stylus, blade_mm: [0, 0, 0, 0, 0, 25]}]",
            {"track.start", "blade"});

    write_hierarchy(block.folder / "other.h5",
                    make_hierarchy({test::block({5, 3, 3}, {0.2, 0.1, 0.1})}, "another"));
    const std::string solve = test::text_of(block.folder / "solve.yaml");
    const auto solved_as = [&](const std::string& what, const std::string& by,
                               const std::string& file) {
        std::string changed = solve;
        changed.replace(changed.find(what), what.size(), by);
        changed.replace(changed.find("start.h5"), 8, file);
        write_text(block.folder / "changed.yaml", changed);
        return livetet(block.folder, "solve changed.yaml").status;
    };
    ASSERT_EQ(solved_as("block.h5", "other.h5", "coarse.h5"), 0);
    refused("start: coarse.h5", {"coarse.h5", "another mesh", "tets"});
    write_hierarchy(block.folder / "lower.h5",
                    make_hierarchy({test::block({12, 6, 6}, {0.2, 0.1, 0.0995})}, "lower"));
    ASSERT_EQ(solved_as("block.h5", "lower.h5", "places.h5"), 0);
    refused("start: places.h5", {"places.h5", "another mesh", "node", "mm away"});
    {
        ResultWriter unready(block.folder / "unready.h5",
                             ResultReader(block.folder / "start.h5").mesh(), "");
        unready.append(1, block.u);
        unready.write_text("solve", "{\"converged\": false}");
        unready.close();
    }
    refused("start: unready.h5", {"unready.h5", "did not converge"});
    // Held elsewhere than the scene holds it.
    ASSERT_EQ(
        solved_as("fix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}]",
                  "fix: [{half_space_mm: [0, 0, 1, 0, 0, 1], stiffness_N_per_m: 200}]", "soft.h5"),
        0);
    refused("start: soft.h5", {"track.start", "fix", "mm away"});
    block.set_track("start: start.h5");
    write_text(block.folder / "scene.yaml",
               test::text_of(block.folder / "scene.yaml") + "formulation: mixed\n");
    expect_refused(livetet(block.folder, "track scene.yaml --every-sample"),
                   {"track.start", "tets in the mixed form"});
    block.set_track("");
    (void)block.run_as_it_is();
}

}  // namespace
}  // namespace livetet
