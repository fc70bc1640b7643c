// `livetet register --deform --live`: fits while a stylus is led over a deformed block.

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "apps/commands/deformed_block.hpp"
#include "apps/live/statement_record.hpp"
#include "geometry/transform.hpp"
#include "io/openigtlink/messages.hpp"
#include "io/openigtlink/sockets.hpp"
#include "io/registration_file.hpp"
#include "io/sequence_file.hpp"
#include "support/server.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using namespace igtl::testing_messages;
using namespace igtl::testing_sockets;
using nlohmann::json;
using test::DeformedBlock;
using test::expect_refused;
using test::livetet;
using test::middle;
using test::Running;
using test::text_of;
using test::write_text;

/// The block, a recording of a stylus that is led over its top and sides, and the registration of
/// the reference sensor that it is recorded with.
struct SweptBlock {
    DeformedBlock block;
    SimulatedTrackerOptions tracker;
    std::vector<Vector3> places = block.points();

    SweptBlock() {
        block.write_scene("  frame_error_mm: 1\n  frame_error_deg: 0.5\n");
        tracker.rate_Hz = 200;
        tracker.position_rms_mm = tracker.rotation_rms_deg = 0;
        tracker.image_from_reference.translation = {0.04, 0.04, -0.01};
        FiducialRegistration registration;
        registration.reference_tool = "Reference";
        registration.image_from_base.translation = tracker.image_from_reference.translation;
        for (int i = 0; i < 3; ++i)
            registration.fiducials.push_back(
                {.name = fmt::format("F{}", i), .in_image = Vector3::Unit(i)});
        write_registration(block.folder / "registration.json", registration);
        // On the way to the organ the tip is far from it.
        std::vector<Vector3> path(40, Vector3(0.04, 0.04, 0.2));
        path.insert(path.end(), places.begin(), places.end());
        write_sequence(block.folder / "sweep.igs.mha", simulate_sweep(tracker, path));
    }
    static std::string arguments(const std::string& more) {
        return "register --deform scene.yaml --surface-points sweep.igs.mha --tip-mm 4 -2 150 "
               "--registration registration.json " +
               more;
    }
    test::Outcome run(const std::string& more) const {
        return livetet(block.folder, arguments(more));
    }
};

TEST(RegisterLive, EndsLikeOneFitOfAllPointsAndKeepsTheFitsOnTheWay) {
    const SweptBlock swept;
    const DeformedBlock& block = swept.block;
    const auto outcome = swept.run("--live --json found.json -o better.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const json found = json::parse(text_of(block.folder / "found.json"))["registration"];
    EXPECT_EQ(found["points"], swept.places.size()) << "not those on the way";
    EXPECT_TRUE(found["converged"].get<bool>());

    const ResultReader result(block.folder / "result.h5");
    const std::size_t last = result.frame_count() - 1;
    EXPECT_GE(last, 2U);
    const double length_s = static_cast<double>(swept.places.size() + 39) / swept.tracker.rate_Hz;
    EXPECT_NEAR(result.times_s().back(), length_s, 0.01);
    EXPECT_TRUE(std::ranges::is_sorted(result.times_s()));
    const StatementReader statements(result, "result.h5");
    ASSERT_EQ(statements.names(), std::vector<std::string>{"Middle"});
    for (std::size_t k = 0; k <= last; ++k)
        EXPECT_EQ(statements.read(k).targets.size(), 1U) << "frame " << k;
    EXPECT_EQ(result.displacement(last).size(), result.mesh().nodes.size());
    const auto place_in = [&](std::size_t k) -> Vector3 {
        return middle +
               PointSampler(result.mesh(), std::vector{middle}).sample(0, result.displacement(k));
    };
    const double moved = (block.true_place(middle) - middle).norm();
    EXPECT_LT((place_in(last) - block.true_place(middle)).norm(), 0.2 * moved);

    std::vector<Vector3> in_image = swept.places;
    test::write_points(block.folder / "points.csv", in_image);
    const auto at_once = block.run();
    ASSERT_EQ(at_once.status, 0) << at_once.err;
    EXPECT_LT((place_in(last) - block.found_place(middle)).norm(), 0.01 * moved)
        << "it hangs on the fits before";
}

/// What a client like 3D Slicer is sent until the run ends, by type and device.
std::map<std::string, int> received_by(Peer client) {
    std::map<std::string, int> counts;
    client.send(with_metadata(message("STATUS", igtl::Status{1, 0, "", ""}), {}));
    try {
        for (;;) {
            const igtl::Message m = client.receive_message();
            ++counts[m.type + " " + m.device];
        }
    } catch (const std::exception&) {
    }
    return counts;
}

std::vector<std::string> words_of(const std::string& line) {
    std::istringstream in(line);
    return {std::istream_iterator<std::string>(in), {}};
}

TEST(RegisterLive, PublishesEachFit) {
    const SweptBlock swept;
    Running running(swept.block.folder, "sweep",
                    words_of(SweptBlock::arguments("--live --publish 0")));
    std::uint16_t port = 0;
    for (int i = 0; i < 500 && port == 0; ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        const std::string said = running.errors(), before = "127.0.0.1 port ";
        const std::size_t at = said.find(before);
        if (at != std::string::npos && said.find('\n', at) != std::string::npos)
            port = static_cast<std::uint16_t>(std::stoi(said.substr(at + before.size())));
    }
    ASSERT_GT(port, 0);
    const std::map<std::string, int> counts = received_by(connect_to(port));
    EXPECT_EQ(running.wait().status, 0);
    for (const char* name : {"POLYDATA Organ", "POLYDATA TargetRegion", "TRANSFORM TrackerToRAS",
                             "TRANSFORM StylusTipToRAS", "STATUS Livetet", "STRING LivetetFrame"})
        EXPECT_TRUE(counts.contains(name)) << name;
}

TEST(RegisterLive, RefusesWhatItCannotFollow) {
    const SweptBlock swept;
    const DeformedBlock& block = swept.block;
    const auto refused = [&](const std::string& arguments,
                             std::initializer_list<std::string> parts) {
        expect_refused(livetet(block.folder, "register --deform scene.yaml " + arguments), parts);
        EXPECT_FALSE(std::filesystem::exists(block.folder / "result.h5")) << arguments;
    };
    const std::string tip = " --tip-mm 4 -2 150 ", frame = " --registration registration.json ";
    test::write_points(block.folder / "points.csv", swept.places);
    refused("--surface-points points.csv --live" + frame, {"--live", "points.csv", "list"});
    refused("--surface-points sweep.igs.mha --live" + tip, {"--live", "--registration"});
    refused("--surface-points sweep.igs.mha --live" + frame, {"--tip"});
    refused("--surface-points sweep.igs.mha --live --surface-frames 1:9" + tip + frame,
            {"--surface-frames", "--live"});
    refused("--surface-points sweep.igs.mha --publish 0" + tip + frame, {"--publish", "--live"});
    refused("--surface-points sweep.igs.mha --live --publish x" + tip + frame,
            {"--publish x", "port"});
    refused("--surface-points sweep.igs.mha --live --tool Pointer" + tip + frame, {"Pointer"});
    block.write_scene("  frame: surface\n");
    refused("--surface-points sweep.igs.mha --live" + tip + frame, {"deform.frame", "--live"});
    expect_refused(livetet(block.folder, "register --tracker t.csv --image i.csv --live"),
                   {"--live", "--deform"});

    // A sweep that reaches the organ nowhere.
    block.write_scene("");
    write_sequence(block.folder / "sweep.igs.mha",
                   simulate_sweep(swept.tracker, std::vector<Vector3>(60, {0.04, 0.04, 0.3})));
    refused("--surface-points sweep.igs.mha --live" + tip + frame,
            {"sweep.igs.mha", "found 0 surface points", "at least 10"});
}

}  // namespace
}  // namespace livetet
