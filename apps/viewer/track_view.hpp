#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "apps/live/frame_loop.hpp"
#include "apps/viewer/script.hpp"
#include "apps/viewer/window.hpp"
#include "tracking/mailbox.hpp"

namespace livetet {

/// A window beside a run, on a thread of its own that gives way to the simulation's: it draws the
/// newest frame and passes over those that come meanwhile. Closing it ends the run, as Ctrl-C does.
class TrackView : public FrameObserver {
  public:
    struct Options {
        Surface surface = Surface::on_screen;
        std::array<int, 2> size{1280, 800};
        std::optional<ViewScript> script{};  ///< at its end the window closes
        std::filesystem::path screenshot{};  ///< written at the end; empty: none
    };
    /// `stop`: of the run, which ends with the window.
    TrackView(ShownBody body, const StopSource& stop, Options options);
    ~TrackView() override;

    std::optional<HandPull> pull() override;
    void on_frame(const Frame& frame, const TrackedBody& tracked,
                  const StreamSample& sample) override;
    /// Waits until the user closes the window, or the script has ended; off screen without one, for
    /// nothing.
    void finish() override;

    /// How many pictures were drawn, and what the last took, s: for a benchmark.
    std::size_t pictures() const { return pictures_; }
    double picture_s() const { return picture_s_; }

  private:
    /// What is handed over of a frame.
    struct Seen {
        FrameState frame;
        std::vector<Vector3> displacement;
        std::vector<TrackedBody::ShownTool> tools;
        std::vector<std::int32_t> driven;
    };
    void run();
    void lead(ViewWindow& window);
    /// Draws the newest frame, if there is a new one or the user did something. False once the
    /// window is closed.
    bool advance(ViewWindow& window);
    ShownMoment moment_of(const Seen& seen) const;

    const ShownBody body_;
    const StopSource stop_;
    const Options options_;
    Mailbox<Seen> frames_;
    Mailbox<std::optional<HandPull>> pulls_;
    std::optional<HandPull> pull_;  ///< the simulation's thread's
    std::atomic<bool> run_over_{false}, abandoned_{false};
    std::atomic<std::size_t> pictures_{0};
    std::atomic<double> picture_s_{0};
    double due_s_ = 0;      ///< when the next picture is, as what follows the view's thread's
    double renewed_s_ = 0;  ///< when texts were
    std::string labels_;    ///< what they name
    std::string failure_;   ///< read after the thread's end
    std::thread thread_;
};

}  // namespace livetet
