#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace livetet {

/// Receives the progress of a long computation: a fraction in [0, 1] and a short description. May
/// be empty.
using ProgressCallback = std::function<void(double fraction, std::string_view what)>;

/// Receives the state of something that goes on, from the thread that it goes on in: how far it is,
/// in [0, 1], or nothing where its end is unknown, and a text. May be empty.
using StatusCallback = std::function<void(std::optional<double> fraction, std::string_view what)>;

/// Progress display of a program on stderr; libraries take a callback instead. On a terminal it is
/// one line, rewritten at most ten times a second; otherwise a line with the time of day for every
/// ten per cent, and at the first update after `longest_silence`. The destructor ends the line.
class ProgressLine {
  public:
    using Clock = std::chrono::steady_clock;
    explicit ProgressLine(std::string title,
                          Clock::duration longest_silence = std::chrono::seconds(30));
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
    StatusCallback status() {
        return [this](std::optional<double> fraction, std::string_view what) {
            if (fraction)
                update(*fraction, what);
            else
                say(what);
        };
    }

  private:
    void rewrite(const std::string& line);

    std::string title_;
    Clock::duration longest_silence_;
    bool terminal_;
    int tenth_ = -1;
    std::size_t width_ = 0;
    Clock::time_point last_{};
};

}  // namespace livetet
