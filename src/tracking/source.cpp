#include "tracking/source.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace livetet {

double steady_seconds() {
    return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch())
        .count();
}

double utc_seconds() {
    return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch())
        .count();
}

const StreamSample* TrackerSource::next() {
    for (;;) {
        const auto seen =
            mailbox_.posted();  // read before `take`, so that a value posted after it ends the wait
        if (take_newest()) return mailbox_.incoming().end ? nullptr : &mailbox_.incoming().sample;
        mailbox_.wait_beyond(seen);
    }
}

const StreamSample* TrackerSource::take() {
    return take_newest() && !mailbox_.incoming().end ? &mailbox_.incoming().sample : nullptr;
}

bool TrackerSource::take_newest() {
    if (!mailbox_.take()) return false;
    taken_before_ = std::exchange(taken_, mailbox_.incoming().sample.number);
    return true;
}

std::span<const TrackerSample> TrackerSource::passed() const {
    const std::span<const TrackerSample> passed = mailbox_.incoming().passed;
    const std::uint64_t skipped = taken_ - std::min(taken_, taken_before_ + 1);
    return passed.last(std::min<std::uint64_t>(passed.size(), skipped));
}

void TrackerSource::post(StreamSample sample) {
    sample.number = ++posted_;
    if (listener_) listener_(sample);
    // The consumer may take the last sample meanwhile; `passed` leaves out what it has taken.
    if (!mailbox_.has_new())
        passed_.clear();
    else
        passed_.push_back(std::move(newest_));
    if (passed_.size() > max_passed) passed_.erase(passed_.begin());
    newest_ = sample.sample;
    mailbox_.outgoing() = {std::move(sample), passed_, false};
    mailbox_.post();
}

void TrackerSource::post_end() {
    mailbox_.outgoing().end = true;
    mailbox_.post();
}

}  // namespace livetet
