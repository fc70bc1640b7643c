#pragma once

#include <atomic>
#include <memory>

namespace livetet {

/// Tells a loop whether it should end. Copies share the flag of their StopSource; a token without a
/// source never asks to stop. May be read from any thread.
class StopToken {
  public:
    StopToken() = default;
    bool stop_requested() const noexcept { return flag_ && flag_->load(); }

  private:
    friend class StopSource;
    explicit StopToken(std::shared_ptr<const std::atomic<bool>> flag) : flag_(std::move(flag)) {}

    std::shared_ptr<const std::atomic<bool>> flag_;
};

/// Asks the loops that hold its tokens to end. Copies share one flag. Unlike std::stop_source,
/// whose request_stop may wait for a lock, this one may be asked by a signal handler.
class StopSource {
  public:
    /// Returns whether a stop had been requested before. Safe in a signal handler.
    bool request_stop() const noexcept { return flag_->exchange(true); }
    StopToken token() const { return StopToken(flag_); }

  private:
    static_assert(std::atomic<bool>::is_always_lock_free);
    std::shared_ptr<std::atomic<bool>> flag_ = std::make_shared<std::atomic<bool>>(false);
};

}  // namespace livetet
