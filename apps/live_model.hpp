#pragma once

#include <optional>

#include "apps/scene_body.hpp"
#include "mesh/surface_patch.hpp"
#include "tracking/live_registration.hpp"
#include "tracking/pose_filter.hpp"
#include "tracking/sample.hpp"
#include "tracking/sensor_drive.hpp"

namespace livetet {

/// What one frame came to.
struct Frame {
    double time_s = 0;  ///< the sample's own time stamp
    RigidTransform<Tracker, ImageFrame> tracker_from_image;
    RegistrationStatus registration = RegistrationStatus::lost;
    DriveStatus drive = DriveStatus::placing;
    double press = 0;  ///< length of the patch's displacement, m
    StepReport step;
    double sensor_s = 0, output_s = 0;  ///< what the way from sample to constraints took, and the displacement's out
    std::vector<Vector3> displacement;  ///< m, each node of the finest mesh
};

/// What a frame may take: it is to be done by `deadline`, as near to converged as that allows; `iterations` of each solve at
/// most (0: as the scene says); `by_halves`: one half of the operator renewed, the other by the next frame, which else
/// only a near deadline leads to.
struct FrameLimits {
    std::optional<Clock::time_point> deadline{};
    int iterations = 0;
    bool by_halves = false;
};

/// From a tracker's sample to the deformed organ: registration by the reference sensor, the deformation sensor's patch,
/// the constraints, one time step. Its times are the samples'; a clock decides only when to stop solving.
class LiveModel {
  public:
    /// `tools`: the names behind the samples' poses. Throws Error where a tool of the scene is not among them.
    LiveModel(const Scene& scene, SceneBody& body, const std::vector<std::string>& tools,
              const RigidTransform<ImageFrame, Reference>& image_from_reference);

    /// One frame. After the first ones nothing is allocated. Throws Error where the deformation sensor, when placed, is not
    /// on the organ.
    const Frame& advance(const TrackerSample& sample, FrameLimits limits = {});

    /// The nodes that follow the sensor; empty while it is being placed.
    const std::vector<std::int32_t>& patch() const { return patch_.nodes; }

    /// Those of them that the scene does not hold, and where to: the frame's prescribed displacements, m.
    const std::vector<std::int32_t>& driven() const { return driven_; }
    const std::vector<Vector3>& driven_to() const { return driven_to_; }
    /// All constraints but the values of `driven`.
    const Constraints& constraints() const { return constraints_; }

  private:
    void follow(const TrackerSample& sample);
    void place_patch();
    void move_patch();

    const Scene& scene_;
    SceneBody& body_;
    std::size_t reference_, sensor_;
    OutlierGate reference_gate_, sensor_gate_;
    PoseFilter reference_filter_, sensor_filter_;
    LiveRegistration registration_;
    SensorDrive drive_;
    Constraints constraints_;
    SurfacePatch patch_;
    std::vector<std::int32_t> driven_;  ///< the patch's nodes that the scene does not hold
    std::vector<Vector3> driven_to_;
    double tail_s_ = 0;  ///< what a frame still needs after its last solve: the most of late
    std::optional<double> last_time_s_;
    Frame frame_;
};

}  // namespace livetet
