#include "io/openigtlink/server.hpp"

#include <gtest/gtest.h>

#include "io/files.hpp"
#include "io/openigtlink/conversions.hpp"
#include "io/openigtlink/messages.hpp"
#include "io/openigtlink/sockets.hpp"
#include "io/openigtlink/wire_names.hpp"

namespace livetet::igtl {
namespace {

using testing_files::error_of;
using testing_files::says;
using namespace testing_messages;
using namespace testing_sockets;

const OpenIgtLinkServerOptions any_port{"127.0.0.1", 0};

bool has_clients(const OpenIgtLinkServer& server, std::size_t count) {
    return eventually([&] { return server.statistics().clients == count; });
}

/// A surface of `points` points; about 24 bytes a point on the wire.
Message surface(std::size_t points, double time_s = 1.7e9) {
    const std::vector<Eigen::Vector3d> x(points, Eigen::Vector3d(0.001, 0.002, 0.003));
    std::vector<Triangle> triangles;
    for (std::size_t i = 2; i < points; i += 2)
        triangles.push_back({static_cast<std::int32_t>(i - 2), static_cast<std::int32_t>(i - 1),
                             static_cast<std::int32_t>(i)});
    const std::vector<float> pressed(points, 1.5f);
    const PointScalars scalars[] = {{"displacement_mm", pressed}};
    return surface_message("Organ", x, triangles, scalars, time_s);
}

TEST(OpenIgtLinkServer, PublishesInMillimetresToEveryClientAndInOrder) {
    OpenIgtLinkServer server(any_port);
    Peer one = connect_to(server.port()), two = connect_to(server.port());
    ASSERT_TRUE(has_clients(server, 2));
    const RigidTransform<ImageFrame, Tracker> image_from_tracker{Eigen::Matrix3d::Identity(),
                                                                 {0.1, 0.2, 0.3}};
    server.publish({surface(5), transform_message("TrackerToImage", image_from_tracker, 1.7e9),
                    status_message("Frame", 1, "tracking", 1.7e9),
                    string_message("Report", "2.5 mm", 1.7e9)});
    for (Peer* peer : {&one, &two}) {
        const Message organ = peer->receive_message();
        EXPECT_EQ(organ.version, 1);
        EXPECT_EQ(organ.device, "Organ");
        const auto body = std::get<PolyData>(organ.content);
        EXPECT_EQ(body.points.at(4), (std::array<float, 3>{1, 2, 3}));
        EXPECT_EQ(body.polygons.list, (std::vector<std::uint32_t>{3, 0, 1, 2, 3, 2, 3, 4}));
        EXPECT_EQ(body.attributes.at(0).name, "displacement_mm");
        EXPECT_EQ(std::get<Transform>(peer->receive_message().content).matrix[10], 200);
        EXPECT_EQ(std::get<Status>(peer->receive_message().content).text, "tracking");
        EXPECT_EQ(std::get<String>(peer->receive_message().content).text, "2.5 mm");
    }
    EXPECT_TRUE(eventually([&] { return server.statistics().sent == 8; }));
}

TEST(OpenIgtLinkServer, SpeaksVersion2ToWhoSpeaksVersion2) {
    OpenIgtLinkServer server(any_port);
    Peer slicer = connect_to(server.port()), old = connect_to(server.port());
    Message hello = status_message("Slicer", 1, "", 0);
    hello.version = 2;
    slicer.send(hello);
    ASSERT_TRUE(has_clients(server, 2));
    Message m;
    do {  // until its greeting has been read
        server.publish({string_message("A name of more than twenty bytes", "x", 0)});
        m = slicer.receive_message();
    } while (m.version == 1);
    EXPECT_EQ(whole_name(m), "A name of more than twenty bytes");
    EXPECT_EQ(old.receive_message().version, 1);
}

TEST(OpenIgtLinkServer, NumbersNamesThatAgreeIn20Bytes) {
    OpenIgtLinkServer server(any_port);
    Peer old = connect_to(server.port());
    ASSERT_TRUE(has_clients(server, 1));
    server.publish({string_message("DeformationSensorLeft1ToRAS", "1", 0),
                    string_message("DeformationSensorLeft2ToRAS", "2", 0),
                    status_message("DeformationSensorLeft2ToRAS", 1, "of another type", 0)});
    EXPECT_EQ(old.receive_message().device, "DeformationSensorLef");
    EXPECT_EQ(old.receive_message().device, "DeformationSensorL_2");
    EXPECT_EQ(old.receive_message().device, "DeformationSensorLef");
}

TEST(WireNames, KeepTheWholeNameInTheMetadata) {
    std::vector<std::string> told;
    WireNames names([&](const std::string& text) { told.push_back(text); });
    for (int i = 0; i < 2; ++i)
        for (const char* device : {"DeformationSensorLeft1", "DeformationSensorLeft2", "Sensor"}) {
            Message m = string_message(device, "", 0);
            names.assign(m);
            EXPECT_LE(m.device.size(), device_name_size);
            EXPECT_EQ(whole_name(m), device);
        }
    ASSERT_EQ(told.size(), 1u);
    EXPECT_NE(told[0].find("DeformationSensorLeft2 is sent as DeformationSensorL_2"),
              std::string::npos)
        << told[0];
}

TEST(OpenIgtLinkServer, AMessageOfVersion2GoesToThoseAloneWhoSpeakIt) {
    OpenIgtLinkServer server(any_port);
    Peer slicer = connect_to(server.port()), old = connect_to(server.port());
    Message hello = status_message("Slicer", 1, "", 0);
    hello.version = 2;
    slicer.send(hello);
    ASSERT_TRUE(has_clients(server, 2));
    do server.publish({string_message("All", "hello", 0)});
    while (slicer.receive_message().version == 1);
    Message some = string_message("Some", "x", 0);
    some.version = 2;
    server.publish({some, string_message("All", "bye", 0)});
    EXPECT_EQ(slicer.receive_message().device, "Some");
    Message m;
    do {
        m = old.receive_message();
        EXPECT_EQ(m.device, "All");
    } while (std::get<String>(m.content).text != "bye");
}

TEST(OpenIgtLinkServer, AQueryIsAnsweredByNotFound) {
    OpenIgtLinkServer server(any_port);
    Peer peer = connect_to(server.port());
    peer.send(message("STRING", String{3, std::string(60000, 'x')}));
    peer.send(message("GET_POLYDATA", Raw{}));
    const Message answer = peer.receive_message();
    EXPECT_EQ(answer.type, "STATUS");
    EXPECT_EQ(std::get<Status>(answer.content).code, 4);
}

TEST(OpenIgtLinkServer, WhoAsksForTrackingDataIsToldThatThereIsNone) {
    OpenIgtLinkServer server(any_port);
    Peer peer = connect_to(server.port());
    peer.send(message("STT_TDATA", StartTracking{50, "RAS"}));
    const Message answer = peer.receive_message();
    EXPECT_EQ(answer.type, "RTS_TDATA");
    EXPECT_EQ(std::get<Reply>(answer.content).status, 1);
}

TEST(OpenIgtLinkServer, AClientThatNeverReadsLosesMessagesAndDelaysNobody) {
    OpenIgtLinkServer server(any_port);
    Peer never_reads = connect_to(server.port()), reads = connect_to(server.port());
    ASSERT_TRUE(has_clients(server, 2));
    constexpr int frames = 60;  // of 1.2 MB: far more than the system buffers for a connection
    for (int i = 1; i <= frames; ++i) {
        server.publish({surface(50000, i), string_message("Frame", std::to_string(i), i)});
        Message m;
        do m = reads.receive_message();
        while (m.type != "STRING");
        EXPECT_EQ(std::get<String>(m.content).text, std::to_string(i));
    }
    const auto statistics = server.statistics();
    EXPECT_EQ(statistics.clients, 2);
    EXPECT_EQ(statistics.skipped, 0);
    EXPECT_GT(statistics.dropped, frames / 2);
    // If the client reads after all, it gets whole messages with the newest at the end.
    std::string last;
    while (last != std::to_string(frames)) {
        const Message m = never_reads.receive_message();
        if (m.type == "STRING") last = std::get<String>(m.content).text;
    }
}

TEST(OpenIgtLinkServer, AClientThatLeavesWithinAMessageIsForgotten) {
    OpenIgtLinkServer server(any_port);
    Peer stays = connect_to(server.port());
    {
        Peer leaves = connect_to(server.port());
        ASSERT_TRUE(has_clients(server, 2));
        server.publish({surface(200000)});
        leaves.receive(1000);
    }
    EXPECT_EQ(stays.receive_message().type, "POLYDATA");
    EXPECT_TRUE(has_clients(server, 1));
    server.publish({string_message("Frame", "next", 0)});
    EXPECT_EQ(stays.receive_message().type, "STRING");
}

TEST(OpenIgtLinkServer, WhoSendsWhatIsNoHeaderIsDisconnectedAlone) {
    OpenIgtLinkServer server(any_port);
    Peer stays = connect_to(server.port()), hostile = connect_to(server.port());
    ASSERT_TRUE(has_clients(server, 2));
    hostile.send(Bytes(200, 0xff));
    EXPECT_TRUE(hostile.receive(1).empty()) << "closed";
    EXPECT_TRUE(has_clients(server, 1));
    server.publish({string_message("Frame", "next", 0)});
    EXPECT_EQ(stays.receive_message().type, "STRING");
}

TEST(OpenIgtLinkServer, TurnsAwayMoreClientsThanItMayHave) {
    OpenIgtLinkServer server({"127.0.0.1", 0, 1});
    Peer first = connect_to(server.port());
    ASSERT_TRUE(has_clients(server, 1));
    Peer second = connect_to(server.port());
    EXPECT_TRUE(second.receive(1).empty());
    EXPECT_EQ(server.statistics().turned_away, 1);
}

TEST(OpenIgtLinkServer, AMessageThatCannotBeEncodedIsCountedAndTheOthersGo) {
    OpenIgtLinkServer server(any_port);
    Peer peer = connect_to(server.port());
    ASSERT_TRUE(has_clients(server, 1));
    server.publish(
        {string_message("Long", std::string(70000, 'x'), 0), string_message("Short", "x", 0)});
    EXPECT_EQ(peer.receive_message().device, "Short");
    EXPECT_EQ(server.statistics().refused, 1);
    EXPECT_TRUE(says(server.statistics().last_error, {"STRING", "70000"}));
}

TEST(OpenIgtLinkServer, APortInUseAndAnAddressThatIsNoneAreSaid) {
    const OpenIgtLinkServer server(any_port);
    EXPECT_TRUE(says(
        error_of([&] {
            OpenIgtLinkServer({"127.0.0.1", server.port()});
        }),
        {"127.0.0.1", std::to_string(server.port()).c_str(), "in use", "expected a free port"}));
    EXPECT_TRUE(says(error_of([] {
                         OpenIgtLinkServer({"localhost:x", 0});
                     }),
                     {"localhost:x", "127.0.0.1"}));
    EXPECT_TRUE(says(error_of([] { OpenIgtLinkServer({"192.0.2.1", 0}); }), {"192.0.2.1"}));
}

TEST(OpenIgtLinkServer, ASurfaceThatContradictsItselfIsRefusedBeforeItIsSent) {
    const std::vector<Eigen::Vector3d> points(3);
    const Triangle outside[] = {{0, 1, 3}}, inside[] = {{0, 1, 2}};
    const std::vector<float> two(2);
    const PointScalars scalars[] = {{"u", two}};
    EXPECT_TRUE(says(error_of([&] { surface_message("Organ", points, outside, {}, 0); }),
                     {"Organ", "point 3", "0 to 2"}));
    EXPECT_TRUE(says(error_of([&] { surface_message("Organ", points, inside, scalars, 0); }),
                     {"2 values of u"}));
}

}  // namespace
}  // namespace livetet::igtl
