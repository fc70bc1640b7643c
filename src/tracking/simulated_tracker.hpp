#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <random>
#include <span>

#include "geometry/transform.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// Options of a simulated recording. Equal options give equal recordings.
struct SimulatedTrackerOptions {
    double rate_Hz = 20;
    /// RMS length of the position error; 1.4 mm is typical of an electromagnetic tracker.
    double position_rms_mm = 1.4;
    double rotation_rms_deg = 0.5;  ///< RMS angle of the rotation error
    std::uint64_t seed = 1;

    // the tool
    RigidTransform<Tool, Tip> tool_from_tip{Eigen::Matrix3d::Identity(), {0.004, -0.002, 0.15}};
    Eigen::Vector3d pivot_in_tracker{0.2, -0.1, -0.05};
    double pivot_s = 20;
    double cone_deg = 40;  ///< maximum tilt from the vertical, to all sides
    double dwell_s = 3;    ///< time at each touched point
    double travel_s = 2;   ///< time between two points
    double lift = 0.03;  ///< height of the path above the straight line between two points, metres

    // the organ
    RigidTransform<Tracker, ImageFrame> tracker_from_image_at_start{Eigen::Matrix3d::Identity(),
                                                                    {0.3, 0, -0.1}};
    Eigen::Vector3d turn_centre_in_image = Eigen::Vector3d::Zero();
    double organ_travel = 0.1;   ///< maximum displacement from the start, metres
    double organ_turn_deg = 40;  ///< maximum rotation from the start
    RigidTransform<ImageFrame, Reference> image_from_reference;

    // the press
    RigidTransform<ImageFrame, Sensor> image_from_sensor_at_rest;
    Eigen::Vector3d press_direction{0, 0, -1};  ///< in the image; any length
    double press_depth = 0.015;
    int presses = 3;
    double rest_s = 3;  ///< before the first press; the organ already moves
    double ramp_s = 1;
    double hold_s = 1.5;
    double pause_s = 1;  ///< after each press
};

/// A blade that is led through the organ, straight and at constant speed. Places are those of its
/// sensor in the image, m; before and after it rests at the ends.
struct BladeStroke {
    Eigen::Vector3d from = Eigen::Vector3d::Zero(), to = Eigen::Vector3d::Zero();
    double begin_s = 0, end_s = 1;
};

/// Tracker noise: normally distributed on each axis of position and rotation vector, from one
/// seeded engine. The same seed and order of calls give the same errors.
class TrackerNoise {
  public:
    /// RMS errors in metres and radians.
    TrackerNoise(double position_rms, double rotation_rms, std::uint64_t seed);
    explicit TrackerNoise(const SimulatedTrackerOptions& options);
    TrackedPose operator()(const TrackedPose& pose);

  private:
    Eigen::Vector3d draw(double rms);
    double position_rms_, rotation_rms_;
    std::mt19937_64 engine_;
    std::normal_distribution<double> normal_;
};

// The true motion, `time_s` seconds after the start of the recording.

/// Pose of the organ: moves and turns smoothly and endlessly, starting at
/// `tracker_from_image_at_start`.
RigidTransform<Tracker, ImageFrame> true_tracker_from_image(const SimulatedTrackerOptions& options,
                                                            double time_s);
/// Depth to which the deformation sensor is pressed, metres: trapezoids with smooth ramps after the
/// rest.
double true_press_depth(const SimulatedTrackerOptions& options, double time_s);
/// Pose of the pressing sensor in the image.
RigidTransform<ImageFrame, Sensor> true_image_from_sensor(const SimulatedTrackerOptions& options,
                                                          double time_s);
/// Pose of the tool tilting about its tip, which rests in the pivot.
RigidTransform<Tracker, Tool> true_pivoting_tool(const SimulatedTrackerOptions& options,
                                                 double time_s);
/// Pose of the tool touching the points one after another. The organ is in its initial pose.
RigidTransform<Tracker, Tool> true_touching_tool(const SimulatedTrackerOptions& options,
                                                 std::span<const Eigen::Vector3d> points_in_image,
                                                 double time_s);

/// Start of the time interval in which point `i` is touched: [begin, begin + dwell_s].
double touch_begins_s(const SimulatedTrackerOptions& options, std::size_t i);
/// Duration of `simulate_touching` for this many points, and of `simulate_press`.
double touching_duration_s(const SimulatedTrackerOptions& options, std::size_t points);
double press_duration_s(const SimulatedTrackerOptions& options);

// The noisy recordings. Each throws Error if the rate is not positive.

/// Tool "Stylus".
Recording simulate_pivoting(const SimulatedTrackerOptions& options);
/// Tools "Reference", "Stylus".
Recording simulate_touching(const SimulatedTrackerOptions& options,
                            std::span<const Eigen::Vector3d> points_in_image);
/// Tools "Reference", "Stylus": the tip is at the next of these places at each sample, on the organ
/// that moves and turns. Throws Error if there are none.
Recording simulate_sweep(const SimulatedTrackerOptions& options,
                         std::span<const Eigen::Vector3d> places_in_image);
/// Tools "Reference", "Sensor".
Recording simulate_press(const SimulatedTrackerOptions& options);
/// The same with the tool "Scalpel", whose axes are those of the image. Throws Error unless the
/// stroke ends after it begins.
Recording simulate_resection(const SimulatedTrackerOptions& options, const BladeStroke& stroke);

}  // namespace livetet
