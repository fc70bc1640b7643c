#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <random>
#include <span>

#include "geometry/transform.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// Everything that a simulated recording is made from: the same options give the same numbers.
struct SimulatedTrackerOptions {
    double rate_Hz = 20;
    double position_rms_mm =
        1.4;  ///< RMS length of a position's error, as an electromagnetic tracker's
    double rotation_rms_deg = 0.5;  ///< RMS angle of a rotation's error
    std::uint64_t seed = 1;

    // the tool
    RigidTransform<Tool, Tip> tool_from_tip{Eigen::Matrix3d::Identity(), {0.004, -0.002, 0.15}};
    Eigen::Vector3d pivot_in_tracker{0.2, -0.1, -0.05};
    double pivot_s = 20;
    double cone_deg = 40;  ///< the tool tilts to this from the vertical, to all sides
    double dwell_s = 3;    ///< at each point touched
    double travel_s = 2;   ///< from one to the next
    double lift = 0.03;    ///< metres above the straight way between them

    // the organ
    RigidTransform<Tracker, ImageFrame> tracker_from_image_at_start{Eigen::Matrix3d::Identity(),
                                                                    {0.3, 0, -0.1}};
    Eigen::Vector3d turn_centre_in_image = Eigen::Vector3d::Zero();
    double organ_travel = 0.1;   ///< metres, at most, from where it started
    double organ_turn_deg = 40;  ///< at most
    RigidTransform<ImageFrame, Reference> image_from_reference;

    // the press
    RigidTransform<ImageFrame, Sensor> image_from_sensor_at_rest;
    Eigen::Vector3d press_direction{0, 0, -1};  ///< in the image; its length does not matter
    double press_depth = 0.015;
    int presses = 3;
    double rest_s = 3;  ///< before the first press, while the organ moves already
    double ramp_s = 1;
    double hold_s = 1.5;
    double pause_s = 1;  ///< after each press
};

/// A tracker's noise: normal on each axis, position and rotation vector, from one seeded engine.
/// The same seed gives the same errors in the same order of calls.
class TrackerNoise {
  public:
    TrackerNoise(double position_rms, double rotation_rms,
                 std::uint64_t seed);  ///< metres, radians
    explicit TrackerNoise(const SimulatedTrackerOptions& options);
    TrackedPose operator()(const TrackedPose& pose);

  private:
    Eigen::Vector3d draw(double rms);
    double position_rms_, rotation_rms_;
    std::mt19937_64 engine_;
    std::normal_distribution<double> normal_;
};

// The truth, at `time_s` from the recording's start.

/// The organ: moves and turns smoothly from `tracker_from_image_at_start`, without end.
RigidTransform<Tracker, ImageFrame> true_tracker_from_image(const SimulatedTrackerOptions& options,
                                                            double time_s);
/// How deep the deformation sensor is pressed in, metres: trapezoids with smooth ramps after the
/// rest.
double true_press_depth(const SimulatedTrackerOptions& options, double time_s);
RigidTransform<ImageFrame, Sensor> true_image_from_sensor(const SimulatedTrackerOptions& options,
                                                          double time_s);
/// The tool tilting about its tip, which rests in the pivot.
RigidTransform<Tracker, Tool> true_pivoting_tool(const SimulatedTrackerOptions& options,
                                                 double time_s);
/// The tool touching points given in the image, one after the other, the organ being where it
/// starts.
RigidTransform<Tracker, Tool> true_touching_tool(const SimulatedTrackerOptions& options,
                                                 std::span<const Eigen::Vector3d> points_in_image,
                                                 double time_s);

/// When point `i` is touched: [begin, begin + dwell_s].
double touch_begins_s(const SimulatedTrackerOptions& options, std::size_t i);
double touching_duration_s(const SimulatedTrackerOptions& options, std::size_t points);
double press_duration_s(const SimulatedTrackerOptions& options);

// The recordings, with noise. Throw Error for a rate that is not positive.

/// Tool "Stylus".
Recording simulate_pivoting(const SimulatedTrackerOptions& options);
/// Tools "Reference", "Stylus".
Recording simulate_touching(const SimulatedTrackerOptions& options,
                            std::span<const Eigen::Vector3d> points_in_image);
/// Tools "Reference", "Sensor".
Recording simulate_press(const SimulatedTrackerOptions& options);

}  // namespace livetet
