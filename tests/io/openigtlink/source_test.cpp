#include "io/openigtlink/source.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>
#include <string>

#include "io/files.hpp"
#include "io/openigtlink/conversions.hpp"
#include "io/openigtlink/messages.hpp"
#include "io/openigtlink/server.hpp"
#include "io/openigtlink/sockets.hpp"
#include "tracking/poses.hpp"

namespace livetet::igtl {
namespace {

using testing_files::error_of;
using testing_files::says;
using namespace testing_messages;
using namespace testing_sockets;
using State = OpenIgtLinkStatistics::State;

/// Short pauses, and no silence that could produce a sample that a test waits for.
OpenIgtLinkSourceOptions quick() {
    OpenIgtLinkSourceOptions options;
    options.silence_after_s = 1000;
    options.first_retry_s = 0.01;
    options.max_retry_s = 0.05;
    options.stale_after_s = 1000;
    return options;
}

Message stylus_at(double x_m) {
    return transform_message(
        "StylusToTracker", RigidTransform<Tracker, Tool>{Eigen::Matrix3d::Identity(), {x_m, 0, 0}},
        1.7e9 + x_m);
}

/// Waits for a sample whose first tool is usable and at x_m.
bool comes(OpenIgtLinkSource& source, double x_m) {
    return eventually([&] {
        const StreamSample* sample = source.take();
        if (!sample) return false;
        const TrackedPose& pose = sample->sample.poses.at(0);
        return is_usable(pose) && std::abs(pose.translation.x() - x_m) < 1e-6;
    });
}

TEST(OpenIgtLinkSource, GreetsInVersion2AndTakesWhatAPlusServerSends) {
    ListeningPeer plus;
    OpenIgtLinkSource source("127.0.0.1", plus.port(), {"Stylus", "Reference"}, quick());
    Peer peer = plus.accept();
    const Message greeting = peer.receive_message();
    EXPECT_EQ(greeting.type, "STATUS");
    EXPECT_EQ(greeting.version, 2);
    EXPECT_EQ(std::get<Status>(greeting.content).code, 1);

    const auto with_status = [](std::string device, const char* status, double x_m) {
        Message m = stylus_at(x_m);
        m.device = std::move(device);
        return with_metadata(m, {{"TransformValid", std::string(status) == "OK" ? "true" : "false"},
                                 {"TransformStatus", status}});
    };
    peer.send(message("IMAGE", Image{1, 1, 3, 1, 1, {9, 9, 9}, {}, {}, {9, 9, 9}, Bytes(729)}));
    peer.send(with_status("StylusToTracker", "OK", 0.25));
    peer.send(with_status("ReferenceToTracker", "OUT_OF_VIEW", 0.25));
    peer.send(with_status("ProbeToTracker", "OK", 0.25));
    ASSERT_TRUE(eventually([&] { return source.statistics().names.contains("ProbeToTracker"); }));
    const StreamSample* taken = source.take();
    ASSERT_TRUE(taken);
    const StreamSample& sample = *taken;
    EXPECT_NEAR(sample.sample.poses[0].translation.x(), 0.25, 1e-7);
    EXPECT_EQ(sample.sample.poses[1].status, PoseStatus::missing);
    EXPECT_NEAR(sample.times[0].sent_s, 1.7e9 + 0.25, 1e-6);
    const auto statistics = source.statistics();
    EXPECT_EQ(statistics.passed_over, 1) << "the image";
    EXPECT_EQ(statistics.names.size(), 3);
    EXPECT_EQ(statistics.connections, 1);
    EXPECT_GT(statistics.last_arrival_s, 0);
    EXPECT_TRUE(statistics.never_came.empty());
}

TEST(OpenIgtLinkSource, AsksForTrackingDataWhereItIsToldTo) {
    ListeningPeer server;
    OpenIgtLinkSourceOptions options = quick();
    options.request_ms = 20;
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, options);
    Peer peer = server.accept();
    EXPECT_EQ(peer.receive_message().type, "STATUS");
    const Message start = peer.receive_message();
    EXPECT_EQ(start.type, "STT_TDATA");
    EXPECT_EQ(std::get<StartTracking>(start.content).resolution_ms, 20);
    peer.send(message("RTS_TDATA", Reply{0}));
    Message data = message("TDATA", TrackingData{{{"Stylus"}}});
    data.content = TrackingData{{{"Stylus", 2, {1, 0, 0, 0, 1, 0, 0, 0, 1, 500, 0, 0}}}};
    peer.send(data);
    EXPECT_TRUE(comes(source, 0.5));
}

TEST(OpenIgtLinkSource, AServerThatDiesWithinAMessageAndComesBackIsConnectedAgain) {
    ListeningPeer server;
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, quick());
    {
        Peer peer = server.accept();
        peer.send(stylus_at(1));
        ASSERT_TRUE(comes(source, 1));
        const Bytes bytes = encode(stylus_at(2));
        peer.send(ByteView(bytes).first(80));
    }
    Peer peer = server.accept();
    ASSERT_TRUE(eventually([&] { return source.statistics().connections == 2; }));
    EXPECT_TRUE(says(source.statistics().problem, {"127.0.0.1", "within a message"}));
    peer.send(stylus_at(3));
    EXPECT_TRUE(comes(source, 3)) << "the half message is forgotten";
    EXPECT_EQ(source.statistics().messages, 2);
}

TEST(OpenIgtLinkSource, WaitsForAServerThatIsNotThereYetAndFollowsItWhenItComesBack) {
    std::uint16_t port = 0;
    {
        const OpenIgtLinkServer server({"127.0.0.1", 0});
        port = server.port();
    }
    OpenIgtLinkSource source("127.0.0.1", port, {"Stylus"}, quick());
    ASSERT_TRUE(eventually([&] { return source.statistics().state == State::waiting; }));
    EXPECT_FALSE(source.statistics().problem.empty());
    for (int life = 1; life <= 2; ++life) {
        OpenIgtLinkServer server({"127.0.0.1", port});
        EXPECT_TRUE(eventually([&] {
            server.publish({stylus_at(life)});
            const StreamSample* sample = source.take();
            return sample && sample->sample.poses[0].translation.x() == life;
        })) << "life "
            << life;
    }
    EXPECT_EQ(source.statistics().connections, 2);
}

TEST(OpenIgtLinkSource, FollowsAToolThatIsAskedForLater) {
    ListeningPeer server;
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, quick());
    Peer peer = server.accept();
    peer.send(stylus_at(1));
    ASSERT_TRUE(comes(source, 1));
    EXPECT_EQ(source.index_of("Stylus"), 0u);
    EXPECT_EQ(source.index_of("Probe"), 1u);
    EXPECT_EQ(source.tools(), (std::vector<std::string>{"Stylus", "Probe"}));
    EXPECT_THROW((void)source.index_of("StylusToTracker"), Error) << "not to be told from Stylus";
    double x = 1;
    EXPECT_TRUE(eventually([&] {
        x += 0.5;
        Message probe = stylus_at(x);
        probe.device = "ProbeToTracker";
        peer.send(stylus_at(x));
        peer.send(probe);
        const StreamSample* sample = source.take();
        return sample && sample->sample.poses.size() == 2 && is_usable(sample->sample.poses[1]);
    }));
    EXPECT_EQ(source.status().names.at("ProbeToTracker") > 0, true);
}

TEST(OpenIgtLinkSource, AMessageWithAWrongCrcIsDroppedAndCounted) {
    ListeningPeer server;
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, quick());
    Peer peer = server.accept();
    Bytes wrong = encode(stylus_at(1));
    wrong[header_size + 40] ^= 4;
    peer.send(wrong);
    peer.send(stylus_at(2));
    ASSERT_TRUE(comes(source, 2));
    ASSERT_TRUE(eventually([&] { return source.statistics().messages == 1; }));
    EXPECT_EQ(source.statistics().bad_crc, 1);
    EXPECT_EQ(source.statistics().connections, 1);
    EXPECT_TRUE(says(source.statistics().last_error, {"TRANSFORM", "CRC"}));
}

TEST(OpenIgtLinkSource, ASenderOfALaterVersionIsSaidAndOneOfVersion3IsRead) {
    ListeningPeer server;
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, quick());
    Peer peer = server.accept();
    Bytes bytes = encode(with_metadata(stylus_at(1), {{"TransformStatus", "OK"}}));
    bytes[1] = 4;
    peer.send(bytes);
    ASSERT_TRUE(eventually([&] { return source.status().refused == 1; }));
    EXPECT_TRUE(says(source.status().refusal, {"TRANSFORM", "version 4", "expected 1 to 3"}));
    bytes[1] = 3;
    peer.send(bytes);
    EXPECT_TRUE(comes(source, 1));
}

TEST(OpenIgtLinkSource, ATrackingMessageThatIsFarTooLargeIsPassedOver) {
    ListeningPeer server;
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, quick());
    Peer peer = server.accept();
    peer.send(message("TDATA", TrackingData{std::vector<TrackedTool>(3000, {"Stylus"})}));
    peer.send(stylus_at(2));
    ASSERT_TRUE(comes(source, 2));
    ASSERT_TRUE(eventually([&] { return source.statistics().messages == 1; }));
    EXPECT_EQ(source.statistics().passed_over, 1u);
}

TEST(OpenIgtLinkSource, WhatIsNoHeaderEndsTheConnectionAndItIsMadeAnew) {
    ListeningPeer server;
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, quick());
    Peer peer = server.accept();
    peer.send(Bytes(100, 'H'));
    Peer again = server.accept();
    again.send(stylus_at(1));
    EXPECT_TRUE(comes(source, 1));
    EXPECT_TRUE(says(source.statistics().problem, {"OpenIGTLink header"}));
}

TEST(OpenIgtLinkSource, SilenceIsSaidAndWakesWhoWaits) {
    ListeningPeer server;
    OpenIgtLinkSourceOptions options = quick();
    options.silence_after_s = options.stale_after_s = 0.02;
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, options);
    Peer peer = server.accept();
    for (int i = 1; i <= 2; ++i) {
        EXPECT_TRUE(eventually([&] {
            peer.send(stylus_at(i));
            const StreamSample* sample = source.take();
            return sample && sample->sample.poses[0].translation.x() == i;
        }));
        EXPECT_TRUE(eventually([&] { return source.statistics().state == State::silent; }));
        EXPECT_EQ(source.next()->sample.poses[0].status, PoseStatus::stale);
    }
}

/// The server's machine lost its power: nothing closes the connection.
TEST(OpenIgtLinkSource, ASilentConnectionIsClosedAndMadeAnew) {
    ListeningPeer server;
    OpenIgtLinkSourceOptions options = quick();
    options.hang_up_after_s = 0.1;
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, options);
    Peer mute = server.accept();
    Peer again = server.accept();
    again.send(stylus_at(1));
    EXPECT_TRUE(comes(source, 1));
    EXPECT_TRUE(says(source.statistics().problem, {"no message for 0.1 s"}));
    EXPECT_GE(source.statistics().connections, 2u);
}

/// A helper process of MPI that inherited a socket would keep its connection open after we closed
/// it.
TEST(OpenIgtLinkSource, NoOtherProgramInheritsItsSockets) {
    const auto inherited = [] {
        std::set<int> found;
        for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
            const int descriptor = std::stoi(entry.path().filename());
            if (const int flags = ::fcntl(descriptor, F_GETFD); flags >= 0 && !(flags & FD_CLOEXEC))
                found.insert(descriptor);
        }
        return found;
    };
    const std::set<int> before = inherited();
    OpenIgtLinkServer server({.port = 0});
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, quick());
    ASSERT_TRUE(eventually([&] { return server.statistics().clients == 1; }));
    ASSERT_TRUE(eventually([&] { return source.statistics().connections == 1; }));
    EXPECT_EQ(inherited(), before);
}

TEST(OpenIgtLinkSource, WhoWaitsWakesUpWhateverElseKeepsComing) {
    const auto probe = [] {
        Message m = stylus_at(1);
        m.device = "ProbeToTracker";
        return m;
    };
    for (const Message& other : {message("STATUS", Status{1, 0, "", ""}), probe()}) {
        ListeningPeer server;
        OpenIgtLinkSourceOptions options = quick();
        options.stale_after_s = 0.05;
        OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus"}, options);
        Peer peer = server.accept();
        int woken = 0;
        EXPECT_TRUE(eventually([&] {
            peer.send(other);
            const StreamSample* sample = source.take();
            return sample && sample->sample.poses[0].status == PoseStatus::missing && ++woken == 5;
        })) << other.type;
        EXPECT_EQ(source.statistics().state, State::receiving);
        EXPECT_EQ(source.statistics().samples, 0u) << "none in which a tool came";
    }
}

TEST(OpenIgtLinkSource, EndsAtOnceWhateverItIsDoing) {
    ListeningPeer server;
    { const OpenIgtLinkSource connecting("127.0.0.1", server.port(), {"Stylus"}); }
    { const OpenIgtLinkSource waiting("127.0.0.1", 1, {"Stylus"}); }
    const OpenIgtLinkSource connected("127.0.0.1", server.port(), {"Stylus"});
    Peer peer = server.accept();
    SUCCEED() << "no destructor hangs";
}

TEST(OpenIgtLinkSource, RefusesOptionsThatMakeNoSense) {
    OpenIgtLinkSourceOptions options;
    options.silence_after_s = 0;
    EXPECT_TRUE(says(error_of([&] { OpenIgtLinkSource("127.0.0.1", 1, {"Stylus"}, options); }),
                     {"silence_after_s", "expected more than 0"}));
}

TEST(OpenIgtLinkSource, TakesWhatOurOwnServerPublishes) {
    OpenIgtLinkServer server({"127.0.0.1", 0});
    OpenIgtLinkSource source("127.0.0.1", server.port(), {"Stylus", "Reference"});
    const auto tool = [](const char* name, double x_m) {
        return transform_message(
            name, RigidTransform<Tracker, Tool>{rotation_of_vector({0.1, 0.2, 0.3}), {x_m, 0, 0}},
            1.7e9);
    };
    EXPECT_TRUE(eventually([&] {
        server.publish({tool("StylusToTracker", 0.5), tool("ReferenceToTracker", -0.25)});
        const StreamSample* sample = source.take();
        if (!sample) return false;
        const auto& poses = sample->sample.poses;
        return poses[0].status == PoseStatus::ok && poses[1].status == PoseStatus::ok &&
               poses[0].translation.x() == 0.5 && poses[1].translation.x() == -0.25 &&
               poses[0].rotation.isApprox(rotation_of_vector({0.1, 0.2, 0.3}), 1e-6);
    }));
}

}  // namespace
}  // namespace livetet::igtl
