#include "apps/bench/live_choices.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/bench/machine_figures.hpp"
#include "base/error.hpp"
#include "io/hierarchy_file.hpp"
#include "mesh/quadratic.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::text_of;
using test::write_text;

const Vector3 size(0.2, 0.1, 0.1);

MeshHierarchy three_levels() {
    return make_hierarchy(
        {test::block({8, 4, 4}, size), test::block({4, 2, 2}, size), test::block({2, 1, 1}, size)},
        "a block");
}

Scene scene_of_a_held_block() {
    Scene scene;
    scene.track.emplace();
    FixOptions fix;
    fix.half_space_mm = {1, 0, 0, 1, 0, 0};
    scene.fix = {fix};
    return scene;
}

TEST(LiveChoices, APressGoesInAndComesBackOnceASecond) {
    EXPECT_NEAR(press_share(0), 0, 1e-12);
    EXPECT_NEAR(press_share(0.25), 0.5, 1e-12);
    EXPECT_NEAR(press_share(0.5), 1, 1e-12);
    EXPECT_NEAR(press_share(7.5), 1, 1e-9);
}

TEST(LiveChoices, TheBodyIsPressedAgainstWhatHoldsIt) {
    const TetMesh mesh = test::block({8, 4, 4}, size);
    const LivePress press = live_press(scene_of_a_held_block(), mesh);
    EXPECT_NEAR((press.place - Vector3(0.2, 0.05, 0.05)).norm(), 0, 1e-9);
    EXPECT_NEAR(press.direction.x(), -1, 1e-6);
    EXPECT_NEAR(press.depth, 0.015, 1e-12);
    EXPECT_NEAR(press.radius, 0.015, 1e-12);
    TetMesh small = mesh;
    for (Vector3& x : small.nodes) x *= 0.1;
    Scene scene = scene_of_a_held_block();
    scene.fix[0].half_space_mm = {0.1, 0, 0, 1, 0, 0};
    EXPECT_NEAR(live_press(scene, small).depth, 0.15 * 0.02, 1e-9) << "of 20 mm to the held face";
    scene.fix.clear();
    EXPECT_THROW(live_press(scene, small), Error) << "nothing is fixed";
}

TEST(LiveChoices, LevelsFromOneOnAreAHierarchyOfTheirOwn) {
    const MeshHierarchy all = three_levels();
    for (std::size_t l = 0; l < 3; ++l) {
        const MeshHierarchy rest = levels_from(all, l);
        EXPECT_NO_THROW(check_hierarchy(rest)) << l;
        EXPECT_EQ(rest.levels.size(), 3 - l);
        EXPECT_EQ(rest.levels.front().tets.size(), all.levels[l].tets.size());
    }
}

TEST(LiveChoices, TheFastestThatIsGoodEnoughAndInTimeIsTaken) {
    const auto candidate = [](double ms, double mm) {
        LiveCandidate c{Elements::p1, 0, 0, 0};
        c.times.all.median = c.times.all.p99 = 1e-3 * ms;
        c.largest_m = 1e-3 * mm;
        return c;
    };
    LiveChoices choices{};
    choices.measured = {candidate(8, 0.1), candidate(2, 0.3), candidate(1, 2), candidate(4, NAN)};
    const auto largest = ErrorMeasure::largest;
    EXPECT_EQ(choices.cheapest(largest, 0.5e-3, {}), &choices.measured[1]);
    EXPECT_EQ(choices.cheapest(largest, 0.2e-3, {}), &choices.measured[0]);
    EXPECT_EQ(choices.cheapest(largest, 0.2e-3, 5e-3), nullptr);
    EXPECT_EQ(choices.most_accurate(largest, 5e-3), &choices.measured[1]);
    EXPECT_EQ(choices.most_accurate(largest, 0.5e-3), nullptr);
}

/// Ten-node tets on the coarser level have as many nodes as four-node ones on the finest.
TEST(LiveChoices, TuneMeasuresBothKindsOfTetsAndWritesTheSceneOfTheChosen) {
    const Folder folder;
    write_hierarchy(folder / "block.h5", three_levels());
    write_text(folder / "scene.yaml",
               "mesh: {file: block.h5}\nmaterials: [{young_Pa: 3000, poisson: 0.45}]\n"
               "strain: neohookean\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n"
               "track: {source: r.mha, registration: r.yaml}\n");
    const auto tuned =
        livetet(folder, "tune scene.yaml --error 12mm --budget 100s --repeats 1 -o tuned.yaml");
    ASSERT_EQ(tuned.status, 0) << tuned.out << tuned.err;
    for (const char* choice : {"level 0, P1", "level 1, P1", "level 1, P2", "Live element"})
        EXPECT_NE(tuned.out.find(choice), std::string::npos) << choice << tuned.out;
    EXPECT_NE(tuned.out.find("left out         level 2, P1: found 1 level(s)"), std::string::npos);
    const std::string scene = text_of(folder / "tuned.yaml");
    EXPECT_NE(scene.find("track:"), std::string::npos) << scene;
    EXPECT_NE(scene.find("tuned.h5"), std::string::npos) << scene;
    EXPECT_LE(read_hierarchy(folder / "tuned.h5").levels.size(), 3u);
    const auto none = livetet(folder, "tune scene.yaml --error 0.00001mm --repeats 1 -o none.yaml");
    EXPECT_EQ(none.status, 3) << none.err;
    EXPECT_NE(none.err.find("the nearest is level"), std::string::npos) << none.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "none.yaml"));
    write_text(folder / "free.yaml",
               "mesh: {file: block.h5}\ntrack: {source: r.mha, registration: r.yaml}\n");
    expect_refused(livetet(folder, "tune free.yaml --error 1mm"), {"fixes no node"});
}

TEST(LiveChoices, ExplainNamesTheElementForATrackScene) {
    const Folder folder;
    write_hierarchy(folder / "block.h5", three_levels());
    write_text(folder / "scene.yaml",
               "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n"
               "track: {source: r.mha, registration: r.yaml, budget: 5 ms}\n");
    const auto outcome = livetet(folder, "explain scene.yaml");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("Live element, within 5 ms a frame (track.budget)"),
              std::string::npos)
        << outcome.out;
}

TEST(MachineFigures, TellTheKernelAndTheBandwidthOfOneAndOfAllCores) {
    const MachineFigures machine = measure_machine(2);
    EXPECT_GT(machine.tets_per_s, 1e5);
    EXPECT_GT(machine.kernel_bytes_per_s, 100 * machine.tets_per_s) << "100 bytes a tet at least";
    ASSERT_GE(machine.bandwidths.size(), 2u);
    EXPECT_EQ(machine.bandwidths.front().threads, 1);
    EXPECT_EQ(machine.bandwidths.back().threads, 2);
    for (const BandwidthFigure& b : machine.bandwidths) EXPECT_GT(b.bytes_per_s, 1e7);
    EXPECT_EQ(json_of(machine).at("bandwidths").size(), machine.bandwidths.size());
    EXPECT_EQ(measure_machine(1).bandwidths.back().threads, 1);
}

}  // namespace
}  // namespace livetet
