#include "apps/bench/core_watch.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "base/stopwatch.hpp"
#include "support/program.hpp"

namespace livetet {
namespace {

using test::Folder;
using test::write_text;

TEST(CoreWatch, StealIsTheEighthNumberOfTheFirstLine) {
    EXPECT_EQ(steal_of("cpu  100 2 30 4000 5 6 7 250 9 10\ncpu0 1 1 1 1 1 1 1 1\n", 100), 2.5);
    EXPECT_EQ(steal_of("cpu 1 2 3 4 5 6 7 0\n", 100), 0.0);
    EXPECT_FALSE(steal_of("cpu  1 2 3 4 5 6 7\n", 100)) << "a kernel that does not tell";
    EXPECT_FALSE(steal_of("", 100));
    EXPECT_FALSE(steal_of("intr 1 2 3 4 5 6 7 8 9\n", 100));
    EXPECT_FALSE(steal_of("cpu  1 2 3 4 5 6 7 x\n", 100));
}

TEST(CoreWatch, MeasuresTheCpuTimeAndTheSwitchesOfItsThread) {
    CoreWatch watch;
    watch.start();
    const auto start = std::chrono::steady_clock::now();
    volatile double sum = 0;
    while (seconds_since(start) < 0.05) sum = sum + 1;
    const double busy_s = seconds_since(start);
    const CoreUse busy = watch.stop();
    EXPECT_GT(busy.cpu_s, 0);
    EXPECT_LT(busy.cpu_s, busy_s + 0.01);
    watch.start();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const CoreUse asleep = watch.stop();
    EXPECT_GE(asleep.blocked, 1);
    EXPECT_LT(asleep.cpu_s, 0.015);
}

TEST(CoreWatch, StealThatAMachineDoesNotTellIsNotTold) {
    const Folder folder;
    CoreWatch none(folder / "nothing");
    none.start();
    EXPECT_FALSE(none.stop().steal);
    write_text(folder / "stat", "cpu  1 2 3 4 5 6 7 100\n");
    CoreWatch watch(folder / "stat");
    watch.start();
    write_text(folder / "stat", "cpu  1 2 3 4 5 6 7 103\n");
    const CoreUse use = watch.stop();
    ASSERT_TRUE(use.steal);
    EXPECT_GT(*use.steal, 0);
    EXPECT_FALSE(use.had_cores());
}

TEST(FrameTimes, FramesThatLostACoreCountInAllButNotAmongTheOthers) {
    std::vector<FrameSample> frames(1000, {0.004, {.cpu_s = 0.003, .steal = 0.0}});
    for (int k = 0; k < 50; ++k) frames[20 * k].seconds = 0.012;
    for (int k = 0; k < 30; ++k) frames[20 * k].cores.switched = 2;
    for (int k = 30; k < 40; ++k) frames[20 * k].cores.others_switched = 1;
    for (int k = 40; k < 50; ++k) frames[20 * k].cores.steal = 0.01;
    const FrameTimes times = frame_times(frames);
    EXPECT_EQ(times.all.count, 1000u);
    EXPECT_NEAR(times.all.p99, 0.012, 1e-12);
    EXPECT_EQ(times.with_cores.count, 950u);
    EXPECT_NEAR(times.with_cores.p99, 0.004, 1e-12);
    EXPECT_NEAR(times.cpu_s, 0.003, 1e-9);
    EXPECT_EQ(times.switched, 60);
    EXPECT_EQ(times.others_switched, 10);
    ASSERT_TRUE(times.steal_s);
    EXPECT_NEAR(*times.steal_s, 0.1, 1e-9);
    EXPECT_TRUE(times.can_judge_with_cores());
    EXPECT_NE(core_use_text(times).find("950 of 1000"), std::string::npos);
    EXPECT_EQ(p99_with_cores_text(times), "4.00");
}

TEST(FrameTimes, AFewFramesWithTheirCoresJudgeNothing) {
    std::vector<FrameSample> frames(2000);
    for (FrameSample& f : frames) f.cores.switched = 1;
    for (int k = 0; k < 150; ++k) frames[k].cores.switched = 0;
    EXPECT_FALSE(frame_times(frames).can_judge_with_cores()) << "less than a tenth";
    frames.resize(160);
    EXPECT_TRUE(frame_times(frames).can_judge_with_cores());
    frames.resize(90);
    EXPECT_FALSE(frame_times(frames).can_judge_with_cores()) << "less than a hundred";
    frames.resize(2);
    frames[0].cores.switched = frames[1].cores.switched = 1;
    EXPECT_EQ(p99_with_cores_text(frame_times(frames)), "none");
    EXPECT_NE(core_use_text(frame_times(frames)).find("steal not told"), std::string::npos);
}

}  // namespace
}  // namespace livetet
