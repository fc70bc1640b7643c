#include "apps/bench/accuracy_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/bench/realtime_cases.hpp"
#include "apps/live/tracked_body.hpp"
#include "apps/phantom/phantom.hpp"
#include "apps/phantom/phantom_shape.hpp"
#include "base/distribution.hpp"
#include "base/error.hpp"
#include "geometry/error_ellipsoid.hpp"
#include "geometry/registration_covariance.hpp"
#include "geometry/registration_error.hpp"
#include "geometry/umeyama.hpp"
#include "tracking/dwell.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

/// Phases of the press, s: the sensors' positions at rest are measured; then each depth is
/// approached, held, and judged at the end.
constexpr double rest_s = 1.2, ramp_s = 0.7, hold_s = 1.1, judged_s = 0.5;

SimulatedTrackerOptions tracker_of(const AccuracyCase& c) {
    SimulatedTrackerOptions tracker = phantom_tracker({});
    tracker.position_rms_mm = c.position_rms_mm;
    tracker.rotation_rms_deg = c.rotation_rms_deg;
    return tracker;
}

/// Seed of a tool's noise in a run: each tool has its own, so that adding a tool changes no other.
std::uint64_t seed_of(const AccuracyCase& c, int tool) {
    return static_cast<std::uint64_t>(max_true_sensors + 2) * c.seed +
           static_cast<std::uint64_t>(tool);
}

struct Registered {
    RigidTransform<ImageFrame, Reference> image_from_reference;
    ExpectedRegistrationError error;
};

/// Registration from fiducials touched in turn, averaged in the reference sensor's frame (Umeyama).
Registered registered(const AccuracyCase& c) {
    SimulatedTrackerOptions tracker = tracker_of(c);
    tracker.seed = seed_of(c, 0);
    const std::vector<Vector3> in_image = positions_of(phantom::fiducials());
    std::vector<Vector3> in_reference;
    std::vector<FrameWindow> windows;
    for (std::size_t i = 0; i < in_image.size(); ++i) {
        const double begin = touch_begins_s(tracker, i) * tracker.rate_Hz;
        windows.push_back(
            {static_cast<std::size_t>(std::ceil(begin)),
             static_cast<std::size_t>(std::floor(begin + tracker.dwell_s * tracker.rate_Hz))});
    }
    const Recording touching = simulate_touching(tracker, in_image);
    for (const Dwell& d :
         dwells_in_windows(touching, tracker.tool_from_tip, windows, {.reference = "Reference"}))
        in_reference.push_back(*d.tip_in_reference);
    const auto fit = register_points<ImageFrame, Reference>(in_reference, in_image);
    const double fle = fle_from_fre(fit.fre, in_image.size());
    FiducialErrors errors;
    errors.in_to.assign(in_image.size(), fle * fle / 3 * Eigen::Matrix3d::Identity());
    const auto image_from_reference = rigid_part(fit.to_from_from);
    return {image_from_reference,
            {registration_covariance(in_reference, image_from_reference.rotation, errors),
             true}};  // the tip is known exactly
}

std::string name_of_sensor(int k) { return fmt::format("Sensor{}", k + 1); }

/// Index of the depth that is being judged, or -1.
int judged_depth(double time_s, int depths) {
    const double since = time_s - rest_s;
    const int k = static_cast<int>(std::floor(since / (ramp_s + hold_s)));
    return since >= 0 && k < depths && (k + 1) * (ramp_s + hold_s) - since <= judged_s ? k : -1;
}

/// Depth of the press, m.
double depth_at(double time_s, const std::vector<double>& depths) {
    const double since = std::max(0.0, time_s - rest_s);
    const auto k = std::min(depths.size() - 1, static_cast<std::size_t>(since / (ramp_s + hold_s)));
    const double way = std::min(1.0, (since - static_cast<double>(k) * (ramp_s + hold_s)) / ramp_s);
    const double from = k > 0 ? depths[k - 1] : 0;
    return from + way * way * (3 - 2 * way) * (depths[k] - from);
}

/// Samples of the tracker while the organ is pressed.
class RecordedPress {
  public:
    RecordedPress(const AccuracyCase& c, const PressedOrgan& organ)
        : case_(c), organ_(organ), tracker_(tracker_of(c)) {
        for (int tool = 1; tool <= c.sensors + 1; ++tool) {
            tracker_.seed = seed_of(c, tool);
            noise_.emplace_back(tracker_);
        }
    }
    std::size_t size() const {
        const double duration =
            rest_s + static_cast<double>(organ_.truth.depths.size()) * (ramp_s + hold_s);
        return static_cast<std::size_t>(std::floor(duration * tracker_.rate_Hz));
    }
    double time_s(std::size_t k) const { return static_cast<double>(k) / tracker_.rate_Hz; }

    /// Each seed starts at another time of the organ's motion.
    RigidTransform<Tracker, ImageFrame> tracker_from_image(std::size_t k) const {
        const double since = 1 + 17.3 * static_cast<double>(case_.seed);
        return true_tracker_from_image(tracker_, case_.organ_moves ? since + time_s(k) : 0);
    }
    TrackerSample sample(std::size_t k) {
        const auto tracker_from_image = this->tracker_from_image(k);
        TrackerSample sample{
            time_s(k), {noise_[0](pose_of(tracker_from_image * tracker_.image_from_reference))}};
        const double depth = depth_at(time_s(k), organ_.truth.depths);
        for (int i = 0; i < case_.sensors; ++i)
            sample.poses.push_back(noise_[i + 1](
                pose_of(tracker_from_image * sensor_at(organ_, organ_.sensors[i], depth))));
        return sample;
    }

  private:
    AccuracyCase case_;
    const PressedOrgan& organ_;
    SimulatedTrackerOptions tracker_;
    std::vector<TrackerNoise> noise_;
};

std::vector<Vector3> places_of(const Truth& truth, std::span<const std::size_t> targets) {
    std::vector<Vector3> places;
    for (const std::size_t i : targets) places.push_back(truth.targets[i].position);
    return places;
}

/// Compares the stated error of a target with the true one, m; sums.
void add_stated(AccuracyErrors& sum, const TargetStatement& stated, double error) {
    sum.covered += error <= stated.radius_95;
    const double probability = probability_within(stated.covariance, error);
    const auto levels = stated_probabilities();
    for (std::size_t k = 0; k < levels.size(); ++k) sum.within[k] += probability <= levels[k];
    for (std::size_t q = 0; q < error_source_count; ++q) sum.by_source[q] += stated.by_source[q];
}

/// Turns sums over the samples into shares and RMS values.
void finish(AccuracyErrors& at, double count, std::vector<double> errors,
            std::vector<double> radii) {
    for (double AccuracyErrors::*e : {&AccuracyErrors::rigid, &AccuracyErrors::deforming,
                                      &AccuracyErrors::registration, &AccuracyErrors::deformation})
        at.*e = 1e3 * std::sqrt(at.*e / count);
    at.covered /= count;
    at.median = 1e3 * distribution(std::move(errors)).median;
    at.median_radius = 1e3 * distribution(std::move(radii)).median;
    for (double& share : at.within) share /= count;
    for (double& rms : at.by_source) rms = 1e3 * std::sqrt(rms / count);
}

}  // namespace

std::array<double, 19> stated_probabilities() {
    std::array<double, 19> levels{};
    for (std::size_t k = 0; k < levels.size(); ++k) levels[k] = 0.05 * static_cast<double>(k + 1);
    return levels;
}

std::vector<std::size_t> judged_targets(const Truth& truth) {
    constexpr double press = 0.015;
    std::vector<std::size_t> judged;
    for (std::size_t i = 0; i < truth.targets.size(); ++i)
        if (displacement_of(truth, truth.targets[i], press).norm() > press / 5) judged.push_back(i);
    if (judged.empty())
        fail("bench accuracy: no target moves by more than a fifth of a press of {} mm",
             1e3 * press);
    return judged;
}

std::vector<double> true_motion_mm(const Truth& truth) {
    const std::vector<std::size_t> judged = judged_targets(truth);
    std::vector<double> motion;
    for (std::size_t d = 0; d < truth.depths.size(); ++d) {
        double squares = 0;
        for (const std::size_t i : judged)
            squares += truth.targets[i].displacement[d].squaredNorm();
        motion.push_back(1e3 * std::sqrt(squares / static_cast<double>(judged.size())));
    }
    return motion;
}

Scene accuracy_scene() {
    Scene scene = phantom_scene(TimeScheme::newmark);
    scene.strain = "neohookean";  // this and the elements as in the phantom's scene
    scene.elements = Elements::p2;
    scene.solver.relative_tolerance = 1e-2;
    scene.solver.threads = 1;  // the meshes are small
    scene.track->sensors.clear();
    return scene;
}

namespace {

/// The scene with the judged targets.
Scene with_targets(Scene scene, const Truth& truth) {
    for (const std::size_t i : judged_targets(truth)) {
        TargetOptions& target = scene.track->targets.emplace_back();
        target.name = truth.targets[i].name;
        target.point_mm = 1e3 * truth.targets[i].position;
    }
    return scene;
}

}  // namespace

AccuracyModel::AccuracyModel(Scene scene, const MeshHierarchy& hierarchy, const PressedOrgan& organ)
    : scene_(with_targets(std::move(scene), organ.truth)),
      hierarchy_(hierarchy),
      body_(make_body(PETSC_COMM_SELF, scene_, MeshHierarchy(hierarchy), Use::track)),
      organ_(organ),
      judged_(judged_targets(organ.truth)),
      targets_(body_.mesh(), places_of(organ.truth, judged_)) {}

std::vector<AccuracyErrors> AccuracyModel::run(const AccuracyCase& c) {
    // 1. model at rest
    Scene scene = scene_;
    constexpr double least = 0.01;  // the tracker's figures, as its maker states them
    scene.track->position_noise_mm = std::max(least, c.position_rms_mm);
    scene.track->rotation_noise_deg = std::max(least, c.rotation_rms_deg);
    std::vector<std::string> tools{scene.track->reference_tool};
    for (int k = 0; k < c.sensors; ++k) {
        const TrueSensor& sensor = organ_.sensors[k];
        tools.push_back(name_of_sensor(k));
        SensorOptions& options = scene.track->sensors.emplace_back();
        options.tool = tools.back();
        options.patch_radius_mm = 1e3 * sensor.patch_radius;
        options.motion = sensor.motion;
    }
    const std::vector<Vector3> still(body_.mesh().nodes.size(), Vector3::Zero());
    body_.body->set_displacement(still);
    body_.body->set_velocity(still);
    const Registered registration = registered(c);
    TrackedBody model(scene, body_, tool_finder(tools), registration.image_from_reference);
    model.state_errors(std::make_unique<ErrorStatement>(scene, hierarchy_, body_.mesh()),
                       registration.error);

    // 2. press, frame by frame
    const Truth& truth = organ_.truth;
    std::vector<AccuracyErrors> sums(truth.depths.size());  // sums of squares
    std::vector<double> counts(truth.depths.size(), 0);
    RecordedPress press(c, organ_);
    std::vector<std::vector<double>> all_errors(sums.size()), all_radii(sums.size());
    for (std::size_t k = 0; k < press.size(); ++k) {
        const Frame& frame = model.advance(press.sample(k));
        while (model.work_on_responses()) {
        }
        const int d = judged_depth(press.time_s(k), static_cast<int>(truth.depths.size()));
        if (d < 0) continue;
        const auto& T_est = frame.tracker_from_image;
        const auto T_true = press.tracker_from_image(k);
        const std::vector<Vector3> u = targets_.sample(frame.displacement);
        for (std::size_t i = 0; i < judged_.size(); ++i) {
            const Vector3& x = truth.targets[judged_[i]].position;
            const Vector3& u_true = truth.targets[judged_[i]].displacement[d];
            const Vector3 &u_est = u[i], goal = T_true * (x + u_true);
            sums[d].rigid += (T_est * x - goal).squaredNorm();
            const double error = (T_est * (x + u_est) - goal).norm();
            const TargetStatement& stated = frame.statement.targets[i];
            sums[d].deforming += error * error;
            add_stated(sums[d], stated, error);
            all_errors[d].push_back(error);
            all_radii[d].push_back(stated.radius_95);
            sums[d].registration += (T_est * x - T_true * x).squaredNorm();
            sums[d].deformation += (u_est - u_true).squaredNorm();
            ++counts[d];
        }
    }
    for (std::size_t d = 0; d < sums.size(); ++d)
        finish(sums[d], counts[d], std::move(all_errors[d]), std::move(all_radii[d]));
    return sums;
}

}  // namespace livetet
