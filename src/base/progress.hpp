#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <string_view>

namespace livetet {

/// Where a long computation says how far it is: a fraction in [0, 1] and a few words. Empty means
/// nobody listens.
using ProgressCallback = std::function<void(double fraction, std::string_view what)>;

/// A line on a terminal's stderr that is rewritten at most ten times a second; where stderr is not
/// a terminal, a line every ten per cent. Ends its line when destroyed.
class ProgressLine {
  public:
    explicit ProgressLine(std::string title);
    ~ProgressLine();
    ProgressLine(const ProgressLine&) = delete;
    ProgressLine& operator=(const ProgressLine&) = delete;

    void update(double fraction, std::string_view what);
    /// Where nobody knows how long it takes: a few words, and where stderr is not a terminal a line
    /// every five seconds.
    void say(std::string_view what);
    ProgressCallback callback() {
        return [this](double fraction, std::string_view what) { update(fraction, what); };
    }

  private:
    using Clock = std::chrono::steady_clock;
    void rewrite(const std::string& line);

    std::string title_;
    bool terminal_;
    int tenth_ = -1;
    std::size_t width_ = 0;
    Clock::time_point last_{};
};

}  // namespace livetet
