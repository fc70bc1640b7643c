#pragma once

#include "apps/viewer/recording.hpp"
#include "apps/viewer/script.hpp"
#include "apps/viewer/window.hpp"

namespace livetet {

/// Leads a window through a recorded result.
class Player {
  public:
    /// Both have to outlive it; the window's handlers are its.
    Player(const ViewRecording& recording, ViewWindow& window);

    void go_to_frame(std::size_t k);
    /// The last frame that is not after this, in seconds from the first.
    void go_to_time(double time_s);
    /// At its own pace for so long, frames left out where drawing is slower. False where the window
    /// was closed.
    bool play(double seconds);
    /// As the user likes. Until the window is closed.
    void run();
    Stage stage();
    /// Draws the whole recording, at so many pictures a second of its time, into an Ogg Theora file
    /// (.ogv) or, where the name has no ending, a folder of PNG files. Throws Error where that
    /// cannot be written.
    void record(const std::filesystem::path& path, double rate_Hz);

  private:
    std::size_t frame_at(double time_s) const;
    double time_of(std::size_t k) const {
        return recording_.times_s()[k] - recording_.times_s().front();
    }
    double duration_s() const { return recording_.times_s().back() - recording_.times_s().front(); }
    void start();
    /// Shows what is due. Draws.
    void advance();

    const ViewRecording& recording_;
    ViewWindow& window_;
    std::size_t frame_ = 0;
    bool playing_ = false;
    double started_s_ = 0, from_s_ = 0;  ///< by the steady clock; the recording's time then
};

}  // namespace livetet
