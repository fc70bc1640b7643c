#pragma once

#include <chrono>
#include <utility>

namespace livetet {

/// What has passed on the clock that never goes back.
inline double seconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The same clock, lap by lap.
class Stopwatch {
  public:
    /// Seconds since the last lap, or since it was made.
    double lap() {
        const auto before = std::exchange(last_, std::chrono::steady_clock::now());
        return std::chrono::duration<double>(last_ - before).count();
    }

  private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace livetet
