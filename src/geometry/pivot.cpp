#include "geometry/pivot.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Pose = RigidTransform<Tracker, Tool>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr int max_rounds = 20;
constexpr std::size_t max_compared = 1500;  // poses compared pairwise for their spread

// Largest rotation angle between two poses, from tr(R_i^T R_j) = 1 + 2 cos(angle). Of more than
// `max_compared` poses only every n-th is compared.
double angular_spread_deg(const std::vector<Pose>& poses) {
    const std::size_t stride = 1 + poses.size() / max_compared;
    double min_trace = 3;
    for (std::size_t i = 0; i < poses.size(); i += stride)
        for (std::size_t j = i + stride; j < poses.size(); j += stride)
            min_trace =
                std::min(min_trace, poses[i].rotation.cwiseProduct(poses[j].rotation).sum());
    return std::acos(std::clamp((min_trace - 1) / 2, -1.0, 1.0)) * 180 / std::numbers::pi;
}

void check_poses(const std::vector<Pose>& poses, const PivotOptions& options) {
    if (poses.size() < options.min_poses)
        fail("pivot calibration: {} poses to use, expected at least {}", poses.size(),
             options.min_poses);
    for (std::size_t i = 0; i < poses.size(); ++i)
        if (!poses[i].rotation.allFinite() || !poses[i].translation.allFinite())
            fail("pivot calibration: pose {} of {} is not finite", i + 1, poses.size());
    const double spread = angular_spread_deg(poses);
    if (spread < options.min_spread_deg)
        fail(
            "pivot calibration: the poses turn by {:.1f} degrees at most, expected at least {:.1f}",
            spread, options.min_spread_deg);
}

Eigen::Matrix<double, 3, 6> pivot_rows(const Pose& pose) {
    Eigen::Matrix<double, 3, 6> rows;
    rows << pose.rotation, -Matrix3d::Identity();
    return rows;
}

Matrix6d normal_matrix(const std::vector<Pose>& poses) {
    Matrix6d normal = Matrix6d::Zero();
    for (const Pose& pose : poses) normal += pivot_rows(pose).transpose() * pivot_rows(pose);
    return normal;
}

PivotCalibration solve(const std::vector<Pose>& poses, const PivotOptions& options) {
    // Solves R tip - pivot = -t by the normal equations. Systems too ill-conditioned for them are
    // refused below.
    Vector6d right = Vector6d::Zero();
    for (const Pose& pose : poses) right -= pivot_rows(pose).transpose() * pose.translation;
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(normal_matrix(poses));
    const Vector6d values =
        eigen.eigenvalues().cwiseMax(0).cwiseSqrt().reverse();  // singular values of the rows
    PivotCalibration result;
    result.rank =
        static_cast<int>((values.array() > options.min_singular_ratio * values[0]).count());
    result.condition = values[0] / values[5];
    if (result.rank < 6)
        fail(
            "pivot calibration: the poses determine {} of 6 unknowns (smallest singular value "
            "{:.2g} of the largest, expected at least {}): turn the tool about more than one axis",
            result.rank, values[5] / values[0], options.min_singular_ratio);
    const Vector6d x =
        eigen.eigenvectors() *
        (eigen.eigenvectors().transpose() * right).cwiseQuotient(eigen.eigenvalues());
    result.tool_from_tip.translation = x.head<3>();
    result.pivot_in_tracker = x.tail<3>();
    return result;
}

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

std::vector<double> distances(const std::vector<Pose>& poses, const PivotCalibration& fit) {
    std::vector<double> d;
    for (const Pose& pose : poses)
        d.push_back((pose * fit.tool_from_tip.translation - fit.pivot_in_tracker).norm());
    return d;
}

// Median plus `sigmas` robust deviations (1.4826 times the median absolute deviation), so that
// outliers do not mask each other. The nanometre keeps exact data.
double limit_of(const std::vector<double>& d, double sigmas) {
    const double centre = median(d);
    std::vector<double> deviation;
    for (const double value : d) deviation.push_back(std::abs(value - centre));
    return centre + sigmas * 1.4826 * median(deviation) + 1e-9;
}

// Sum of the correlations rho_k of residuals k poses apart, over all k from -n to n. It ends at the
// first k whose rho is within two standard deviations of that of independent residuals.
double sum_of_correlations(const std::vector<Pose>& poses, const PivotCalibration& fit) {
    std::vector<Vector3d> residuals;
    double squares = 0;
    for (const Pose& pose : poses) {
        residuals.push_back(pose * fit.tool_from_tip.translation - fit.pivot_in_tracker);
        squares += residuals.back().squaredNorm();
    }
    const double chance = 2 / std::sqrt(3.0 * static_cast<double>(poses.size()));
    double sum = 1;
    for (std::size_t k = 1; k < residuals.size(); ++k) {
        double products = 0;
        for (std::size_t i = k; i < residuals.size(); ++i)
            products += residuals[i].dot(residuals[i - k]);
        if (!(products > chance * squares)) break;
        sum += 2 * products / squares;
    }
    return sum;
}

}  // namespace

PivotCalibration calibrate_pivot(std::span<const Pose> tracker_from_tool,
                                 const PivotOptions& options) {
    std::vector<Pose> poses(tracker_from_tool.begin(), tracker_from_tool.end());
    check_poses(poses, options);
    PivotCalibration result = solve(poses, options);
    std::vector<double> d = distances(poses, result);
    for (int round = 0; options.reject_beyond_sigma && round < max_rounds; ++round) {
        const double limit = limit_of(d, *options.reject_beyond_sigma);
        std::vector<Pose> kept;
        for (std::size_t i = 0; i < poses.size(); ++i)
            if (d[i] <= limit) kept.push_back(poses[i]);
        if (kept.size() == poses.size()) break;
        poses = std::move(kept);
        check_poses(poses, options);
        result = solve(poses, options);
        d = distances(poses, result);
    }
    double sum = 0;
    for (const double value : d) sum += value * value;
    const auto used = static_cast<double>(poses.size());
    result.covariance =
        sum_of_correlations(poses, result) * sum / (3 * used - 6) * normal_matrix(poses).inverse();
    result.rms = std::sqrt(sum / used);
    result.used = poses.size();
    result.rejected = tracker_from_tool.size() - poses.size();
    result.spread_deg = angular_spread_deg(poses);
    return result;
}

}  // namespace livetet
