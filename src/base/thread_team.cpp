#include "base/thread_team.hpp"

#include <algorithm>
#include <chrono>

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace livetet {

namespace {

void pause() {
#if defined(__x86_64__)
    _mm_pause();
#endif
}

/// One step of a spin wait, number k: a pause instruction, and after 0.1 ms a yield. An earlier
/// yield loses the core to unrelated threads; a later one lets two members wait for each other when
/// another program has a core. Both cost several milliseconds a frame.
void spin(int k) {
    if (k < 2000)
        pause();
    else
        std::this_thread::yield();
}

}  // namespace

ThreadTeam::ThreadTeam(int threads) {
    threads = std::min(threads, static_cast<int>(max_tasks));
    for (int t = 1; t < threads; ++t) workers_.emplace_back([this, t] { serve(t); });
}

ThreadTeam::~ThreadTeam() {
    if (workers_.empty()) return;
    start(Call{nullptr}, nullptr);
    for (std::thread& worker : workers_) worker.join();
}

void ThreadTeam::start(Call call, void* work) {
    call_ = call;
    work_ = work;
    const std::uint32_t round = round_.load(std::memory_order_relaxed) + 1;
    state_.store(std::uint64_t{round} << 32 | is_open, std::memory_order_release);
    // Sequentially consistent, like a worker's last check before it sleeps: at least one of the two
    // sees the other's store.
    round_.fetch_add(1, std::memory_order_seq_cst);
    // Workers that are awake, but not yet on a core, are not woken once more.
    if (naps_.load(std::memory_order_seq_cst) & 1) {
        naps_.fetch_add(1, std::memory_order_seq_cst);
        naps_.notify_all();
    }
}

void ThreadTeam::finish(std::size_t workers) {
    for (int k = 0; joined(state_.load(std::memory_order_relaxed)) < workers; ++k) spin(k);
    state_.fetch_and(~is_open, std::memory_order_acq_rel);
    for (int k = 0; at_work(state_.load(std::memory_order_acquire)) != 0; ++k) spin(k);
}

/// Whether a worker is in time for a round. What the round's work is may be read from then on:
/// nothing changes it while a worker is at work.
bool ThreadTeam::join(std::uint32_t round) {
    std::uint64_t state = state_.load(std::memory_order_relaxed);
    while (state >> 32 == round && state & is_open)
        if (state_.compare_exchange_weak(state, state + one_joined + one_at_work,
                                         std::memory_order_acquire, std::memory_order_relaxed))
            return true;
    return false;
}

void ThreadTeam::serve(int thread) {
    using Clock = std::chrono::steady_clock;
    for (std::uint32_t seen = 0;;) {
        Clock::time_point since{};
        for (int k = 1; round_.load(std::memory_order_acquire) == seen; ++k) {
            spin(k);
            if (k % 256) continue;
            const auto now = Clock::now();
            if (since == Clock::time_point{}) since = now;
            if (now - since < std::chrono::milliseconds(2)) continue;
            // Each waking gives naps_ a value that it never had. A worker that slept on round_
            // would sleep on when it is woken for a round that it has done. One that slept on a
            // mere flag would when another sleeps again before this one has looked. No later call
            // would wake them.
            const std::uint32_t nap = naps_.fetch_or(1, std::memory_order_seq_cst) | 1;
            if (round_.load(std::memory_order_seq_cst) == seen)
                naps_.wait(nap, std::memory_order_seq_cst);
        }
        seen = round_.load(std::memory_order_acquire);
        if (!join(seen)) continue;
        if (!call_) return;
        call_(work_, thread);
        state_.fetch_sub(one_at_work, std::memory_order_release);
    }
}

}  // namespace livetet
