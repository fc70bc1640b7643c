#include "tracking/source.hpp"

#include <chrono>

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
        if (mailbox_.take()) return mailbox_.incoming().end ? nullptr : &mailbox_.incoming().sample;
        mailbox_.wait_beyond(seen);
    }
}

const StreamSample* TrackerSource::take() {
    return mailbox_.take() && !mailbox_.incoming().end ? &mailbox_.incoming().sample : nullptr;
}

void TrackerSource::post(StreamSample sample) {
    sample.number = ++posted_;
    if (listener_) listener_(sample);
    mailbox_.outgoing() = {std::move(sample), false};
    mailbox_.post();
}

void TrackerSource::post_end() {
    mailbox_.outgoing().end = true;
    mailbox_.post();
}

}  // namespace livetet
