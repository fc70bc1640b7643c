#include "tracking/playback.hpp"

#include <gtest/gtest.h>

#include "base/error.hpp"

namespace livetet {
namespace {

/// Samples at intervals of 10 ms; in sample number i the tool is at x = i m.
Recording ten_samples() {
    Recording recording{{"Stylus"}, {}};
    for (int i = 0; i < 10; ++i) {
        TrackedPose pose;
        pose.translation.x() = i;
        pose.status = PoseStatus::ok;
        recording.samples.push_back({5 + 0.01 * i, {pose}});
    }
    return recording;
}

TEST(Playback, FrameByFrameNoneIsMissed) {
    std::vector<std::uint64_t> heard;
    Playback playback(ten_samples(),
                      {.speed = std::nullopt,
                       .listener = [&](const StreamSample& s) { heard.push_back(s.number); }});
    for (std::uint64_t i = 1; i <= 10; ++i) {
        const StreamSample* sample = playback.next();
        ASSERT_TRUE(sample);
        EXPECT_EQ(sample->number, i);
        EXPECT_EQ(sample->sample.poses[0].translation.x(), static_cast<double>(i - 1));
        EXPECT_GT(sample->times[0].arrived_s, 0);
    }
    EXPECT_EQ(playback.next(), nullptr);
    EXPECT_EQ(playback.next(), nullptr) << "the end lasts";
    EXPECT_EQ(heard.size(), 10u);
    EXPECT_EQ(playback.status().samples, 10u);
    EXPECT_EQ(playback.status().state, "at its end");
}

TEST(Playback, AtAPaceTheNewestIsTakenAndAllAreHeardInOrder) {
    std::vector<std::uint64_t> heard;
    std::vector<double> came;
    const double began =
        steady_seconds();  // a delay of the first sample does not make later ones early
    {
        Playback playback(ten_samples(), {.speed = 2, .listener = [&](const StreamSample& s) {
                                              heard.push_back(s.number);
                                              came.push_back(s.arrived_s);
                                          }});
        std::uint64_t last = 0;
        while (const StreamSample* sample = playback.next()) {
            EXPECT_GT(sample->number, last);
            last = sample->number;
        }
        EXPECT_EQ(last, 10u);
    }
    ASSERT_EQ(heard.size(), 10u);
    for (std::uint64_t i = 0; i < 10; ++i) EXPECT_EQ(heard[i], i + 1);
    EXPECT_GE(came.back() - began, 0.044) << "twice its pace, not more";
}

TEST(Playback, ADelayedSampleComesLaterAndNoneOvertakes) {
    std::vector<double> delays(10, 0.0);
    delays[3] = 0.05;
    std::vector<double> came;
    const double began = steady_seconds();
    {
        Playback playback(ten_samples(),
                          {.delays_s = delays, .listener = [&](const StreamSample& s) {
                               came.push_back(s.arrived_s);
                           }});
        while (playback.next()) {
        }
    }
    ASSERT_EQ(came.size(), 10u);
    EXPECT_GE(came[3] - began, 0.079);
    for (std::size_t i = 4; i < 8; ++i) EXPECT_GE(came[i], came[3]);
}

TEST(Playback, EndsAtOnceAndRefusesWhatMakesNoSense) {
    Recording slow = ten_samples();
    slow.samples.back().time_s = 1e6;
    {
        Playback playback(slow);
        (void)playback.next();
    }
    EXPECT_THROW(Playback(Recording{{"Stylus"}, {}}), Error);
    EXPECT_THROW(Playback(ten_samples(), {.speed = -1}), Error);
    EXPECT_THROW(Playback(ten_samples(), {.delays_s = {0.1}}), Error);
    Playback playback(ten_samples());
    EXPECT_EQ(playback.index_of("Stylus"), 0u);
    EXPECT_THROW((void)playback.index_of("Probe"), Error);
}

}  // namespace
}  // namespace livetet
