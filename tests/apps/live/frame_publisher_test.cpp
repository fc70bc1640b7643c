#include "apps/live/frame_publisher.hpp"

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

}  // namespace
}  // namespace livetet
