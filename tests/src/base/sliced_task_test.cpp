#include "base/sliced_task.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <stdexcept>

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

TEST(SlicedTask, IsLeftWhereItPausedWhenItIsDropped) {
    int count = 0;
    const auto held = std::make_shared<int>();
    {
        SlicedTask task([&] {
            const std::shared_ptr<int> also = held;
            count_to_ten(count);
        });
        task.work([&] { return count == 3; });
        EXPECT_EQ(held.use_count(), 2);
    }
    EXPECT_EQ(count, 3);
    EXPECT_EQ(held.use_count(), 1) << "what it held is given back";
    {
        const SlicedTask task([&] { count = 0; });
    }
    EXPECT_EQ(count, 3) << "it had not begun";
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
