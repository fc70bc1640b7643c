#include "base/ring.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace livetet {
namespace {

TEST(Ring, IsFullAtItsCapacityAndHandsOutTheOldestFirst) {
    Ring<int> ring(3);
    EXPECT_EQ(ring.oldest(), nullptr);
    int next = 0, expected = 0;
    for (int round = 0; round < 5; ++round) {  // past the end of the slots and around
        while (int* slot = ring.free_slot()) {
            *slot = next++;
            ring.push();
        }
        EXPECT_EQ(next - expected, 3);
        for (int k = 0; k < 2; ++k) {
            ASSERT_NE(ring.oldest(), nullptr);
            EXPECT_EQ(*ring.oldest(), expected++);
            ring.pop();
        }
    }
}

TEST(Ring, ReusesTheStorageOfItsSlots) {
    Ring<std::vector<int>> ring(1);
    ring.free_slot()->assign(100, 1);
    const int* storage = ring.free_slot()->data();
    ring.push();
    EXPECT_EQ(ring.free_slot(), nullptr);
    ring.pop();
    EXPECT_EQ(ring.free_slot()->data(), storage);
}

/// Each value is of two parts that belong together: a slot that is read while it is written would
/// show parts of two values.
TEST(Ring, LosesNothingBetweenTwoThreads) {
    struct Pair {
        std::uint64_t value, twice;
    };
    constexpr std::uint64_t count = 100000;
    Ring<Pair> ring(8);
    std::thread writer([&] {
        for (std::uint64_t k = 0; k < count;) {
            Pair* slot = ring.free_slot();
            if (!slot) {
                std::this_thread::yield();
                continue;
            }
            *slot = {k, 2 * k};
            ring.push();
            ++k;
        }
    });
    std::uint64_t wrong = 0;
    for (std::uint64_t k = 0; k < count; ++k) {
        ring.wait();
        const Pair* pair = ring.oldest();
        if (!pair || pair->value != k || pair->twice != 2 * k) ++wrong;
        ring.pop();
    }
    writer.join();
    EXPECT_EQ(wrong, 0U);
    EXPECT_EQ(ring.oldest(), nullptr);
}

}  // namespace
}  // namespace livetet
