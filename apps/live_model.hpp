#pragma once

#include <optional>

#include "apps/scene_body.hpp"
#include "io/registration_file.hpp"
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
    std::vector<Vector3> displacement;  ///< m, each node of the finest mesh
};

/// From a tracker's sample to the deformed organ: registration by the reference sensor, the deformation sensor's patch,
/// the constraints, one time step. Knows no clock: all times are the samples'.
class LiveModel {
  public:
    /// `tools`: the names behind the samples' poses. Throws Error where a tool of the scene is not among them, or the
    /// registration was not made in the reference sensor's frame.
    LiveModel(const Scene& scene, SceneBody& body, const std::vector<std::string>& tools,
              const std::vector<RegisteredFiducial>& fiducials);

    /// One frame. Throws Error where the deformation sensor, when placed, is not on the organ.
    const Frame& advance(const TrackerSample& sample);

    /// The nodes that follow the sensor; empty while it is being placed.
    const std::vector<std::int32_t>& patch() const { return patch_.nodes; }

  private:
    void follow(const TrackerSample& sample);
    void place_patch();

    const Scene& scene_;
    SceneBody& body_;
    std::size_t reference_, sensor_;
    OutlierGate reference_gate_, sensor_gate_;
    PoseFilter reference_filter_, sensor_filter_;
    LiveRegistration registration_;
    SensorDrive drive_;
    Constraints fixed_, constraints_;
    SurfacePatch patch_;
    std::optional<double> last_time_s_;
    Frame frame_;
};

}  // namespace livetet
