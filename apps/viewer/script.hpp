#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace livetet {

class ViewWindow;

/// How a script controls time.
struct Stage {
    std::function<void(std::size_t frame)>
        go_to_frame;  ///< empty for a run: frames come as they are computed
    std::function<void(double time_s)> go_to_time;  ///< likewise; time from the first frame
    std::function<bool(double seconds)>
        play;  ///< plays for this time; false if the window was closed
};

/// A script of commands to a window, checked when it is read.
class ViewScript {
  public:
    /// Receives a line of what `tell` prints.
    using Printer = std::function<void(const std::string& line)>;

    /// `text`: one command a line; `#` begins a comment. Throws Error, naming `source` and the
    /// line, for an unknown command or wrong arguments.
    ViewScript(const std::string& text, const std::string& source, Printer print = {});

    /// Runs all commands in order. Throws Error, naming the line, if one fails.
    void run(ViewWindow& window, const Stage& stage) const;

    /// The commands and their descriptions, a line each.
    static std::string reference();

  private:
    struct Line {
        int number;
        std::size_t command;
        std::vector<std::string> words;  ///< arguments
    };
    std::string source_;
    Printer print_;
    std::vector<Line> lines_;
};

}  // namespace livetet
