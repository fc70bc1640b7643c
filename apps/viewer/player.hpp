#pragma once

#include "apps/viewer/recording.hpp"
#include "apps/viewer/script.hpp"
#include "apps/viewer/window.hpp"
#include "base/progress.hpp"

namespace livetet {

/// Plays a recorded result in a window.
class Player {
  public:
    /// Both must outlive it. It sets the window's handlers.
    Player(const ViewRecording& recording, ViewWindow& window);

    void go_to_frame(std::size_t k);
    /// Goes to the last frame at or before this time, s from the first frame.
    void go_to_time(double time_s);
    /// Plays at the recording's own pace for this time; skips frames if drawing is slower. False if
    /// the window was closed.
    bool play(double seconds);
    /// Follows the user's input until the window is closed.
    void run();
    Stage stage();
    /// Draws the whole recording, at `rate_Hz` pictures per second of its time, to an Ogg Theora
    /// file (.ogv) or, if the name has no ending, a folder of PNG files. Throws Error if that
    /// cannot be written.
    void record(const std::filesystem::path& path, double rate_Hz,
                const ProgressCallback& progress = {});

  private:
    std::size_t frame_at(double time_s) const;
    double time_of(std::size_t k) const {
        return recording_.times_s()[k] - recording_.times_s().front();
    }
    double duration_s() const { return recording_.times_s().back() - recording_.times_s().front(); }
    void start();
    /// Shows the frame that is due, and draws.
    void advance();

    const ViewRecording& recording_;
    ViewWindow& window_;
    std::size_t frame_ = 0;
    bool playing_ = false;
    double started_s_ = 0,
           from_s_ = 0;  ///< start of playing by the steady clock, and time of the recording then
};

}  // namespace livetet
