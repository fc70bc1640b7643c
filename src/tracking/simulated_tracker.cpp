#include "tracking/simulated_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tracking/poses.hpp"
#include "tracking/smooth_step.hpp"

namespace livetet {

namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double pi = std::numbers::pi;

double wave(double time_s, double period_s) { return std::sin(2 * pi * time_s / period_s); }

// Orientation with the tool's z axis, along which the tip lies, opposite to the tracker's.
Matrix3d tool_upright() { return AngleAxisd(pi, Vector3d::UnitX()).toRotationMatrix(); }

Vector3d press_direction(const SimulatedTrackerOptions& options) {
    if (!(options.press_direction.norm() > 0))
        fail("simulated tracker: press_direction must not be zero");
    return options.press_direction.normalized();
}

// Samples `poses_at(t)` at the recording's rate from 0 to `duration_s` inclusive and adds noise.
template <class PosesAt>
Recording record(const SimulatedTrackerOptions& options, std::vector<std::string> tools,
                 double duration_s, const PosesAt& poses_at) {
    if (!(options.rate_Hz > 0))
        fail("simulated tracker: rate_Hz = {} must be > 0", options.rate_Hz);
    TrackerNoise noise(options);
    Recording recording{std::move(tools), {}};
    const auto frames =
        static_cast<std::size_t>(std::floor(duration_s * options.rate_Hz + 1e-9)) + 1;
    for (std::size_t i = 0; i < frames; ++i) {
        const double t = static_cast<double>(i) / options.rate_Hz;
        TrackerSample sample{t, poses_at(t)};
        for (TrackedPose& pose : sample.poses) pose = noise(pose);
        recording.samples.push_back(std::move(sample));
    }
    return recording;
}

}  // namespace

TrackerNoise::TrackerNoise(double position_rms, double rotation_rms, std::uint64_t seed)
    : position_rms_(position_rms), rotation_rms_(rotation_rms), engine_(seed) {}

TrackerNoise::TrackerNoise(const SimulatedTrackerOptions& options)
    : TrackerNoise(1e-3 * options.position_rms_mm, radians_per_degree * options.rotation_rms_deg,
                   options.seed) {}

Vector3d TrackerNoise::draw(double rms) {
    Vector3d v;
    for (double& component : v) component = rms / std::sqrt(3.0) * normal_(engine_);
    return v;
}

TrackedPose TrackerNoise::operator()(const TrackedPose& pose) {
    TrackedPose noisy = pose;
    noisy.translation += draw(position_rms_);
    const Vector3d turn = draw(rotation_rms_);
    if (const double angle = turn.norm(); angle > 0)
        noisy.rotation = pose.rotation * AngleAxisd(angle, turn / angle);
    return noisy;
}

RigidTransform<Tracker, ImageFrame> true_tracker_from_image(const SimulatedTrackerOptions& options,
                                                            double time_s) {
    const double started = smooth_step(time_s);  // smooth start over the first second
    const Vector3d way =
        started * options.organ_travel *
        Vector3d(0.8 * wave(time_s, 6.1), 0.5 * wave(time_s, 7.7), 0.3 * wave(time_s, 5.3));
    const double angle = started * options.organ_turn_deg * radians_per_degree * wave(time_s, 9);
    const Vector3d axis =
        Vector3d(1, 0.6 * wave(time_s, 11), 0.8 * std::cos(2 * pi * time_s / 11)).normalized();
    RigidTransform<ImageFrame, ImageFrame> turn;
    turn.rotation = AngleAxisd(angle, axis).toRotationMatrix();
    turn.translation = options.turn_centre_in_image - turn.rotation * options.turn_centre_in_image;
    auto tracker_from_image = options.tracker_from_image_at_start * turn;
    tracker_from_image.translation += way;
    return tracker_from_image;
}

double true_press_depth(const SimulatedTrackerOptions& options, double time_s) {
    const double period = 2 * options.ramp_s + options.hold_s + options.pause_s;
    const double since = time_s - options.rest_s;
    if (since <= 0 || since >= options.presses * period) return 0;
    const double t = std::fmod(since, period);
    const double in = smooth_step(t / options.ramp_s);
    const double out = smooth_step((t - options.ramp_s - options.hold_s) / options.ramp_s);
    return options.press_depth * (in - out);
}

RigidTransform<ImageFrame, Sensor> true_image_from_sensor(const SimulatedTrackerOptions& options,
                                                          double time_s) {
    auto image_from_sensor = options.image_from_sensor_at_rest;
    image_from_sensor.translation += true_press_depth(options, time_s) * press_direction(options);
    return image_from_sensor;
}

RigidTransform<Tracker, Tool> true_pivoting_tool(const SimulatedTrackerOptions& options,
                                                 double time_s) {
    const double tilt = options.cone_deg * radians_per_degree * wave(time_s, 4.3);
    const double towards = 2 * pi * time_s / 13;
    const AngleAxisd tilted(tilt, Vector3d(std::cos(towards), std::sin(towards), 0));
    RigidTransform<Tracker, Tool> tracker_from_tool;
    tracker_from_tool.rotation = tilted * tool_upright();
    tracker_from_tool.translation =
        options.pivot_in_tracker - tracker_from_tool.rotation * options.tool_from_tip.translation;
    return tracker_from_tool;
}

namespace {

/// Pose of a tool in a hand, its tip at this place of the tracker.
RigidTransform<Tracker, Tool> held_tool(const SimulatedTrackerOptions& options, const Vector3d& tip,
                                        double time_s) {
    RigidTransform<Tracker, Tool> tracker_from_tool;
    tracker_from_tool.rotation = AngleAxisd(0.35 * wave(time_s, 3.1), Vector3d::UnitX()) *
                                 AngleAxisd(0.35 * wave(time_s, 2.3), Vector3d::UnitY()) *
                                 tool_upright();
    tracker_from_tool.translation =
        tip - tracker_from_tool.rotation * options.tool_from_tip.translation;
    return tracker_from_tool;
}

}  // namespace

RigidTransform<Tracker, Tool> true_touching_tool(const SimulatedTrackerOptions& options,
                                                 std::span<const Vector3d> points_in_image,
                                                 double time_s) {
    if (points_in_image.empty()) fail("simulated tracker: no points to touch");
    const double period = options.dwell_s + options.travel_s;
    const std::size_t last = points_in_image.size() - 1;
    const std::size_t k = std::min(last, static_cast<std::size_t>(std::max(0.0, time_s) / period));
    const double on_the_way =
        (time_s - touch_begins_s(options, k) - options.dwell_s) / options.travel_s;
    const double done = k < last ? smooth_step(on_the_way) : 0.0;
    const Vector3d tip_in_image =
        (1 - done) * points_in_image[k] + done * points_in_image[std::min(k + 1, last)];
    Vector3d tip = options.tracker_from_image_at_start * tip_in_image;
    tip.z() += 16 * options.lift * done * done * (1 - done) * (1 - done);
    return held_tool(options, tip, time_s);
}

double touch_begins_s(const SimulatedTrackerOptions& options, std::size_t i) {
    return static_cast<double>(i) * (options.dwell_s + options.travel_s);
}

double touching_duration_s(const SimulatedTrackerOptions& options, std::size_t points) {
    return points == 0 ? 0 : touch_begins_s(options, points - 1) + options.dwell_s;
}

double press_duration_s(const SimulatedTrackerOptions& options) {
    return options.rest_s +
           options.presses * (2 * options.ramp_s + options.hold_s + options.pause_s);
}

Recording simulate_pivoting(const SimulatedTrackerOptions& options) {
    return record(options, {"Stylus"}, options.pivot_s,
                  [&](double t) { return std::vector{pose_of(true_pivoting_tool(options, t))}; });
}

Recording simulate_touching(const SimulatedTrackerOptions& options,
                            std::span<const Vector3d> points_in_image) {
    const auto tracker_from_reference =
        options.tracker_from_image_at_start * options.image_from_reference;
    return record(options, {"Reference", "Stylus"},
                  touching_duration_s(options, points_in_image.size()), [&](double t) {
                      return std::vector{pose_of(tracker_from_reference),
                                         pose_of(true_touching_tool(options, points_in_image, t))};
                  });
}

Recording simulate_sweep(const SimulatedTrackerOptions& options,
                         std::span<const Vector3d> places_in_image) {
    if (places_in_image.empty()) fail("simulated tracker: no places to sweep");
    const auto last = static_cast<double>(places_in_image.size() - 1);
    return record(options, {"Reference", "Stylus"}, last / options.rate_Hz, [&](double t) {
        const auto tracker_from_image = true_tracker_from_image(options, t);
        const auto k =
            static_cast<std::size_t>(std::clamp(std::round(t * options.rate_Hz), 0.0, last));
        return std::vector{pose_of(tracker_from_image * options.image_from_reference),
                           pose_of(held_tool(options, tracker_from_image * places_in_image[k], t))};
    });
}

namespace {

std::vector<TrackedPose> pressed_poses(const SimulatedTrackerOptions& options, double time_s) {
    const auto tracker_from_image = true_tracker_from_image(options, time_s);
    return {pose_of(tracker_from_image * options.image_from_reference),
            pose_of(tracker_from_image * true_image_from_sensor(options, time_s))};
}

}  // namespace

Recording simulate_press(const SimulatedTrackerOptions& options) {
    return record(options, {"Reference", "Sensor"}, press_duration_s(options),
                  [&](double t) { return pressed_poses(options, t); });
}

Recording simulate_resection(const SimulatedTrackerOptions& options, const BladeStroke& stroke) {
    if (!(stroke.end_s > stroke.begin_s))
        fail("simulated tracker: a stroke from {} to {} s, expected its end after its beginning",
             stroke.begin_s, stroke.end_s);
    const auto place = [&](double t) -> Vector3d {
        const double done =
            std::clamp((t - stroke.begin_s) / (stroke.end_s - stroke.begin_s), 0.0, 1.0);
        return (1 - done) * stroke.from + done * stroke.to;
    };
    return record(
        options, {"Reference", "Sensor", "Scalpel"}, press_duration_s(options), [&](double t) {
            std::vector<TrackedPose> poses = pressed_poses(options, t);
            poses.push_back(
                pose_of(true_tracker_from_image(options, t) *
                        RigidTransform<ImageFrame, Tool>{Eigen::Matrix3d::Identity(), place(t)}));
            return poses;
        });
}

}  // namespace livetet
