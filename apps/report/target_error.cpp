#include "apps/report/target_error.hpp"

#include <fmt/format.h>
#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "apps/report/truth_match.hpp"
#include "base/error.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

using Pose = RigidTransform<Tracker, ImageFrame>;

constexpr double deepest_share = 0.95;
constexpr double moving_m = 3e-3;
constexpr double at_rest_m = 1e-6;  // a shallower press is none

/// A target in a frame, m: its position at rest, and its displacements in the model and the truth.
struct TargetState {
    Vector3 x, u_est, u_true;
};

/// |T_est (x + u) - T_true (x + u_true)| in mm.
double error_mm(const Pose& est, const Pose& truth, const TargetState& t, const Vector3& u) {
    return 1e3 * (est * Vector3(t.x + u) - truth * Vector3(t.x + t.u_true)).norm();
}

PointSampler place_targets(const RunResult& result, const Truth& truth) {
    std::vector<Vector3> places;
    for (const auto& target : truth.targets) places.push_back(target.position);
    PointSampler sampler(result.mesh, places);
    for (std::size_t i = 0; i < places.size(); ++i)
        if (sampler.distances()[i] > 0.01)
            fail(
                "{}: target {} of the truth is {:.1f} mm outside the mesh, expected the truth of "
                "the same organ",
                result.source, truth.targets[i].name, 1e3 * sampler.distances()[i]);
    return sampler;
}

/// Sums of one pass over the frames.
struct Gathered {
    std::vector<double> rigid, deforming, registration,
        deformation;  // deepest press, moving targets
    std::vector<double> moved_at_rest, registration_at_rest;
    double lag_up = 0, lag_down = 0;  // sums of e . v and v . v
};

/// True velocity of a point of the organ in the tracker's frame at a sample, m/s, by central
/// differences.
Vector3 true_velocity(const Truth& truth, std::size_t sample, const Vector3& x) {
    const auto& a = truth.samples[sample == 0 ? 0 : sample - 1];
    const auto& b = truth.samples[std::min(sample + 1, truth.samples.size() - 1)];
    if (!(b.time_s > a.time_s)) return Vector3::Zero();
    return (b.tracker_from_image * x - a.tracker_from_image * x) / (b.time_s - a.time_s);
}

void gather_rest(Gathered& g, const Pose& est, const Truth& truth, const TruthMatch& match,
                 const std::vector<TargetState>& states) {
    const Pose& actual = match.truth.tracker_from_image;
    for (const TargetState& t : states) {
        const Vector3 e = est * t.x - actual * t.x, v = true_velocity(truth, match.sample, t.x);
        g.moved_at_rest.push_back(1e3 * t.u_est.norm());
        g.registration_at_rest.push_back(1e3 * e.norm());
        g.lag_up -= e.dot(v);
        g.lag_down += v.squaredNorm();
    }
}

void gather_deepest(Gathered& g, const Pose& est, const Pose& actual,
                    const std::vector<TargetState>& states,
                    const std::vector<std::size_t>& moving) {
    for (const std::size_t i : moving) {
        const TargetState& t = states[i];
        g.rigid.push_back(error_mm(est, actual, t, Vector3::Zero()));
        g.deforming.push_back(error_mm(est, actual, t, t.u_est));
        g.registration.push_back(1e3 * (est * t.x - actual * t.x).norm());
        g.deformation.push_back(1e3 * (t.u_est - t.u_true).norm());
    }
}

TargetErrorSample sample_errors(double time_s, double press, const Pose& est, const Pose& actual,
                                const std::vector<TargetState>& states,
                                const std::vector<std::size_t>& moving) {
    double rigid = 0, deforming = 0;
    for (const std::size_t i : moving) {
        rigid += std::pow(error_mm(est, actual, states[i], Vector3::Zero()), 2);
        deforming += std::pow(error_mm(est, actual, states[i], states[i].u_est), 2);
    }
    const auto n = static_cast<double>(moving.size());
    return {time_s, 1e3 * press, std::sqrt(rigid / n), std::sqrt(deforming / n)};
}

/// Motion of the organ between the first frame at rest and any other.
void measure_travel(RestErrors& rest, const Truth& truth, const std::vector<TruthMatch>& matches) {
    const Pose* first = nullptr;
    for (const TruthMatch& m : matches) {
        if (m.truth.depth > at_rest_m) continue;
        const Pose& pose = m.truth.tracker_from_image;
        if (!first) first = &pose;
        for (const auto& target : truth.targets)
            rest.organ_travel_mm =
                std::max(rest.organ_travel_mm,
                         1e3 * (pose * target.position - *first * target.position).norm());
        const double angle = Eigen::AngleAxisd(pose.rotation * first->rotation.transpose()).angle();
        rest.organ_turn_deg = std::max(rest.organ_turn_deg, angle * 180 / std::numbers::pi);
    }
}

/// Error of a registered target by the tracker's stated noise, RMS over the targets: the position
/// error p of the reference sensor; its rotation error theta times the distance d of the target, of
/// which two thirds act across d; and the error of the fiducials (FLE^2 / N at their centre, FLE^2
/// = FRE^2 N / (N - 2)): p^2 + 2/3 theta^2 d^2 + FRE^2 / (N - 2).
double registration_noise_mm(const RunResult& result, const Truth& truth) {
    const double fiducials = static_cast<double>(result.info.fiducials.size());
    const double fre = result.info.fre_mm;
    double squares = 0;
    for (const TruthTarget& t : truth.targets)
        squares += 2.0 / 3 * std::pow(truth.rotation_noise, 2) *
                   (t.position - truth.reference_rest).squaredNorm();
    const double mean =
        squares / static_cast<double>(truth.targets.size()) + std::pow(truth.position_noise, 2);
    return std::sqrt(1e6 * mean + (fiducials > 2 ? fre * fre / (fiducials - 2) : 0));
}

}  // namespace

std::string lag_text(double lag_ms) {
    const long rounded = std::lround(lag_ms);
    return rounded < 0 ? fmt::format("{} ms ahead of the organ", -rounded)
                       : fmt::format("{} ms behind the organ", rounded);
}

TargetErrors compare_with_truth(const RunResult& result, const Truth& truth) {
    TargetErrors errors;
    const TruthMatches matched = match_with_truth(result, truth);
    errors.unregistered_frames = matched.unregistered;
    errors.beyond_truth_frames = matched.beyond_truth;
    const PointSampler targets = place_targets(result, truth);
    double deepest = 0;
    for (const auto& sample : truth.samples) deepest = std::max(deepest, sample.depth);

    std::vector<TargetState> states(truth.targets.size());
    std::vector<std::size_t> moving;
    for (std::size_t i = 0; i < states.size(); ++i) {
        states[i].x = truth.targets[i].position;
        errors.series.push_back({truth.targets[i].name, {}});
        const double motion = displacement_of(truth, truth.targets[i], deepest).norm();
        errors.largest_motion_mm = std::max(errors.largest_motion_mm, 1e3 * motion);
        if (motion > moving_m) moving.push_back(i);
    }
    if (moving.empty())
        fail(
            "{}: no target of the truth moves more than {:g} mm (the most is {:.2f} mm at a press "
            "of {:.1f} mm), "
            "expected "
            "targets to judge by",
            result.source, 1e3 * moving_m, errors.largest_motion_mm, 1e3 * deepest);

    Gathered g;
    std::vector<double> ahead_ms;
    for (const TruthMatch& m : matched.matches) {
        const Pose& est = result.frames[m.frame].tracker_from_image;
        const TruthSample& sample = m.truth;
        ahead_ms.push_back(1e3 * m.ahead_s);
        const std::vector<Vector3> u = targets.sample(result.displacement(m.frame));
        for (std::size_t i = 0; i < states.size(); ++i) {
            states[i].u_est = u[i];
            states[i].u_true = displacement_of(truth, truth.targets[i], sample.depth);
            errors.series[i].error_mm.push_back(
                error_mm(est, sample.tracker_from_image, states[i], states[i].u_est));
        }
        errors.frames.push_back(m.frame);
        errors.samples.push_back(sample_errors(result.frames[m.frame].time_s, sample.depth, est,
                                               sample.tracker_from_image, states, moving));
        if (sample.depth <= at_rest_m) {
            gather_rest(g, est, truth, m, states);
            ++errors.rest.frames;
        }
        if (sample.depth < deepest_share * deepest) continue;
        gather_deepest(g, est, sample.tracker_from_image, states, moving);
        ++errors.deepest_frames;
    }
    if (errors.deepest_frames == 0)
        fail("{}: no kept frame is at the deepest press ({:.1f} mm), expected some to judge by",
             result.source, 1e3 * deepest);

    errors.targets = states.size();
    errors.moving = moving.size();
    errors.ahead_ms = distribution(std::move(ahead_ms));
    errors.deepest_press_mm = 1e3 * deepest;
    errors.rigid_mm = distribution(std::move(g.rigid));
    errors.deforming_mm = distribution(std::move(g.deforming));
    errors.registration_mm = distribution(std::move(g.registration));
    errors.deformation_mm = distribution(std::move(g.deformation));
    errors.rest.moved_mm = distribution(std::move(g.moved_at_rest));
    errors.rest.registration_mm = distribution(std::move(g.registration_at_rest));
    if (g.lag_down > 0) errors.rest.registration_lag_ms = 1e3 * g.lag_up / g.lag_down;
    measure_travel(errors.rest, truth, matched.matches);
    errors.rest.expected_rms_mm = registration_noise_mm(result, truth);
    return errors;
}

}  // namespace livetet
