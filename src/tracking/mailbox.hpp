#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace livetet {

/// Passes the newest value from one writer thread to one reader thread; older values are
/// overwritten. Neither thread waits. Three slots: one being written, one being read, and one in
/// between that either side swaps with its own by an atomic exchange.
template <class T>
class Mailbox {
  public:
    /// Writer: fill `outgoing`, then call `post`.
    T& outgoing() { return slots_[writing_]; }
    void post() {
        writing_ = middle_.exchange(writing_ | fresh, std::memory_order_acq_rel) & ~fresh;
        posted_.fetch_add(1, std::memory_order_release);
        posted_.notify_one();
    }

    /// Reader: makes the newest value available as `incoming`, valid until the next `take`. Returns
    /// false if nothing was posted since the last `take`.
    bool take() {
        if (!has_new()) return false;
        reading_ = middle_.exchange(reading_, std::memory_order_acq_rel) & ~fresh;
        return true;
    }
    /// Reader: whether something was posted since the last `take`.
    bool has_new() const { return middle_.load(std::memory_order_relaxed) & fresh; }
    const T& incoming() const { return slots_[reading_]; }

    /// Number of values posted so far. `wait_beyond(n)` sleeps until it exceeds n.
    std::uint64_t posted() const { return posted_.load(std::memory_order_acquire); }
    void wait_beyond(std::uint64_t count) const { posted_.wait(count, std::memory_order_acquire); }

  private:
    static constexpr std::uint8_t fresh = 4;
    std::array<T, 3> slots_{};
    std::uint8_t writing_ = 0, reading_ = 1;
    std::atomic<std::uint8_t> middle_{2};
    std::atomic<std::uint64_t> posted_{0};
};

}  // namespace livetet
