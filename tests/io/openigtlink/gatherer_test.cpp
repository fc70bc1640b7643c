#include "io/openigtlink/gatherer.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "io/files.hpp"
#include "io/openigtlink/conversions.hpp"
#include "io/openigtlink/messages.hpp"
#include "tracking/poses.hpp"

namespace livetet::igtl {
namespace {

using testing_files::error_of;
using testing_files::says;
using namespace testing_messages;

constexpr double when = 1.7e9;  // time of the sender's and the UTC clock
const OpenIgtLinkSourceOptions options;

/// A gatherer for Stylus and Reference, and the samples it posted.
struct Gathered {
    std::vector<StreamSample> samples;
    PoseGatherer gatherer{{"Stylus", "Reference"},
                          options,
                          [this](const StreamSample& s) { samples.push_back(s); },
                          100,
                          when};

    /// Posts everything due until then, with a clock that ticks every 5 ms.
    void wait_until(double end_s) {
        for (double now_s = waited_s_; now_s < end_s; now_s += 0.005) gatherer.post_due(now_s);
        waited_s_ = end_s;
    }

    void transform(const std::string& name, double x_m, double sent_s, double now_s) {
        gatherer.take(transform_message(name, at(x_m), sent_s), now_s);
    }
    static RigidTransform<Tracker, Tool> at(double x_m) {
        return {Eigen::Matrix3d::Identity(), {x_m, 0, 0}};
    }
    double x(std::size_t sample, std::size_t tool) const {
        const TrackedPose& pose = samples.at(sample).sample.poses.at(tool);
        return is_usable(pose) ? pose.translation.x() : -1;
    }

  private:
    double waited_s_ = 100;
};

TEST(PoseGatherer, TransformsOfOneMomentAreOneSampleWithoutAnyWait) {
    Gathered g;
    g.transform("StylusToTracker", 1, when, 100);
    g.transform("ReferenceToTracker", 2, when, 100.001);
    g.samples.clear();  // the tools were not known yet
    g.transform("ReferenceToTracker", 4, when + 0.1, 100.1);
    EXPECT_TRUE(g.samples.empty());
    g.transform("StylusToTracker", 3, when + 0.1, 100.1);
    ASSERT_EQ(g.samples.size(), 1);
    EXPECT_EQ(g.x(0, 0), 3);
    EXPECT_EQ(g.x(0, 1), 4);
    EXPECT_NEAR(g.samples[0].sample.time_s, when + 0.1, 1e-6);
    EXPECT_EQ(g.samples[0].arrived_s, 100.1);
    EXPECT_GT(g.gatherer.due_s(), 100.1 + options.gather_s) << "nothing is under way";
}

TEST(PoseGatherer, AToolLeftOutIsWaitedForOnlyALittleAndKeepsItsPoseUntilItIsStale) {
    Gathered g;
    g.transform("StylusToTracker", 1, when, 100);
    g.transform("ReferenceToTracker", 2, when, 100);
    g.samples.clear();
    g.transform("StylusToTracker", 3, when + 0.1, 100.1);
    EXPECT_NEAR(g.gatherer.due_s(), 100.1 + options.gather_s, 1e-9);
    g.gatherer.post_due(100.1 + options.gather_s / 2);
    EXPECT_TRUE(g.samples.empty());
    g.gatherer.post_due(100.1 + options.gather_s);
    ASSERT_EQ(g.samples.size(), 1);
    EXPECT_EQ(g.x(0, 0), 3);
    EXPECT_EQ(g.x(0, 1), 2) << "the pose of 0.1 s ago";
    EXPECT_NEAR(g.samples[0].times[1].sent_s, when, 1e-6);
    g.transform("StylusToTracker", 4, when + 0.5, 100.5);
    ASSERT_EQ(g.samples.size(), 2) << "nobody waits for a tool that is stale";
    EXPECT_EQ(g.x(1, 0), 4);
    EXPECT_EQ(g.samples[1].sample.poses[1].status, PoseStatus::stale);
}

TEST(PoseGatherer, ALaterTimeStampEndsTheSampleUnderWay) {
    Gathered g;
    g.transform("StylusToTracker", 1, when, 100);
    g.transform("ReferenceToTracker", 2, when, 100);
    g.samples.clear();
    g.transform("StylusToTracker", 3, when + 0.001, 100.001);
    g.transform("StylusToTracker", 4, when + 0.002, 100.002);
    ASSERT_EQ(g.samples.size(), 1);
    EXPECT_EQ(g.x(0, 0), 3);
    EXPECT_NEAR(g.samples[0].sample.time_s, when + 0.001, 1e-6);
}

TEST(PoseGatherer, PosesThatAreNotFiniteOrNotRigidAreBroken) {
    Gathered g;
    const auto posted = [&](std::array<float, 12> matrix) {
        g.gatherer.take(message("TRANSFORM", Transform{matrix}, "StylusToTracker"), 100);
        return g.samples.back().sample.poses[0].status;
    };
    EXPECT_EQ(posted({1, 0, 0, 0, 1, 0, 0, 0, 1, 5, 6, 7}), PoseStatus::ok);
    EXPECT_TRUE(g.samples.back().sample.poses[0].translation.isApprox(
        Eigen::Vector3d(0.005, 0.006, 0.007)));
    const float nan = std::numeric_limits<float>::quiet_NaN(),
                infinite = std::numeric_limits<float>::infinity();
    EXPECT_EQ(posted({1, 0, 0, 0, 1, 0, 0, 0, 1, nan, 6, 7}), PoseStatus::broken);
    EXPECT_EQ(posted({nan, 0, 0, 0, 1, 0, 0, 0, 1, 5, 6, 7}), PoseStatus::broken);
    EXPECT_EQ(posted({1, 0, 0, 0, 1, 0, 0, 0, 1, 5, infinite, 7}), PoseStatus::broken);
    EXPECT_EQ(posted({1, 0, 0, 0, 1, 0, 0, 0, -1, 5, 6, 7}), PoseStatus::broken) << "a reflection";
    EXPECT_EQ(posted({2, 0, 0, 0, 2, 0, 0, 0, 2, 5, 6, 7}), PoseStatus::broken) << "twice as large";
    EXPECT_TRUE(g.samples.back().sample.poses[0].translation.isZero())
        << "no numbers of a pose that is none";
}

TEST(PoseGatherer, PositionsAndQuaternionsAreTakenAsTransformsAre) {
    Gathered g;
    const float h = std::sqrt(0.5f);
    g.gatherer.take(
        message("POSITION", Position{{10, 20, 30}, {0, 0, h, h}, Position::Layout::whole},
                "Stylus"),
        100);
    ASSERT_EQ(g.samples.size(), 1);
    const TrackedPose pose = g.samples[0].sample.poses[0];
    EXPECT_EQ(pose.status, PoseStatus::ok);
    EXPECT_TRUE(
        (pose.rotation * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-6));
    EXPECT_TRUE(pose.translation.isApprox(Eigen::Vector3d(0.01, 0.02, 0.03), 1e-6));
    for (const std::array<float, 4>& wrong :
         {std::array<float, 4>{0, 0, 0, 0}, {0, 0, 1, 1}, {NAN, 0, 0, 1}}) {
        g.gatherer.take(message("QTDATA", QuaternionTrackingData{{{"Stylus", 2, {}, wrong}}}), 100);
        EXPECT_EQ(g.samples.back().sample.poses[0].status, PoseStatus::broken);
    }
    g.gatherer.take(
        message("POSITION", Position{{1, 2, 3}, {}, Position::Layout::without_rotation}, "Stylus"),
        100);
    EXPECT_EQ(g.samples.back().sample.poses[0].status, PoseStatus::broken)
        << "a rotation that nobody sent";
}

TEST(PoseGatherer, MetadataSayWhetherAPoseHolds) {
    Gathered g;
    const auto posted = [&](std::vector<std::pair<std::string, std::string>> items) {
        g.gatherer.take(
            with_metadata(message("TRANSFORM", Transform{}, "StylusToTracker"), std::move(items)),
            100);
        return g.samples.back().sample.poses[0].status;
    };
    EXPECT_EQ(posted({{"TransformStatus", "OK"}}), PoseStatus::ok);
    EXPECT_EQ(posted({{"TransformStatus", "MISSING"}}), PoseStatus::missing);
    EXPECT_EQ(posted({{"TransformStatus", "OUT_OF_VOLUME"}}), PoseStatus::out_of_volume);
    EXPECT_EQ(posted({{"TransformStatus", "INVALID"}, {"TransformValid", "true"}}),
              PoseStatus::invalid);
    EXPECT_EQ(posted({{"TransformValid", "false"}}), PoseStatus::invalid);
    EXPECT_EQ(posted({{"TransformValid", "true"}}), PoseStatus::ok);

    const auto from_list = [&](const char* key) {
        const Message list =
            message("TDATA", TrackingData{{{"StylusToTracker"}, {"ReferenceToTracker"}}});
        g.gatherer.take(with_metadata(list, {{key, "OUT_OF_VIEW"}}), 100);
        return std::pair(g.samples.back().sample.poses[0].status,
                         g.samples.back().sample.poses[1].status);
    };
    const std::pair stylus_only(PoseStatus::missing, PoseStatus::ok);
    EXPECT_EQ(from_list("StylusToTrackerTransformStatus"), stylus_only);
    EXPECT_EQ(from_list("StylusTransformStatus"), stylus_only);
}

TEST(PoseGatherer, AToolNoLongerInItsListIsMissingAtOnce) {
    Gathered g;
    g.gatherer.take(message("TDATA", TrackingData{{{"Stylus"}, {"Reference"}}}), 100);
    ASSERT_EQ(g.samples.size(), 1);
    g.gatherer.take(message("TDATA", TrackingData{{{"Reference"}}}), 100.01);
    ASSERT_EQ(g.samples.size(), 2);
    EXPECT_EQ(g.samples[1].sample.poses[0].status, PoseStatus::missing);
    EXPECT_EQ(g.samples[1].sample.poses[1].status, PoseStatus::ok);
    g.gatherer.take(message("TDATA", TrackingData{}), 100.02);
    ASSERT_EQ(g.samples.size(), 3);
    EXPECT_EQ(g.samples[2].sample.poses[1].status, PoseStatus::missing);
}

TEST(PoseGatherer, CountsEveryNameAndKnowsWhoNeverCame) {
    Gathered g;
    g.transform("StylusToTracker", 1, when, 100);
    g.transform("StylusToReference", 1, when, 100);
    g.transform("ProbeToTracker", 1, when, 100);
    g.transform("ProbeToTracker", 1, when, 100);
    EXPECT_EQ(g.gatherer.names(),
              (std::map<std::string, std::uint64_t>{
                  {"ProbeToTracker", 2}, {"StylusToReference", 1}, {"StylusToTracker", 1}}));
    EXPECT_EQ(g.gatherer.never_came(), std::vector<std::string>{"Reference"});
    for (int i = 0; i < 1000; ++i) g.transform("Name" + std::to_string(i), 1, when, 100);
    EXPECT_LE(g.gatherer.names().size(), 256);
}

TEST(PoseGatherer, LongNamesAreKnownWholeOrByTheir20Bytes) {
    std::vector<StreamSample> samples;
    PoseGatherer gatherer(
        {"LongInstrumentName", "LongInstrument"}, options,
        [&](const auto& s) { samples.push_back(s); }, 100, when);
    const auto ok = [&](Message& m) {
        samples.clear();
        m.time_stamp += std::uint64_t{1} << 32;
        gatherer.take(decode_body(decode_header(ByteView(encode(m)).first(header_size)),
                                  ByteView(encode(m)).subspan(header_size)),
                      100);
        return !samples.empty() && samples[0].sample.poses[0].status == PoseStatus::ok;
    };
    Message m = message("TRANSFORM", Transform{}, "LongInstrumentNameToTracker");
    EXPECT_TRUE(ok(m)) << "cut to 20 bytes";
    m.version = 2;
    EXPECT_TRUE(ok(m)) << "whole in the metadata";
    m.device = "LongInstrumentNameToReference";
    EXPECT_FALSE(ok(m)) << "another transform, cut to the same 20 bytes";
    EXPECT_TRUE(says(error_of([] {
                         PoseGatherer({"Stylus", "Stylus"}, options, {}, 100, when);
                     }),
                     {"expected two names"}));
}

/// A gatherer for two tools whose names agree in 20 bytes.
struct AlikeTools {
    std::vector<StreamSample> samples;
    PoseGatherer gatherer{{"DeformationSensorLeft1", "DeformationSensorLeft2"},
                          options,
                          [this](const StreamSample& s) { samples.push_back(s); },
                          100,
                          when};

    /// Sends a tool's pose as it is on the wire.
    void send(const std::string& tool, double x_m, double time_s, std::uint16_t version) {
        Message m = transform_message(tool + "ToTracker", Gathered::at(x_m), when + time_s);
        m.version = version;
        const Bytes bytes = encode(m);
        gatherer.take(decode_body(decode_header(ByteView(bytes).first(header_size)),
                                  ByteView(bytes).subspan(header_size)),
                      100 + time_s);
    }
};

TEST(PoseGatherer, NamesThatAgreeIn20BytesAreToldApartByTheMetadata) {
    AlikeTools g;
    for (const double t : {0.0, 0.1}) {
        g.send("DeformationSensorLeft1", 1, t, 2);
        g.send("DeformationSensorLeft2", 2, t, 2);
    }
    const std::vector<TrackedPose>& poses = g.samples.back().sample.poses;
    EXPECT_EQ(poses[0].translation.x(), 1);
    EXPECT_EQ(poses[1].translation.x(), 2);
    EXPECT_EQ(g.gatherer.ambiguous(), 0u);
}

TEST(PoseGatherer, ACutNameThatMayBeTwoToolsIsRefusedWithTheCause) {
    AlikeTools g;
    g.send("DeformationSensorLeft1", 1, 0, 1);
    g.gatherer.post_due(101);
    for (const StreamSample& s : g.samples)
        for (const TrackedPose& pose : s.sample.poses) EXPECT_FALSE(is_usable(pose));
    EXPECT_EQ(g.gatherer.ambiguous(), 1u);
    EXPECT_TRUE(says(g.gatherer.ambiguity(),
                     {"DeformationSensorLef", "DeformationSensorLeft1, DeformationSensorLeft2",
                      "20 bytes", "version 2"}));
}

TEST(PoseGatherer, TwoToolsUnderOneCutNameAreNotMixed) {
    std::vector<StreamSample> samples;
    PoseGatherer gatherer(
        {"LongInstrumentName"}, options, [&](const auto& s) { samples.push_back(s); }, 100, when);
    for (int i = 0; i < 5; ++i)  // LongInstrumentNameToTracker and ...ToReference
        for (const double x : {1.0, 2.0})
            gatherer.take(
                transform_message("LongInstrumentNameTo", Gathered::at(x), when + 0.1 * i),
                100 + 0.1 * i);
    gatherer.post_due(100.5);
    ASSERT_GT(samples.size(), 0u);
    EXPECT_FALSE(is_usable(samples.back().sample.poses[0]));
    EXPECT_GE(gatherer.ambiguous(), 8u);
    EXPECT_TRUE(says(gatherer.ambiguity(), {"LongInstrumentNameTo", "several tools"}));

    TrackingData both;  // and in one list
    for (const float x : {1.F, 2.F})
        both.tools.push_back({"DeformationSensorLef", 2, {1, 0, 0, 0, 1, 0, 0, 0, 1, x, 0, 0}});
    PoseGatherer of_list(
        {"DeformationSensorLeft1"}, options, [&](const auto& s) { samples.push_back(s); }, 100,
        when);
    of_list.take(message("TDATA", both), 100);
    EXPECT_EQ(of_list.ambiguous(), 2u);
}

TEST(PoseGatherer, ANameInMetadataThatIsNoneGivesWayToTheHeaders) {
    Gathered g;
    for (const std::string& name :
         {std::string("Stylus\x1b[2J"), std::string("a\nb"), std::string(100000, 'x')})
        g.gatherer.take(with_metadata(message("TRANSFORM", Transform{}, "ProbeToTracker"),
                                      {{"IGTL_DEVICE_NAME", name}}),
                        100);
    EXPECT_EQ(g.gatherer.names(), (std::map<std::string, std::uint64_t>{{"ProbeToTracker", 3}}));
}

TEST(PoseGatherer, TimeNeverGoesBackwards) {
    std::vector<StreamSample> samples;
    PoseGatherer gatherer(
        {"Stylus"}, options, [&](const auto& s) { samples.push_back(s); }, 100, when);
    const auto time_of = [&](double sent_s, double now_s) {
        gatherer.take(transform_message("Stylus", Gathered::at(1), sent_s), now_s);
        return samples.back().sample.time_s;
    };
    EXPECT_NEAR(time_of(when, 100), when, 1e-6);
    EXPECT_NEAR(time_of(when + 0.1, 100.1), when + 0.1, 1e-6);
    EXPECT_NEAR(time_of(when + 0.05, 100.15), when + 0.1, 1e-6) << "out of order";
    EXPECT_NEAR(time_of(500, 100.25), when + 0.2, 1e-6) << "the sender's clock was set back";
    EXPECT_NEAR(time_of(500.5, 100.75), when + 0.7, 1e-6);
    EXPECT_NEAR(time_of(0, 101), when + 0.95, 1e-6) << "no time stamp";
    gatherer.post_due(103);
    EXPECT_NEAR(samples.back().sample.time_s, when + 2.95, 1e-6);
    EXPECT_EQ(samples.back().sample.poses[0].status, PoseStatus::stale);
    EXPECT_NEAR(time_of(when + 1e6, 103.1), when + 3.05, 1e-6)
        << "the sender's clock was set forward";
    EXPECT_NEAR(time_of(when + 1e6 + 0.1, 103.2), when + 3.15, 1e-6);
}

TEST(PoseGatherer, WhatIsPostedBeforeAnythingComesIsDatedByTheWallClockAndTimeGoesOnFromThere) {
    for (const double ahead_s : {0.01, 5000.0, -5000.0}) {  // the sender's clock
        Gathered g;
        g.wait_until(101);
        ASSERT_GT(g.samples.size(), 5u);
        EXPECT_NEAR(g.samples[0].sample.time_s, when + 0.25, 0.01);
        EXPECT_NEAR(g.samples.back().sample.time_s, when + 1, 0.06);
        g.transform("StylusToTracker", 1, when + 1 + ahead_s, 101);
        EXPECT_NEAR(g.samples.back().sample.time_s, when + 1, 0.011) << ahead_s;
        g.transform("StylusToTracker", 1, when + 1.1 + ahead_s, 101.1);
        EXPECT_NEAR(g.samples.back().sample.time_s, when + 1.1, 0.011) << ahead_s;
    }
}

TEST(PoseGatherer, WhileNoToolOfItsOwnComesItSaysSoLittleByLittleWhateverElseComes) {
    Gathered g;
    g.transform("StylusToTracker", 1, when, 100);
    g.transform("ReferenceToTracker", 2, when, 100);
    g.samples.clear();
    const std::uint64_t came = g.gatherer.samples();
    for (double now_s = 100.02; now_s < 130; now_s += 0.02) {
        g.transform("ProbeToTracker", 1, when + now_s - 100, now_s);
        g.gatherer.take(message("STATUS", Status{1, 0, "", ""}), now_s);
        g.wait_until(now_s);
    }
    ASSERT_GT(g.samples.size(), 60u);
    EXPECT_NEAR(g.samples[0].sample.time_s, when + options.stale_after_s, 0.011)
        << "as soon as it is stale";
    for (std::size_t k = 0; k < g.samples.size(); ++k) {
        EXPECT_EQ(g.samples[k].sample.poses[0].status, PoseStatus::stale);
        EXPECT_EQ(g.samples[k].sample.poses[1].status, PoseStatus::stale);
        if (k == 0) continue;
        const double quiet_s = g.samples[k].arrived_s - 100;
        EXPECT_LT(g.samples[k].arrived_s - g.samples[k - 1].arrived_s,
                  std::min(0.07 + 0.05 * quiet_s, 0.52))
            << quiet_s;
    }
    EXPECT_LT(g.samples.size(), 130u) << "rarely in the end";
    EXPECT_EQ(g.gatherer.samples(), came) << "nothing came";
    g.transform("StylusToTracker", 5, when + 30, 130);
    EXPECT_EQ(g.samples.back().sample.poses[0].translation.x(), 5);
}

/// A server that hangs may send its last poses for ever: they are no new samples.
TEST(PoseGatherer, APoseSentAgainWithItsTimeStampIsNoNewSample) {
    Gathered g;
    const auto send = [&](double now_s, double x_m, double sent_s) {
        g.transform("StylusToTracker", x_m, sent_s, now_s);
        g.transform("ReferenceToTracker", x_m, sent_s, now_s);
        g.wait_until(now_s + 0.01);
    };
    send(100.02, 1, when);
    const std::uint64_t samples = g.gatherer.samples();
    for (int i = 2; i <= 100; ++i) send(100 + 0.02 * i, i, when);
    EXPECT_EQ(g.gatherer.samples(), samples);
    for (const TrackedPose& pose : g.samples.back().sample.poses)
        EXPECT_EQ(pose.status, PoseStatus::stale);
    send(102.1, 7, when + 2);
    EXPECT_EQ(g.x(g.samples.size() - 1, 0), 7) << "it goes on with a new time stamp";
}

TEST(PoseGatherer, ATimeStampOf0IsNone) {
    Gathered g;
    for (int i = 1; i <= 100; ++i) {
        igtl::Message m = transform_message("StylusToTracker", Gathered::at(i), when);
        m.time_stamp = 0;
        g.gatherer.take(m, 100 + 0.02 * i);
        g.wait_until(100.01 + 0.02 * i);
    }
    EXPECT_EQ(g.samples.back().sample.poses[0].translation.x(), 100);
    EXPECT_EQ(g.samples.back().sample.poses[0].status, PoseStatus::ok);
    EXPECT_NEAR(g.samples.back().sample.time_s, when + 2, 0.05) << "dated by the arrivals";
}

TEST(PoseGatherer, AToolWhoseTimeStampStandsWhileOthersGoOnIsStale) {
    Gathered g;
    for (int i = 0; i < 50; ++i) {
        const double now_s = 100 + 0.02 * i;
        g.transform("StylusToTracker", 1, when, now_s);
        g.transform("ReferenceToTracker", 2, when + 0.02 * i, now_s);
    }
    EXPECT_EQ(g.samples.back().sample.poses[0].status, PoseStatus::stale);
    EXPECT_EQ(g.samples.back().sample.poses[1].status, PoseStatus::ok);
    g.transform("StylusToTracker", 3, when + 1, 101);
    g.transform("ReferenceToTracker", 2, when + 1, 101);
    EXPECT_EQ(g.x(g.samples.size() - 1, 0), 3);
}

}  // namespace
}  // namespace livetet::igtl
