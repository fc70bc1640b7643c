#include "base/sliced_task.hpp"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace livetet {
namespace {

/// Counts to ten, with a pause point after each number.
void count_to_ten(int& count) {
    while (count < 10) {
        ++count;
        pause_point();
    }
}

TEST(SlicedTask, GoesOnWhereItPaused) {
    int count = 0;
    SlicedTask task([&] { count_to_ten(count); });
    EXPECT_EQ(count, 0) << "it waits to be asked";
    EXPECT_FALSE(task.work([] { return true; }));
    EXPECT_EQ(count, 1);
    EXPECT_FALSE(task.work([&] { return count >= 7; }));
    EXPECT_EQ(count, 7);
    EXPECT_FALSE(task.is_done());
    EXPECT_TRUE(task.work([] { return false; }));
    EXPECT_EQ(count, 10);
    EXPECT_TRUE(task.is_done());
    EXPECT_TRUE(task.work([] { return true; })) << "there is nothing left";
    task.finish();
}

TEST(SlicedTask, FinishesWithoutAPause) {
    for (const int slices : {0, 1}) {
        int count = 0;
        SlicedTask task([&] { count_to_ten(count); });
        for (int k = 0; k < slices; ++k) task.work([] { return true; });
        task.finish();
        EXPECT_EQ(count, 10);
        EXPECT_TRUE(task.is_done());
    }
}

TEST(SlicedTask, IsFinishedWhenItIsDropped) {
    int count = 0;
    {
        SlicedTask task([&] { count_to_ten(count); });
        task.work([] { return true; });
    }
    EXPECT_EQ(count, 10) << "what it has begun it does not leave";
    count = 0;
    {
        const SlicedTask task([&] { count_to_ten(count); });
    }
    EXPECT_EQ(count, 0) << "what it has not begun it leaves";
}

TEST(SlicedTask, FinishThrowsWhatTheWorkThrew) {
    for (const int slices : {0, 1, 2}) {
        SlicedTask task([] {
            pause_point();
            throw std::runtime_error("it broke");
        });
        for (int k = 0; k < slices; ++k) task.work([] { return true; });
        EXPECT_THROW(task.finish(), std::runtime_error);
        EXPECT_TRUE(task.is_done());
    }
    SlicedTask dropped([] {
        pause_point();
        throw std::runtime_error("nobody asks");
    });
    dropped.work([] { return true; });
}

TEST(SlicedTask, APausePointOutsideATaskDoesNothing) {
    int count = 0;
    SlicedTask task([&] { count_to_ten(count); });
    task.work([] { return true; });
    pause_point();  // while the task waits
    EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace livetet
