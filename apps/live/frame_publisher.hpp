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

/// A frame with what is published of it.
struct PublishedFrame {
    FrameState frame;
    std::vector<Vector3> displacement;  ///< empty if there is no server
    std::vector<TrackedBody::ShownTool> tools;
    std::vector<std::string> sensors, targets;
    std::vector<PoseTimes> times;  ///< of the sample's poses
    std::uint64_t sample = 0;
    std::size_t frames = 0, missed = 0;
    double arrived_s = 0, done_s = 0;  ///< steady clock
    bool last = false;
};

/// Makes the OpenIGTLink messages of a frame: the organ's surface (POLYDATA, with the length of the
/// displacement in mm), the 95 % ellipsoids of the scene's targets (POLYDATA `TargetRegion`, with
/// `radius_95_mm` and `missing_sources`; none without targets), tracker and tools in the image
/// (TRANSFORM `TrackerToRAS`, `StylusTipToRAS`, `SensorToRAS`; none for a tool that is not seen),
/// STATUS `Livetet` (1: all is well, 13: a sensor is being placed, 7: something is not followed,
/// and why) and STRING `LivetetFrame` (JSON). `time_s`: UTC.
class FrameMessages {
  public:
    /// `mesh`: as it was loaded; frames that are cut have their own.
    FrameMessages(const TetMesh& mesh, std::string surface);
    std::vector<igtl::Message> operator()(const PublishedFrame& frame, double time_s);

  private:
    void take_mesh(const TetMesh& mesh);

    std::string surface_;
    std::shared_ptr<const CutMesh> cut_;  ///< whose surface it is; none: as loaded
    std::vector<std::int32_t> nodes_;
    std::vector<Vector3> rest_;
    std::vector<Triangle> triangles_;  ///< indices into nodes_
};

/// The status line: samples and frames a second, missed samples, latency, time by which poses are
/// ahead, age and lag of each tool, Newton and linear iterations, estimated error, state of the
/// sensors; and, if a requested tool never came, the names that do come.
std::string status_text(const PublishedFrame& frame, const SourceStatus& source, double received_Hz,
                        double frames_Hz);

/// Publishes frames from a thread of its own: its status to a callback, and OpenIGTLink.
/// Only the newest frame matters: frames that arrive while another is published are skipped, and
/// the simulation never waits.
class FramePublisher {
  public:
    /// `samples`: expected number of samples, 0 if unknown. `show` is called from the publisher's
    /// thread. Throws Error if the port cannot be opened.
    FramePublisher(const TetMesh& mesh, const TrackerSource& source, std::size_t samples,
                   const std::optional<PublishOptions>& publish, StatusCallback show = {});
    ~FramePublisher();

    /// Called from the simulation thread.
    void publish(const Frame& frame, const TrackedBody& tracked, const Scene& scene,
                 const StreamSample& sample, std::size_t frames, std::size_t missed);
    std::uint16_t port() const { return server_ ? server_->port() : 0; }

  private:
    void run();

    const TrackerSource& source_;
    std::size_t samples_;
    StatusCallback show_;
    double period_s_ = 0;
    std::optional<FrameMessages> messages_;
    std::unique_ptr<OpenIgtLinkServer> server_;
    Mailbox<PublishedFrame> mailbox_;
    std::thread thread_;
};

}  // namespace livetet
