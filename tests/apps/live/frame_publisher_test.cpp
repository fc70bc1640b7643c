#include "apps/live/frame_publisher.hpp"
#include "apps/live/frame_loop.hpp"

#include <gtest/gtest.h>

#include "io/meshes.hpp"

namespace livetet {
namespace {

/// A frame with a valid registration whose sensors are in these states.
PublishedFrame frame_with(std::vector<SensorState> sensors) {
    PublishedFrame a;
    a.frame.registration = RegistrationStatus::valid;
    a.frame.reference = SensorTrouble::none;
    a.displacement.assign(8, Vector3::Zero());
    for (std::size_t i = 0; i < sensors.size(); ++i) a.sensors.push_back("Sensor");
    a.frame.sensors = std::move(sensors);
    return a;
}

igtl::Status status_of(const PublishedFrame& frame) {
    for (const igtl::Message& m : FrameMessages(testing_meshes::cube(), "Organ")(frame, 0))
        if (m.device == "Livetet") return std::get<igtl::Status>(m.content);
    return {0, 0, "", ""};
}

TEST(FrameMessages, StatusIsOneOnlyIfAllIsFollowed) {
    const SensorState follows{.drive = DriveStatus::following, .trouble = SensorTrouble::none};
    EXPECT_EQ(status_of(frame_with({follows})).code, 1);
    EXPECT_EQ(status_of(frame_with({})).code, 1) << "no sensor, none to follow";

    SensorState placing = follows;
    placing.drive = DriveStatus::placing;
    EXPECT_EQ(status_of(frame_with({follows, placing})).code, 13) << "not ready";
    placing.trouble = SensorTrouble::restless;
    const igtl::Status restless = status_of(frame_with({follows, placing}));
    EXPECT_EQ(restless.code, 7);
    EXPECT_NE(restless.text.find("placing (does not rest)"), std::string::npos) << restless.text;

    PublishedFrame failed = frame_with({follows});
    failed.frame.step.converged = false;
    EXPECT_EQ(status_of(failed).code, 7);
    EXPECT_NE(status_of(failed).text.find("not converged"), std::string::npos);
}

TEST(StatusText, NamesNoToolThatIsGoneAndNoPressWithoutASensor) {
    PublishedFrame a = frame_with({});
    a.tools = {{"Reference", false, 0}};
    SourceStatus source;
    source.state = "receiving";
    source.names = {{"OtherToTracker", 1}};
    source.never_came = {"Nobody"};
    const std::string gone = status_text(a, source, 20, 20);
    EXPECT_EQ(gone.find("Nobody"), std::string::npos) << gone;
    EXPECT_TRUE(gone.ends_with("registration valid")) << gone;

    a.tools.push_back({"Nobody", false, 1});
    EXPECT_NE(status_text(a, source, 20, 20).find("no Nobody yet; what comes: OtherToTracker"),
              std::string::npos);
    const PublishedFrame follows =
        frame_with({{.drive = DriveStatus::following, .trouble = SensorTrouble::none}});
    source.never_came.clear();
    EXPECT_TRUE(status_text(follows, source, 20, 20)
                    .ends_with("registration valid, Sensor following, press 0.0 mm"));
}

TEST(StatusText, SaysByHowMuchPosesLagAndWhatMendsIt) {
    PublishedFrame a = frame_with({{}});
    a.tools = {{"Reference", false, 0}, {"Sensor", false, 1}, {"Stylus", false, 2}};
    a.frame.pose_quality = {{.lag_s = 0.004}, {}, {}};
    EXPECT_NE(status_text(a, {}, 20, 20).find(" | lag Reference 4 ms | "), std::string::npos);
    a.frame.pose_quality[1].lag_s = 0.031;
    const std::string late = status_text(a, {}, 20, 20);
    EXPECT_NE(late.find("lag Reference 4 ms, Sensor 31 ms (track.ahead_ms makes up for it)"),
              std::string::npos)
        << late;
    a.frame.pose_quality.assign(3, {});
    EXPECT_EQ(status_text(a, {}, 20, 20).find("lag"), std::string::npos) << "none is known yet";
    EXPECT_EQ(status_text(a, {}, 20, 20).find("noise"), std::string::npos);
    a.frame.pose_quality[1].position_noise_ratio = 3.14;
    EXPECT_NE(
        status_text(a, {}, 20, 20).find("noise of Sensor 3.1 times what track.position_noise_mm"),
        std::string::npos);
}

TEST(IntervalCount, APauseMovesTheMeanAndNotTheMedian) {
    IntervalCount count;
    EXPECT_EQ(count.median_s(), 0);
    for (int i = 0; i < 5000; ++i) count.add(1, 0.02);
    count.add(10, 0.2);  // nine of them missed
    count.add(1, 25);
    EXPECT_NEAR(count.median_s(), 0.02, 1e-12);
    EXPECT_NEAR(1 / count.mean_s(), 5011 / 125.2, 0.01);
}

}  // namespace
}  // namespace livetet
