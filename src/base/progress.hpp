#pragma once

#include <chrono>
#include <functional>
#include <string>
#include <string_view>

namespace livetet {

/// Receives the progress of a long computation: a fraction in [0, 1] and a short description. May
/// be empty.
using ProgressCallback = std::function<void(double fraction, std::string_view what)>;

/// Progress display on stderr. On a terminal it is one line, rewritten at most ten times a second;
/// otherwise one line for every ten per cent. The destructor ends the line.
class ProgressLine {
  public:
    explicit ProgressLine(std::string title);
    ~ProgressLine();
    ProgressLine(const ProgressLine&) = delete;
    ProgressLine& operator=(const ProgressLine&) = delete;

    void update(double fraction, std::string_view what);
    /// Shows a short text when the total time is unknown; if stderr is not a terminal, at most
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
