#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"
#include "io/sequence_file.hpp"
#include "mesh/barycentric_map.hpp"
#include "mesh/hierarchy.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using test::Folder;
using test::livetet;
using test::write_text;

/// A block on a moving table, registered exactly, a sensor on the middle of its top.
struct Tracked {
    Folder folder;
    SimulatedTrackerOptions tracker;
    Tracked() {
        tracker.rate_Hz = 15;
        tracker.presses = 1;
        tracker.image_from_reference.translation = {0.02, 0.1, 0.05};
        tracker.image_from_sensor_at_rest.translation = {0.1, 0.05, 0.1};
        tracker.press_direction = {0, 0, -1};
        write_hierarchy(folder / "block.h5", make_hierarchy({test::block({12, 6, 6}, {0.2, 0.1, 0.1}),
                                                             test::block({7, 4, 4}, {0.2, 0.1, 0.1}),
                                                             test::block({4, 2, 2}, {0.2, 0.1, 0.1})},
                                                            "a block"));
        FiducialRegistration registration;
        registration.reference_tool = "Reference";
        const auto reference_from_image = tracker.image_from_reference.inverse();
        for (const Vector3& x : {Vector3(0, 0, 0), Vector3(0.2, 0, 0), Vector3(0, 0.1, 0), Vector3(0, 0, 0.1)})
            registration.fiducials.push_back({"F", x, x, reference_from_image * x, 0, 0});
        const auto& image_from_reference = tracker.image_from_reference;
        registration.image_from_base = {1, image_from_reference.rotation, image_from_reference.translation};
        write_registration(folder / "registration.json", registration);
        write_text(folder / "scene.yaml",
                   "mesh: {file: block.h5}\nfix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}]\n"
                   "time: {scheme: newmark, rayleigh_alpha: 10, rayleigh_beta: 0.01}\n"
                   "track: {source: press.igs.mha, registration: registration.json}\n");
    }
    ResultReader run(const std::string& options = "--every-sample") {
        write_sequence(folder / "press.igs.mha", recording);
        const auto outcome = livetet(folder, "track scene.yaml " + options);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return ResultReader(folder / "result.h5");
    }
    void record() { recording = simulate_press(tracker); }
    Recording recording;
};

double largest(const std::vector<Vector3>& u) {
    double most = 0;
    for (const Vector3& v : u) most = std::max(most, v.norm());
    return most;
}

TEST(Track, MovingTheWholeOrganDeformsNothingAndTheSensorIsFollowed) {
    Tracked t;
    t.tracker.position_rms_mm = t.tracker.rotation_rms_deg = 0;
    t.record();
    const ResultReader result = t.run();
    ASSERT_EQ(result.frame_count(), t.recording.samples.size());
    double travelled = 0, deepest = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const double time = result.times_s()[k], depth = true_press_depth(t.tracker, time);
        travelled = std::max(travelled, (true_tracker_from_image(t.tracker, time).translation -
                                         true_tracker_from_image(t.tracker, 0).translation)
                                            .norm());
        if (time < t.tracker.rest_s) {
            ASSERT_LT(largest(result.displacement(k)), 1e-7) << "at " << time << " s nothing pressed yet";
        }
        deepest = std::max(deepest, result.values("press_mm", k, 1)[0]);
        ASSERT_NEAR(result.values("press_mm", k, 1)[0], 1e3 * depth, 4) << "at " << time << " s";
    }
    EXPECT_GT(travelled, 0.03);
    EXPECT_NEAR(deepest, 15, 0.5);
    EXPECT_LT(largest(result.displacement(result.frame_count() - 1)), 1e-3) << "released, it comes home";
}

TEST(Track, WithATrackersNoiseAndNothingPressedItMovesNoMoreThanTheNoise) {
    Tracked t;
    t.tracker.press_depth = 0;
    t.record();
    const ResultReader result = t.run();
    // The sensor in the image by two noisy poses: position errors of both, and the reference's turn over their
    // distance.
    const double lever =
        (t.tracker.image_from_sensor_at_rest.translation - t.tracker.image_from_reference.translation).norm();
    const double noise = std::sqrt(2 * std::pow(1.4e-3, 2) + 2.0 / 3 * std::pow(0.5 * M_PI / 180 * lever, 2));
    double squares = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        const double moved = largest(result.displacement(k));
        EXPECT_LT(moved, 3 * noise);
        squares += moved * moved / static_cast<double>(result.frame_count());
    }
    EXPECT_LT(std::sqrt(squares), noise);
    EXPECT_GT(std::sqrt(squares), 0.05 * noise) << "noise came in, else this test shows nothing";
}

TEST(Track, ALostOrMadSensorNeverMakesTheModelExplode) {
    Tracked t;
    t.record();
    const std::size_t sensor = tool_index(t.recording, "Sensor"), reference = tool_index(t.recording, "Reference");
    const std::size_t samples = t.recording.samples.size();
    for (std::size_t k = samples / 3; k < samples / 3 + 12; ++k)
        t.recording.samples[k].poses[sensor].status = PoseStatus::missing;
    t.recording.samples[samples / 2].poses[sensor].translation += Vector3(0.3, 0, 0);  // one jump of 300 mm
    for (std::size_t k = samples / 2 + 5; k < samples / 2 + 8; ++k)
        t.recording.samples[k].poses[reference].status = PoseStatus::invalid;
    const ResultReader result = t.run();
    for (std::size_t k = 0; k < result.frame_count(); ++k) ASSERT_LT(largest(result.displacement(k)), 0.03);
}

TEST(Track, AtTheRecordingsOwnPaceEachSampleIsAFrameOrMissed) {
    Tracked t;
    t.tracker.rest_s = 2;
    t.tracker.pause_s = 0.2;
    t.record();
    const ResultReader result = t.run("--json report.json");
    const auto run = nlohmann::json::parse(result.text("run"));
    EXPECT_EQ(run["samples"].get<std::size_t>(), t.recording.samples.size());
    EXPECT_EQ(run["frames"].get<std::size_t>() + run["missed"].get<std::size_t>(), t.recording.samples.size());
    EXPECT_GT(result.frame_count(), 5u);
    EXPECT_TRUE(std::filesystem::exists(t.folder / "report.json"));
}

TEST(Track, ABudgetThatNothingFitsLeavesOneIterationAFrameAndSaysSo) {
    Tracked t;
    t.record();
    const std::string scene = read_text_file(t.folder / "scene.yaml");
    write_text(t.folder / "scene.yaml",
               scene.substr(0, scene.rfind('}')) + ", budget: 1e-3 ms}\nsolver: {relative_tolerance: 1.0e-9}\n");
    const ResultReader hurried = t.run("--every-sample --json hurried.json");
    double cut_short = 0;
    for (std::size_t k = 20; k < hurried.frame_count(); ++k) {
        EXPECT_EQ(hurried.values("iterations", k, 1)[0], 1) << k;
        EXPECT_TRUE(std::isfinite(hurried.values("error_estimate_mm", k, 1)[0]));
        cut_short += hurried.values("cut_short", k, 1)[0];
        for (const Vector3& u : hurried.displacement(k)) ASSERT_TRUE(u.norm() < 0.05);
    }
    EXPECT_GT(cut_short, 0.9 * static_cast<double>(hurried.frame_count() - 20));
    const auto report = nlohmann::json::parse(read_text_file(t.folder / "hurried.json"));
    EXPECT_EQ(report["frames"]["budget_ms"], 1e-3);
    EXPECT_GE(report["frames"]["cut_short"], cut_short);
    EXPECT_EQ(report["frames"]["over_budget"], hurried.frame_count());
}

TEST(Track, ASensorThatIsNotOnTheOrganIsRefused) {
    Tracked t;
    t.tracker.image_from_sensor_at_rest.translation = {0.1, 0.05, 0.2};
    t.record();
    write_sequence(t.folder / "press.igs.mha", t.recording);
    test::expect_refused(livetet(t.folder, "track scene.yaml --every-sample"), {"Sensor", "off the organ's surface"});
    EXPECT_FALSE(std::filesystem::exists(t.folder / "result.h5"));
}

TEST(Track, ARecordingWithoutTheNamedSensorIsRefused) {
    Tracked t;
    t.record();
    t.recording.tools = {"Reference", "Probe"};
    write_sequence(t.folder / "press.igs.mha", t.recording);
    test::expect_refused(livetet(t.folder, "track scene.yaml"), {"Sensor", "Reference", "Probe"});
}

}  // namespace
}  // namespace livetet
