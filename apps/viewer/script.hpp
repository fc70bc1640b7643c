#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace livetet {

class ViewWindow;

/// What a script can ask of whoever leads the window through time.
struct Stage {
    std::function<void(std::size_t frame)>
        go_to_frame;                                ///< empty: frames come as they are computed
    std::function<void(double time_s)> go_to_time;  ///< likewise; from the first frame on
    std::function<bool(double seconds)>
        play;  ///< goes on for so long; false where the window was closed
};

/// A scripted use of the window, checked as it is read.
class ViewScript {
  public:
    /// Receives a line of what `tell` prints.
    using Printer = std::function<void(const std::string& line)>;

    /// `text`: one command a line; `#` begins a comment. Throws Error, naming `source` and the
    /// line, for an unknown command or wrong arguments.
    ViewScript(const std::string& text, const std::string& source, Printer print = {});

    /// Does one command after the other; pictures are drawn at once. Throws Error, naming the line,
    /// where one cannot be done.
    void run(ViewWindow& window, const Stage& stage) const;

    /// The commands with what they do, a line each.
    static std::string reference();

  private:
    struct Line {
        int number;
        std::size_t command;
        std::vector<std::string> words;  ///< its arguments
    };
    std::string source_;
    Printer print_;
    std::vector<Line> lines_;
};

}  // namespace livetet
