#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <thread>

#include "apps/live/tracked_body.hpp"
#include "base/progress.hpp"
#include "io/openigtlink/server.hpp"
#include "tracking/source.hpp"

namespace livetet {

/// The newest frame as others are told of it.
struct PublishedFrame {
    FrameState frame;
    std::vector<Vector3> displacement;  ///< where it is published
    std::vector<TrackedBody::ShownTool> tools;
    std::vector<std::string> sensors;
    std::vector<PoseTimes> times;  ///< of the sample's poses
    std::uint64_t sample = 0;
    std::size_t frames = 0, missed = 0;
    double arrived_s = 0, done_s = 0;  ///< steady clock
    bool last = false;
};

/// The messages that a frame becomes: the organ's surface (POLYDATA, with the displacement's length
/// in mm), the tracker and the tools in the image (TRANSFORM: `TrackerToRAS`, `StylusTipToRAS`,
/// `SensorToRAS`; none of a tool that is not seen), STATUS `Livetet` (1: all is well, 7: something
/// is not followed, and why) and STRING `LivetetFrame`, JSON. `time_s`: UTC.
class FrameMessages {
  public:
    FrameMessages(const TetMesh& mesh, std::string surface);
    std::vector<igtl::Message> operator()(const PublishedFrame& frame, double time_s) const;

  private:
    std::string surface_;
    std::vector<std::int32_t> nodes_;
    std::vector<Vector3> rest_;
    std::vector<Triangle> triangles_;  ///< of places in nodes_
};

/// One line of what is going on: Hz received, latency, age of each tool, what was missed, Newton
/// and Krylov iterations, the estimated error, what sensors do; and, where a name asked for does
/// not come, the names that do.
std::string status_text(const PublishedFrame& frame, const SourceStatus& source, double received_Hz,
                        double frames_Hz);

/// Tells of frames from a thread of its own: the status line on the terminal, and OpenIGTLink. The
/// newest frame alone matters: what comes while another is told of is passed over, and the
/// simulation waits for nobody.
class FramePublisher {
  public:
    /// `samples`: how many there will be, 0 where nobody knows. Throws Error where the port cannot
    /// be listened on.
    FramePublisher(const TetMesh& mesh, const TrackerSource& source, std::size_t samples,
                   const std::optional<PublishOptions>& publish);
    ~FramePublisher();

    /// From the simulation's thread.
    void publish(const Frame& frame, const TrackedBody& tracked, const Scene& scene,
                 const StreamSample& sample, std::size_t frames, std::size_t missed);
    std::uint16_t port() const { return server_ ? server_->port() : 0; }

  private:
    void run();

    const TrackerSource& source_;
    std::size_t samples_;
    double period_s_ = 0;
    std::optional<FrameMessages> messages_;
    std::unique_ptr<OpenIgtLinkServer> server_;
    Mailbox<PublishedFrame> mailbox_;
    std::thread thread_;
};

}  // namespace livetet
