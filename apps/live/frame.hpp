#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "apps/live/blade_cuts.hpp"
#include "apps/live/error_statement.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "tracking/live_registration.hpp"
#include "tracking/sample.hpp"
#include "tracking/sensor_patch.hpp"

namespace livetet {

/// State of a deformation sensor in a frame.
struct SensorState {
    std::size_t tool = 0;  ///< index in the samples' poses: the same after a change of the scene
    DriveStatus drive = DriveStatus::placing;
    SensorTrouble trouble = SensorTrouble::lost;
    double press = 0;      ///< displacement of the centre of its patch since placement, m
    double off_organ = 0;  ///< distance from the surface if it could not be placed, m; else 0
    std::optional<RigidTransform<ImageFrame, Sensor>> base{};  ///< its pose at rest, once known
};

/// A marker pulled by hand: `base` on the organ as it was when the marker was set, and `to`, where
/// it is pulled (image frame, m). `number` counts markers from 1.
struct HandPull {
    int number = 0;
    Vector3 base = Vector3::Zero(), to = Vector3::Zero();
};

/// A line drawn by hand over the organ as it is shown: the edges of a blade that is led along it
/// (image frame, m).
struct HandCut {
    std::vector<BladeEdge> edges;
};

/// Result of a frame, without its displacement.
struct FrameState {
    double time_s = 0;   ///< the sample's own time stamp
    double ahead_s = 0;  ///< time by which the poses of reference and sensors are extrapolated
    RigidTransform<Tracker, ImageFrame> tracker_from_image;
    RegistrationStatus registration = RegistrationStatus::lost;
    SensorTrouble reference = SensorTrouble::lost;
    double press = 0;                          ///< largest of the sensors, m
    std::vector<SensorState> sensors;          ///< in the order of the scene
    std::vector<TrackedPose> image_from_tool;  ///< in the order of TrackedBody::tools
    std::vector<PoseQuality> pose_quality;     ///< of the reference, then of the sensors
    std::optional<HandPull> pull{};
    std::shared_ptr<const HandCut> hand_cut{};  ///< of this frame
    std::shared_ptr<const CutMesh> cut{};       ///< the frame's mesh; none: as it was loaded
    BladeGaps blade_gaps{};                     ///< so far
    bool cut_waits = false;                     ///< something was cut that has not opened yet
    FrameStatement statement;
    std::size_t turned_elements = 0;  ///< as TurnedElements counts them
    StepReport step;
    double sensor_s = 0;     ///< time from sample to constraints
    double output_s = 0;     ///< time to read the displacement
    double statement_s = 0;  ///< time to state the errors
};
struct Frame : FrameState {
    std::vector<Vector3> displacement;  ///< of each node of the finest mesh, m
};

}  // namespace livetet
