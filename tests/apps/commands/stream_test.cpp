#include <gtest/gtest.h>

#include <future>

#include "apps/live/tracker_recorder.hpp"
#include "base/error.hpp"
#include "geometry/transform.hpp"
#include "io/fiducial_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/openigtlink/conversions.hpp"
#include "io/openigtlink/sockets.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"
#include "io/sequence_file.hpp"
#include "io/tip_file.hpp"
#include "mesh/hierarchy.hpp"
#include "support/program.hpp"
#include "support/server.hpp"
#include "support/shapes.hpp"
#include "tracking/motion_script.hpp"
#include "tracking/poses.hpp"
#include "tracking/source.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::Running;
using test::Server;
using test::write_text;

/// A stylus turning about its resting tip, beside a reference that is lost for a while.
const std::string pivot_script =
    "rate_Hz: 40\nduration_s: 4\n"
    "tools:\n"
    "  - {tool: Stylus, on: tracker, at_mm: [10, 20, 30], tip_mm: [4, -2, 150], moves: [{at_s: 1, "
    "turn_deg: [30, 0, "
    "0]}, "
    "{at_s: 2, turn_deg: [0, 30, 0]}, {at_s: 3, turn_deg: [-30, 0, 0]}, {at_s: 4, turn_deg: [0, "
    "-30, 60]}]}\n"
    "  - {tool: Reference, at_mm: [100, 0, 0], lost_s: [1, 2], moves: [{at_s: 4, by_mm: [0, 0, "
    "40]}]}\n";

/// Places that the tip rests on for `dwell_s` each, turned to and fro, and the image's view of
/// them.
const std::vector<Vector3> places_mm{{0, 0, 0}, {60, 0, 0}, {0, 80, 20}};
const RigidTransform<ImageFrame, Tracker> image_from_tracker{rotation_of_vector({0.3, -0.2, 0.9}),
                                                             {0.05, 0.1, -0.02}};

std::string touching_script(double dwell_s) {
    std::string moves;
    double t = 0;
    for (const Vector3& place : places_mm) {
        const auto add = [&](double at_s, double turn_deg) {
            moves +=
                fmt::format("      - {{at_s: {}, by_mm: [{}, {}, {}], turn_deg: [{}, 0, 0]}}\n",
                            at_s, place.x(), place.y(), place.z(), turn_deg);
        };
        if (t > 0) add(t, 0);
        add(t + dwell_s / 2, 15);
        add(t + dwell_s, 0);
        t += dwell_s + 0.6;
    }
    return fmt::format(
        "rate_Hz: 40\nduration_s: {}\ntools:\n  - tool: Stylus\n    on: tracker\n    tip_mm: [4, "
        "-2, "
        "150]\n    moves:\n{}",
        t - 0.6, moves);
}

void write_image_fiducials(const Folder& folder) {
    std::vector<NamedPoint> points;
    for (const Vector3& place : places_mm)
        points.push_back(
            {fmt::format("F{}", points.size() + 1), image_from_tracker * Vector3(1e-3 * place)});
    write_fiducials(folder / "image.mrk.json", points);
}

TEST(Stream, AFileIsRecordedAtOnceAndWhole) {
    const Folder folder;
    write_text(folder / "pivot.yaml", pivot_script);
    ASSERT_EQ(livetet(folder, "record pivot.yaml -o all.igs.mha").status, 0);
    const Recording all = read_sequence(folder / "all.igs.mha");
    const Recording truth = simulate(parse_motion_script(pivot_script, "")).recording;
    ASSERT_EQ(all.tools, truth.tools);
    ASSERT_EQ(all.samples.size(), truth.samples.size());
    for (std::size_t i = 0; i < all.samples.size(); ++i)
        for (std::size_t k = 0; k < 2; ++k) {
            EXPECT_EQ(all.samples[i].poses[k].status, truth.samples[i].poses[k].status);
            EXPECT_LT((all.samples[i].poses[k].translation - truth.samples[i].poses[k].translation)
                          .norm(),
                      1e-9);
        }
    ASSERT_EQ(livetet(folder, "record all.igs.mha -o part.igs.mha --tool Reference --for 1").status,
              0);
    const Recording part = read_sequence(folder / "part.igs.mha");
    EXPECT_EQ(part.tools, std::vector<std::string>{"Reference"});
    EXPECT_EQ(part.samples.size(), 41u);
    expect_refused(livetet(folder, "record all.igs.mha -o part.igs.mha --tool Probe"),
                   {"all.igs.mha", "Probe", "Stylus"});
}

TEST(Stream, WhatIsServedIsRecordedPoseByPoseWithItsTimesAndItsLosses) {
    const Folder folder;
    write_text(folder / "pivot.yaml", pivot_script);
    Server server(folder, "pivot.yaml");
    const auto outcome =
        livetet(folder, "record " + server.url() +
                            " -o out.igs.mha --tool Stylus --tool Reference --for 3");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(server.wait().status, 0);
    const Recording truth = simulate(parse_motion_script(pivot_script, "")).recording;
    const Recording out = read_sequence(folder / "out.igs.mha");
    ASSERT_EQ(out.tools, (std::vector<std::string>{"Stylus", "Reference"}));
    EXPECT_GT(out.samples.size(), 90u);
    EXPECT_NEAR(out.samples.front().time_s, utc_seconds(), 60);
    std::size_t lost = 0;
    for (const TrackerSample& sample : out.samples) {
        double gap = 1;  // to the nearest of the stylus's places in the script
        for (const TrackerSample& s : truth.samples)
            gap = std::min(gap, (s.poses[0].translation - sample.poses[0].translation).norm());
        EXPECT_LT(gap, 1e-6);
        lost += sample.poses[1].status != PoseStatus::ok;
    }
    EXPECT_NEAR(static_cast<double>(lost), 40, 12)
        << "the reference is lost for one second at 40 Hz";
    const double duration_s = out.samples.back().time_s - out.samples.front().time_s;
    EXPECT_NEAR(duration_s / static_cast<double>(out.samples.size() - 1), 1 / 40.0, 0.003);
}

TEST(Stream, WithoutToolsAllThatComeAreRecordedUntilCtrlC) {
    const Folder folder;
    write_text(folder / "pivot.yaml", pivot_script);
    Server server(folder, "pivot.yaml", {"--loop"});
    Running record(folder, "record", {"record", server.url(), "-o", "out.igs.mha"});
    std::this_thread::sleep_for(std::chrono::milliseconds(2500));
    EXPECT_FALSE(std::filesystem::exists(folder / "out.igs.mha")) << "nothing half-written";
    for (int i = 0; i < 10; ++i) {  // as from a shell and a wrapper
        record.interrupt();
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    const auto outcome = record.wait();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    server.interrupt();
    EXPECT_EQ(server.wait().status, 0);
    const Recording out = read_sequence(folder / "out.igs.mha");
    EXPECT_EQ(out.tools.size(), 2u);
    EXPECT_NE(outcome.out.find("Reference"), std::string::npos) << outcome.out;
    EXPECT_GT(usable_poses(out, "Stylus").size(), 20u);
    EXPECT_GT(usable_poses(out, "Reference").size(), 5u);
}

TEST(Stream, WhatCameIsSavedAgainAndAgainWhileItIsRecorded) {
    const Folder folder;
    write_text(folder / "pivot.yaml", pivot_script);
    Server server(folder, "pivot.yaml");
    std::vector<std::size_t> saved;
    RecordingOptions options{.tools = {"Stylus"}, .length_s = 2, .save_every_s = 0.2};
    options.save = [&](const Recording& recording) {
        saved.push_back(recording.samples.size());
        if (saved.size() == 2) fail("the disk is full");
        write_sequence(folder / "saved.igs.mha", recording);
    };
    const TrackerRecording received = record_tracker(server.url(), options);
    ASSERT_GT(saved.size(), 3u) << "a save that fails ends nothing";
    EXPECT_TRUE(std::is_sorted(saved.begin(), saved.end()));
    EXPECT_GT(received.recording.samples.size(), saved.front());
    EXPECT_EQ(read_sequence(folder / "saved.igs.mha").samples.size(), saved.back());
}

TEST(Stream, AWatchedFileIsPlayedAndIsTheSameInTheEnd) {
    const Folder folder;
    write_text(folder / "pivot.yaml", pivot_script);
    const std::string file = (folder / "pivot.yaml").string();
    std::vector<std::size_t> seen;
    const auto start = steady_seconds();
    const TrackerRecording watched = record_tracker(
        file, {.tools = {"Reference", "Stylus"}, .watch = [&](const Recording& so_far) {
                   EXPECT_EQ(so_far.tools.size(), 2U);
                   seen.push_back(so_far.samples.size());
               }});
    EXPECT_GT(steady_seconds() - start, 3.9) << "at its own pace";
    const Recording at_once = record_tracker(file, {.tools = {"Stylus"}}).recording;
    ASSERT_GT(seen.size(), 10U);
    EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
    EXPECT_EQ(watched.recording.samples.size(), at_once.samples.size());
    EXPECT_EQ(usable_poses(watched.recording, "Stylus").back().translation,
              usable_poses(at_once, "Stylus").back().translation);
    EXPECT_THROW((void)record_tracker(file, {.tools = {"Pointer"}, .watch = [](const auto&) {}}),
                 Error);
}

TEST(Stream, TwoNamesThatDifferInTheirMetadataAloneAreTwoTools) {
    using namespace igtl::testing_sockets;
    ListeningPeer server;
    auto received = std::async(std::launch::async, [&] {
        return record_tracker(fmt::format("openigtlink://127.0.0.1:{}", server.port()),
                              {.length_s = 1});
    });
    Peer peer = server.accept();
    const auto came = [&] {
        return received.wait_for(std::chrono::milliseconds(20)) == std::future_status::ready;
    };
    try {
        while (!came())
            for (const char* name :
                 {"DeformationSensorLeft1ToTracker", "DeformationSensorLeft2ToTracker"}) {
                igtl::Message m =
                    igtl::transform_message(name, RigidTransform<Tracker, Tool>{}, utc_seconds());
                m.version = 2;
                peer.send(m);
            }
    } catch (const std::exception&) {  // it has ended
    }
    const TrackerRecording all = received.get();
    EXPECT_EQ(all.recording.tools,
              (std::vector<std::string>{"DeformationSensorLeft1", "DeformationSensorLeft2"}));
    EXPECT_TRUE(all.left_out.empty());
    EXPECT_GT(all.recording.samples.size(), 5u);
}

TEST(Stream, WhereNothingOrTheWrongToolComesOneLineSaysSoAndNothingIsLeft) {
    const Folder folder;
    expect_refused(livetet(folder, "record openigtlink://127.0.0.1:1 -o out.igs.mha --for 0.5"),
                   {"openigtlink://127.0.0.1:1", "nothing came", "refused"});
    write_text(folder / "pivot.yaml", pivot_script);
    Server server(folder, "pivot.yaml", {"--loop"});
    expect_refused(
        livetet(folder, "record " + server.url() + " -o out.igs.mha --tool Probe --for 1"),
        {"no Probe came", "ReferenceToTracker", "StylusToTracker"});
    expect_refused(livetet(folder, "calibrate pivot " + server.url() + " --tool Probe --for 1"),
                   {"no Probe came", "ReferenceToTracker", "StylusToTracker"});
    EXPECT_FALSE(std::filesystem::exists(folder / "out.igs.mha"));
}

TEST(Stream, WhatCouldNotBeWrittenIsRefusedBeforeAnythingIsRecorded) {
    const Folder folder;
    const std::string nobody = "record openigtlink://127.0.0.1:1 ";
    expect_refused(livetet(folder, nobody + "-o out.csv"), {"out.csv", ".igs.mha"});
    expect_refused(livetet(folder, nobody + "-o none/out.igs.mha"),
                   {"none/out.igs.mha", "no folder"});
    expect_refused(livetet(folder, nobody + "-o out.igs.mha --tool A --tool A"),
                   {"--tool A", "twice"});
    expect_refused(livetet(folder, nobody + "-o out.igs.mha --tool 'A B'"), {"'A B'", "blanks"});
    expect_refused(livetet(folder, "record http://a -o out.igs.mha"),
                   {"http://a", "openigtlink://host:port"});
    expect_refused(livetet(folder, "serve openigtlink://a:1"),
                   {"openigtlink://a:1", "recording or a script"});
    write_text(folder / "bad.yaml", "tools: [{tool: A, at_m: [1, 2, 3]}]\n");
    expect_refused(livetet(folder, "serve bad.yaml"), {"bad.yaml:1", "tools[0].at_m", "at_mm"});
    expect_refused(livetet(folder, "serve none.yaml"), {"none.yaml", "no such file"});
}

TEST(Stream, ATipIsCalibratedFromAStream) {
    const Folder folder;
    write_text(folder / "pivot.yaml", pivot_script);
    Server server(folder, "pivot.yaml");
    const auto outcome =
        livetet(folder, "calibrate pivot " + server.url() + " --for 3.5 -o tip.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const ToolTip tip = read_tip(folder / "tip.json");
    EXPECT_LT((tip.pivot.tool_from_tip.translation - Vector3(0.004, -0.002, 0.15)).norm(), 1e-6);
    EXPECT_LT((tip.pivot.pivot_in_tracker - Vector3(0.01, 0.02, 0.03)).norm(), 1e-6);
}

TEST(Stream, FiducialsAreCollectedFromATipThatRestsInAStream) {
    const Folder folder;
    write_text(folder / "touch.yaml", touching_script(2.6));
    write_image_fiducials(folder);
    Server server(folder, "touch.yaml");
    const auto outcome =
        livetet(folder, "register --tracker " + server.url() +
                            " --for 9.5 --tip-mm 4 -2 150 --image image.mrk.json -o r.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const FiducialRegistration r = read_registration(folder / "r.json");
    EXPECT_LT(r.fre, 0.5e-3);
    EXPECT_LT((r.image_from_base.rotation - image_from_tracker.rotation).norm(), 0.01);
    EXPECT_LT((r.image_from_base.translation - image_from_tracker.translation).norm(), 0.5e-3);
}

TEST(Stream, ATipThatMovesIsRefusedFromAStreamToo) {
    const Folder folder;
    write_text(folder / "moving.yaml",
               "rate_Hz: 40\nduration_s: 20\ntools: [{tool: Stylus, on: tracker, moves: [{at_s: "
               "10, by_mm: [0, 0, 300], "
               "turn_deg: [90, 0, 0]}, {at_s: 20, by_mm: [0, 300, 0]}]}]");
    write_image_fiducials(folder);
    Server server(folder, "moving.yaml", {"--loop"});
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    Running first(
        folder, "first",
        {"record", server.url(), "-o", "first.igs.mha"});  // from the first client on it plays
    std::this_thread::sleep_for(std::chrono::milliseconds(3000));
    const std::string command = "register --tracker " + server.url() +
                                " --tip-mm 0 0 0 --image image.mrk.json -o r.json --for 2 ";
    expect_refused(livetet(folder, command), {server.url(), "rested 0 times"});
    expect_refused(livetet(folder, command + "--dwells 0:20,20:40,40:60"),
                   {server.url(), "the tip moves in frames"});
    EXPECT_FALSE(std::filesystem::exists(folder / "r.json"));
}

TEST(Stream, TrackFollowsAScriptAndAServerThatPlaysIt) {
    const Folder folder;
    const RigidTransform<ImageFrame, Reference> image_from_reference{Eigen::Matrix3d::Identity(),
                                                                     {0.02, 0.1, 0.05}};
    FiducialRegistration registration;
    registration.reference_tool = "Reference";
    registration.image_from_base = {1, image_from_reference.rotation,
                                    image_from_reference.translation};
    for (const Vector3& x :
         {Vector3(0, 0, 0), Vector3(0.2, 0, 0), Vector3(0, 0.1, 0), Vector3(0, 0, 0.1)})
        registration.fiducials.push_back({"F", x, x, image_from_reference.inverse() * x, 0, 0});
    write_registration(folder / "registration.json", registration);
    write_hierarchy(folder / "block.h5", make_hierarchy({test::block({8, 4, 4}, {0.2, 0.1, 0.1}),
                                                         test::block({4, 2, 2}, {0.2, 0.1, 0.1})},
                                                        "a block"));
    write_text(folder / "script.yaml",
               "rate_Hz: 20\nduration_s: 4\nlatency_ms: 30\n"
               "organ: {at_mm: [300, 0, -100], turn_deg: [0, 20, 0], moves: [{at_s: 4, by_mm: [40, "
               "0, 0], turn_deg: [30, "
               "0, 0]}]}\n"
               "tools:\n  - {tool: Reference, at_mm: [20, 100, 50]}\n"
               "  - {tool: Sensor, at_mm: [100, 50, 100], moves: [{at_s: 2}, {at_s: 3, by_mm: [0, "
               "0, -10]}]}\n");
    const auto deepest = [&](const std::string& source, const std::string& options) {
        write_text(folder / "scene.yaml",
                   "mesh: {file: block.h5}\nfix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}]\n"
                   "track: {registration: registration.json, source: \"" +
                       source + "\"}\n");
        const auto outcome = livetet(folder, "track scene.yaml " + options);
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        const ResultReader result(folder / "result.h5");
        double most = 0;
        for (std::size_t k = 0; k < result.frame_count(); ++k)
            most = std::max(most, result.values("press_mm", k, 1)[0]);
        return most;
    };
    // Estimated poses overshoot where a motion stops: by 6 % of a press within a second.
    const auto expect_10 = [](double deepest_mm) {
        EXPECT_GT(deepest_mm, 9.8);
        EXPECT_LT(deepest_mm, 10.8);
    };
    expect_10(deepest("script.yaml", "--every-sample"));
    Server server(folder, "script.yaml");
    expect_10(deepest(server.url(), "--for 3.5"));
}

}  // namespace
}  // namespace livetet
