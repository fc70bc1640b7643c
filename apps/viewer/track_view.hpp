#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "apps/live/frame_loop.hpp"
#include "apps/viewer/script.hpp"
#include "apps/viewer/window.hpp"
#include "base/ring.hpp"
#include "tracking/mailbox.hpp"

namespace livetet {

/// A window beside a run, on a thread of low priority: it draws the newest frame and skips those
/// that come meanwhile. Closing it ends the run, as Ctrl-C does.
class TrackView : public FrameObserver {
  public:
    struct Options {
        Surface surface = Surface::on_screen;
        std::array<int, 2> size{1280, 800};
        std::optional<ViewScript> script{};  ///< its end closes the window
        std::filesystem::path screenshot{};  ///< written at the end; empty: none
        std::optional<double> cut_depth{};   ///< of lines drawn by hand, m; none: nothing is cut
    };
    /// `stop`: stops the run; requested when the window is closed.
    TrackView(ShownBody body, const StopSource& stop, Options options);
    ~TrackView() override;

    std::optional<HandPull> pull() override;
    std::shared_ptr<const HandCut> cut() override;
    void on_frame(const Frame& frame, const TrackedBody& tracked,
                  const StreamSample& sample) override;
    /// Waits until the user closes the window or the script ends; off screen without a script, not
    /// at all.
    void finish() override;

    /// Number of pictures, and time of the last, s; for a benchmark.
    std::size_t pictures() const { return pictures_; }
    double picture_s() const { return picture_s_; }

  private:
    /// The data of a frame that are passed to the window.
    struct Seen {
        FrameState frame;
        std::vector<Vector3> displacement;
        std::vector<TrackedBody::ShownTool> tools;
        std::vector<std::int32_t> driven;
        std::vector<std::string> targets;
    };
    void run();
    void lead(ViewWindow& window);
    /// Draws the newest frame, if it is new or the user did something. False once the window is
    /// closed.
    bool advance(ViewWindow& window);
    ShownMoment moment_of(const Seen& seen) const;

    ShownBody body_;  ///< its mesh is the one that is shown; used by the view's thread only
    const StopSource stop_;
    const Options options_;
    Mailbox<Seen> frames_;
    Mailbox<std::optional<HandPull>> pulls_;
    std::optional<HandPull> pull_;                   ///< used by the simulation's thread only
    Ring<std::shared_ptr<const HandCut>> cuts_{16};  ///< lines that no frame has taken yet
    std::atomic<bool> run_over_{false}, abandoned_{false};
    std::atomic<std::size_t> pictures_{0};
    std::atomic<double> picture_s_{0};
    double due_s_ =
        0;  ///< time of the next picture; this and what follows belong to the view's thread
    double renewed_s_ = 0;                ///< time when texts were redrawn
    std::string labels_;                  ///< contents of the texts
    std::shared_ptr<const CutMesh> cut_;  ///< whose mesh body_ has; none: as it was loaded
    std::string failure_;                 ///< read after the thread has ended
    std::thread thread_;
};

}  // namespace livetet
