#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace livetet {

/// A queue of fixed size from one thread to another that neither waits in. The values' own storage
/// is used again.
template <class T>
class Ring {
  public:
    explicit Ring(std::size_t capacity) : slots_(capacity) {}

    /// The writer's next slot, or nullptr where the reader is a whole ring behind; fill it, then
    /// `push`.
    T* free_slot() {
        return pushed_.load(std::memory_order_relaxed) - popped_.load(std::memory_order_acquire) <
                       slots_.size()
                   ? &slots_[pushed_.load(std::memory_order_relaxed) % slots_.size()]
                   : nullptr;
    }
    void push() {
        pushed_.fetch_add(1, std::memory_order_release);
        pushed_.notify_one();
    }

    /// The reader's oldest value, or nullptr; `pop` gives its slot back.
    const T* oldest() const {
        return popped_.load(std::memory_order_relaxed) < pushed_.load(std::memory_order_acquire)
                   ? &slots_[popped_.load(std::memory_order_relaxed) % slots_.size()]
                   : nullptr;
    }
    void pop() { popped_.fetch_add(1, std::memory_order_release); }
    /// The reader sleeps until something was pushed.
    void wait() const {
        pushed_.wait(popped_.load(std::memory_order_relaxed), std::memory_order_acquire);
    }

  private:
    std::vector<T> slots_;
    std::atomic<std::uint64_t> pushed_{0}, popped_{0};
};

}  // namespace livetet
