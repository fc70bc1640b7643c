#include "base/progress.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>

namespace livetet {

namespace {

/// Ignores write errors: a closed terminal must not end the program, and fmt::print would throw.
void print(const std::string& text) { std::fputs(text.c_str(), stderr); }

std::string time_of_day() { return fmt::format("{:%H:%M:%S}", fmt::localtime(std::time(nullptr))); }

}  // namespace

ProgressLine::ProgressLine(std::string title, Clock::duration longest_silence)
    : title_(std::move(title)),
      longest_silence_(longest_silence),
      terminal_(::isatty(STDERR_FILENO) != 0) {}

ProgressLine::~ProgressLine() {
    if (terminal_ && width_ > 0) std::fputc('\n', stderr);
}

void ProgressLine::update(double fraction, std::string_view what) {
    const auto now = Clock::now();
    const bool last_update = fraction >= 1;
    const int tenth = static_cast<int>(10 * std::clamp(fraction, 0.0, 1.0));
    if (terminal_) {
        if (!last_update && now - last_ < std::chrono::milliseconds(100)) return;
        last_ = now;
        rewrite(fmt::format("{} [{:<20}] {:3.0f} % {}", title_, std::string(2 * tenth, '#'),
                            100 * fraction, what));
    } else if (tenth != tenth_ || now - last_ >= longest_silence_) {
        print(fmt::format("{} {} {:3.0f} % {}\n", time_of_day(), title_, 100 * fraction, what));
        tenth_ = tenth;
        last_ = now;
    }
}

void ProgressLine::say(std::string_view what) {
    const auto now = Clock::now();
    if (now - last_ < (terminal_ ? std::chrono::milliseconds(100) : std::chrono::seconds(5)))
        return;
    last_ = now;
    if (terminal_)
        rewrite(fmt::format("{}: {}", title_, what));
    else
        print(fmt::format("{}: {}\n", title_, what));
}

void ProgressLine::rewrite(const std::string& line) {
    print(fmt::format("\r{:<{}}", line, width_));
    width_ = line.size();
    std::fflush(stderr);
}

}  // namespace livetet
