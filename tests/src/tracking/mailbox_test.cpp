#include "tracking/mailbox.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace livetet {
namespace {

TEST(Mailbox, HasNothingUntilSomethingIsPostedAndThenTheNewestOnce) {
    Mailbox<int> mailbox;
    EXPECT_FALSE(mailbox.has_new());
    EXPECT_FALSE(mailbox.take());
    for (const int value : {1, 2, 3}) {
        mailbox.outgoing() = value;
        mailbox.post();
    }
    EXPECT_EQ(mailbox.posted(), 3U);
    EXPECT_TRUE(mailbox.has_new());
    ASSERT_TRUE(mailbox.take());
    EXPECT_EQ(mailbox.incoming(), 3);
    EXPECT_FALSE(mailbox.take());
    EXPECT_EQ(mailbox.incoming(), 3);
}

TEST(Mailbox, WhatWasTakenStaysWhileOthersArePosted) {
    Mailbox<int> mailbox;
    mailbox.outgoing() = 1;
    mailbox.post();
    ASSERT_TRUE(mailbox.take());
    for (int value = 2; value < 10; ++value) {
        mailbox.outgoing() = value;
        EXPECT_EQ(mailbox.incoming(), 1);
        mailbox.post();
        EXPECT_EQ(mailbox.incoming(), 1);
    }
    ASSERT_TRUE(mailbox.take());
    EXPECT_EQ(mailbox.incoming(), 9);
}

/// Values only become newer, none is torn, and the last one arrives.
TEST(Mailbox, PassesWholeValuesInOrderBetweenTwoThreads) {
    using Value = std::array<std::uint64_t, 16>;
    constexpr std::uint64_t count = 100000;
    Mailbox<Value> mailbox;
    std::thread writer([&] {
        for (std::uint64_t k = 1; k <= count; ++k) {
            mailbox.outgoing().fill(k);
            mailbox.post();
        }
    });
    std::uint64_t last = 0, seen = 0, torn = 0, older = 0;
    while (last < count) {
        mailbox.wait_beyond(seen);
        seen = mailbox.posted();
        if (!mailbox.take()) continue;
        const Value& value = mailbox.incoming();
        for (const std::uint64_t part : value) torn += part != value[0];
        older += value[0] <= last;
        last = value[0];
    }
    writer.join();
    EXPECT_EQ(torn, 0U);
    EXPECT_EQ(older, 0U);
    EXPECT_FALSE(mailbox.take());
}

}  // namespace
}  // namespace livetet
