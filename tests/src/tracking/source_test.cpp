// Samples that a late consumer skips.

#include "tracking/source.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace livetet {
namespace {

/// Sample number k is of the time k.
class NumberedSource : public TrackerSource {
  public:
    void send(int count) {
        for (int k = 0; k < count; ++k) post({.sample = {double(posted_ + 1), {}}, .times = {}});
    }
    SourceStatus status() const override { return {}; }
    std::size_t index_of(const std::string& /*tool*/) override { return 0; }
    std::vector<std::string> tools() const override { return {}; }
};

std::vector<double> passed_times(const TrackerSource& source) {
    std::vector<double> times;
    for (const TrackerSample& sample : source.passed()) times.push_back(sample.time_s);
    return times;
}

TEST(TrackerSource, HandsOverWhatWasSkipped) {
    NumberedSource source;
    EXPECT_TRUE(source.passed().empty()) << "nothing was taken";
    source.send(3);
    EXPECT_EQ(source.next()->number, 3U);
    EXPECT_EQ(passed_times(source), (std::vector<double>{1, 2}));
    source.send(1);
    EXPECT_EQ(source.next()->number, 4U);
    EXPECT_TRUE(source.passed().empty());
    source.send(4);
    EXPECT_EQ(source.take()->number, 8U);
    EXPECT_EQ(passed_times(source), (std::vector<double>{5, 6, 7}));
    EXPECT_EQ(source.take(), nullptr);
}

TEST(TrackerSource, HandsOverTheNewestOfMany) {
    NumberedSource source;
    source.send(1);
    (void)source.next();
    source.send(200);
    EXPECT_EQ(source.next()->number, 201U);
    const auto times = passed_times(source);
    ASSERT_EQ(times.size(), max_passed);
    EXPECT_EQ(times.back(), 200);
    EXPECT_EQ(times.front(), 201 - double(max_passed));
}

/// A sample is handed over or skipped, never both, whenever the consumer takes one.
TEST(TrackerSource, HandsOverEachSampleOnceBesideItsThread) {
    constexpr int count = 20000;
    NumberedSource source;
    std::jthread sender([&] { source.send(count); });
    double last = 0;
    while (last < count) {
        const StreamSample* sample = source.next();
        for (const double time : passed_times(source)) {
            EXPECT_GT(time, last);
            last = time;
        }
        EXPECT_GT(sample->sample.time_s, last);
        last = sample->sample.time_s;
    }
}

}  // namespace
}  // namespace livetet
