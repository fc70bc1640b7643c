#include "apps/live/frame_publisher.hpp"
#include "apps/live/frame_loop.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "io/meshes.hpp"
#include "mesh/hex_cut.hpp"
#include "support/hex_grids.hpp"

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

    SensorState slipped = follows;
    slipped.drive = DriveStatus::releasing;
    slipped.trouble = SensorTrouble::slipped;
    EXPECT_EQ(status_of(frame_with({follows, slipped})).code, 7);
    EXPECT_NE(status_of(frame_with({slipped})).text.find("releasing (slipped)"), std::string::npos);

    PublishedFrame failed = frame_with({follows});
    failed.frame.step.converged = false;
    EXPECT_EQ(status_of(failed).code, 7);
    EXPECT_NE(status_of(failed).text.find("not converged"), std::string::npos);
}

const igtl::PolyData* region_of(const std::vector<igtl::Message>& messages) {
    for (const igtl::Message& m : messages)
        if (m.device == "TargetRegion") return &std::get<igtl::PolyData>(m.content);
    return nullptr;
}

TEST(FrameMessages, RegionsOfAllTargetsAreOneSurface) {
    PublishedFrame a = frame_with({});
    FrameMessages messages_of(testing_meshes::cube(), "Organ");
    EXPECT_EQ(region_of(messages_of(a, 0)), nullptr) << "without targets";

    const double chi = std::sqrt(7.8147);  // standard deviations, 95 % in three dimensions
    const Vector3 places[] = {{0.01, 0.02, 0.03}, {-0.04, 0, 0.1}},
                  deviations_mm[] = {{1, 2, 3}, {0.5, 0.5, 4}};
    const double radii_mm[] = {6.5, 7.9};
    for (int i = 0; i < 2; ++i)
        a.frame.statement.targets.push_back(
            {places[i],
             1e-6 * deviations_mm[i].cwiseAbs2().asDiagonal().toDenseMatrix(),
             1e-3 * radii_mm[i],
             {}});
    a.targets = {"Tumour", "Vessel"};
    a.frame.statement.missing.add(ErrorSource::fixed);
    a.frame.statement.missing.add(ErrorSource::law);
    const std::vector<igtl::Message> messages = messages_of(a, 0);
    const igtl::PolyData* region = region_of(messages);
    ASSERT_NE(region, nullptr);
    ASSERT_EQ(region->points.size(), 2 * 162U);
    ASSERT_EQ(region->polygons.count, 2 * 320U);
    ASSERT_EQ(region->attributes.size(), 2U);
    EXPECT_EQ(region->attributes[0].name, "radius_95_mm");
    EXPECT_EQ(region->attributes[1].name, "missing_sources");
    EXPECT_EQ(region->attributes[1].values, std::vector<float>(2 * 162, 2.0F));
    const std::vector<float>& radius = region->attributes[0].values;
    ASSERT_EQ(radius.size(), region->points.size());
    for (std::size_t k = 0; k < region->points.size(); ++k) {
        const std::size_t i = k / 162;
        const auto& x = region->points[k];
        const Vector3 away = Vector3(x[0], x[1], x[2]) - 1e3 * places[i];
        EXPECT_NEAR(away.cwiseQuotient(deviations_mm[i]).norm(), chi, 1e-3) << k;
        EXPECT_FLOAT_EQ(radius[k], static_cast<float>(radii_mm[i]));
    }
    for (std::size_t t = 0; t < 640; ++t)  // no triangle joins two targets
        for (int k = 1; k <= 3; ++k)
            EXPECT_EQ(region->polygons.list[4 * t + k] / 162, t / 320) << t;
}

/// Two cells, cut apart while the run goes on: the surface gets the cut's two sides.
TEST(FrameMessages, ACutGivesTheSurfaceNewPointsAndTriangles) {
    const TetMesh row = test::hex_grid({2, 1, 1}, {0.2, 0.1, 0.1});
    FrameMessages messages_of(row, "Organ");
    PublishedFrame a = frame_with({});
    a.displacement.assign(12, Vector3::Zero());
    const auto surface = [&] {
        for (const igtl::Message& m : messages_of(a, 0))
            if (m.device == "Organ") return std::get<igtl::PolyData>(m.content);
        return igtl::PolyData{};
    };
    EXPECT_EQ(surface().points.size(), 12U);
    EXPECT_EQ(surface().polygons.count, 20U);

    auto cut = std::make_shared<CutMesh>();
    const HexLevel level = hex_level_of(row, "row");
    const std::vector<std::uint8_t> all(level.links.size(), 1);
    OpenedGrid opened = open_links(row, level, all);
    cut->mesh = std::move(opened.mesh);
    cut->originals = std::move(opened.originals);
    cut->openings = 1;
    cut->parted = 1;
    cut->pieces = 2;
    cut->free_pieces = 1;
    a.frame.cut = cut;
    a.frame.blade_gaps = {2, 0.031};
    a.displacement.assign(16, Vector3::Zero());
    for (std::size_t n = 12; n < 16; ++n) a.displacement[n] = Vector3(0.05, 0, 0);
    const igtl::PolyData apart = surface();
    EXPECT_EQ(apart.points.size(), 16U);
    EXPECT_EQ(apart.polygons.count, 24U);
    for (const igtl::Message& m : messages_of(a, 0))
        if (m.device == "LivetetFrame") {
            EXPECT_NE(std::get<igtl::String>(m.content).text.find(
                          R"("cuts":{"free_pieces":1,"gaps":2,"gaps_mm":31.0,"openings":1,)"
                          R"("parted":1,"pieces":2,"waits":false})"),
                      std::string::npos);
        }
    EXPECT_NE(status_text(a, {}, 0, 0)
                  .find("cut 1 time, 2 pieces, 1 held by nothing | NOT cut in 2 gaps"),
              std::string::npos);
    a.frame.cut = nullptr;
    EXPECT_NE(status_text(a, {}, 0, 0).find(" | NOT cut in 2 gaps"), std::string::npos);
    a.frame.blade_gaps = {};
    EXPECT_EQ(status_text(a, {}, 0, 0).find("cut"), std::string::npos);
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

TEST(StatusText, SaysByHowMuchPosesAreAhead) {
    PublishedFrame a = frame_with({});
    EXPECT_EQ(status_text(a, {}, 20, 20).find("ahead"), std::string::npos);
    a.frame.ahead_s = 0.0234;
    const std::string text = status_text(a, {}, 20, 20);
    EXPECT_NE(text.find(" | latency 0.0 ms, poses 23.4 ms ahead | "), std::string::npos) << text;
    for (const igtl::Message& m : FrameMessages(testing_meshes::cube(), "Organ")(a, 0))
        if (m.device == "LivetetFrame") {
            const std::string& about = std::get<igtl::String>(m.content).text;
            EXPECT_NE(about.find("\"ahead_ms\":23.4"), std::string::npos) << about;
        }
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
