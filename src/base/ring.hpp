#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace livetet {

/// Lock-free queue of fixed capacity from one writer thread to one reader thread. Neither waits,
/// except in `wait`. Slots and their storage are reused.
template <class T>
class Ring {
  public:
    explicit Ring(std::size_t capacity) : slots_(capacity) {}

    /// Writer: the next free slot, or nullptr if the queue is full. Fill it, then call `push`.
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

    /// Reader: the oldest value, or nullptr if the queue is empty. `pop` releases its slot.
    const T* oldest() const {
        return popped_.load(std::memory_order_relaxed) < pushed_.load(std::memory_order_acquire)
                   ? &slots_[popped_.load(std::memory_order_relaxed) % slots_.size()]
                   : nullptr;
    }
    void pop() { popped_.fetch_add(1, std::memory_order_release); }
    /// Reader: sleeps until a value is available.
    void wait() const {
        pushed_.wait(popped_.load(std::memory_order_relaxed), std::memory_order_acquire);
    }

  private:
    std::vector<T> slots_;
    std::atomic<std::uint64_t> pushed_{0}, popped_{0};
};

}  // namespace livetet
