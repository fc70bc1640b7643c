#include "geometry/spin.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace livetet {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Poses = std::span<const RigidTransform<Tracker, Tool>>;

constexpr double degrees = 180 / std::numbers::pi;

// Arc around the shaft covered by the poses: 360 degrees less the largest gap between neighbours.
double covered_deg(Poses poses, const SpinCalibration& spin) {
    const Vector3d across = spin.shaft_in_tool.unitOrthogonal();
    const Vector3d x = spin.shaft_in_tracker.unitOrthogonal(), y = spin.shaft_in_tracker.cross(x);
    std::vector<double> angles;
    for (const auto& pose : poses) {
        const Vector3d turned = pose.rotation * across;
        angles.push_back(std::atan2(turned.dot(y), turned.dot(x)) * degrees);
    }
    std::sort(angles.begin(), angles.end());
    double gap = angles.front() + 360 - angles.back();
    for (std::size_t i = 1; i < angles.size(); ++i) gap = std::max(gap, angles[i] - angles[i - 1]);
    return 360 - gap;
}

double tilt_deg(Poses poses, const SpinCalibration& spin) {
    double squares = 0;
    for (const auto& pose : poses) {
        const Vector3d shaft = pose.rotation * spin.shaft_in_tool;
        const double angle =
            std::atan2(shaft.cross(spin.shaft_in_tracker).norm(), shaft.dot(spin.shaft_in_tracker));
        squares += angle * angle;
    }
    return std::sqrt(squares / static_cast<double>(poses.size())) * degrees;
}

bool points_back(const Vector3d& shaft, const std::optional<Vector3d>& tip) {
    if (tip) return shaft.dot(*tip) < 0;
    Eigen::Index largest = 0;
    shaft.cwiseAbs().maxCoeff(&largest);
    return shaft[largest] < 0;
}

}  // namespace

SpinCalibration calibrate_spin(Poses poses, const std::optional<Vector3d>& tip,
                               const SpinOptions& options) {
    if (poses.size() < options.min_poses)
        fail("spin calibration: {} poses to use, expected at least {}", poses.size(),
             options.min_poses);
    Matrix3d mean = Matrix3d::Zero();
    for (std::size_t i = 0; i < poses.size(); ++i) {
        if (!poses[i].rotation.allFinite())
            fail("spin calibration: pose {} of {} is not finite", i + 1, poses.size());
        mean += poses[i].rotation / static_cast<double>(poses.size());
    }
    const Eigen::JacobiSVD<Matrix3d> svd(mean, Eigen::ComputeFullU | Eigen::ComputeFullV);
    SpinCalibration spin{svd.matrixV().col(0), svd.matrixU().col(0)};
    if (points_back(spin.shaft_in_tool, tip)) {
        spin.shaft_in_tool = -spin.shaft_in_tool;
        spin.shaft_in_tracker = -spin.shaft_in_tracker;
    }
    spin.used = poses.size();
    spin.turn_deg = covered_deg(poses, spin);
    spin.tilt_deg = tilt_deg(poses, spin);
    if (spin.tilt_deg > options.max_tilt_deg)
        fail(
            "spin calibration: the shaft tilts by {:.1f} degrees (RMS), expected at most {}: turn "
            "the tool about its own shaft only",
            spin.tilt_deg, options.max_tilt_deg);
    if (spin.turn_deg < options.min_turn_deg)
        fail(
            "spin calibration: the poses cover {:.1f} degrees round the shaft, expected at least "
            "{}",
            spin.turn_deg, options.min_turn_deg);
    return spin;
}

RigidTransform<Tool, Tip> along_shaft(const Vector3d& tip_in_tool, const Vector3d& shaft_in_tool) {
    const Vector3d z = shaft_in_tool.normalized();
    const double parallel = std::cos(20 / degrees);
    const Vector3d secondary = std::abs(z.x()) > parallel ? Vector3d::UnitY() : Vector3d::UnitX();
    RigidTransform<Tool, Tip> tool_from_tip;
    const Vector3d x = (secondary - secondary.dot(z) * z).normalized();
    tool_from_tip.rotation << x, z.cross(x), z;
    tool_from_tip.translation = tip_in_tool;
    return tool_from_tip;
}

}  // namespace livetet
