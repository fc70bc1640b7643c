#include "tracking/pose_smoother.hpp"

#include "base/error.hpp"

namespace livetet {

namespace {

/// One step backwards: the Gaussian before the time update `before -> after`, given what is known
/// of the state after it. `after` is replaced by the result.
///
///     C = P F^T (F P F^T + q Q)^-1,   m + C (m_after - F m),   P + C (P_after - F P F^T - q Q) C^T
void smooth(const MotionGaussian& before, double density, double dt, MotionGaussian& after) {
    const Eigen::Matrix2d transition = motion_transition(dt);
    const Eigen::Matrix2d predicted =
        transition * before.covariance * transition.transpose() + density * motion_noise(dt);
    const Eigen::Matrix2d gain = before.covariance * transition.transpose() * predicted.inverse();
    after.mean = before.mean + gain * (after.mean - transition * before.mean);
    after.covariance = before.covariance + gain * (after.covariance - predicted) * gain.transpose();
}

}  // namespace

PoseSmoother::PoseSmoother(const PoseEstimatorOptions& options, double lag_s)
    : estimator_(options), lag_s_(lag_s) {
    if (!(lag_s >= 0 && lag_s <= 1)) fail("pose smoother: lag_s = {} must be from 0 to 1", lag_s);
}

PoseVerdict PoseSmoother::update(double time_s, const TrackedPose& pose) {
    Step step;
    step.time_s = estimator_.state().time_s;
    step.anchor = estimator_.state().anchor;
    const PoseVerdict verdict = estimator_.update(time_s, pose);
    if (verdict == PoseVerdict::started) count_ = 0;
    if (verdict != PoseVerdict::accepted && verdict != PoseVerdict::held) return verdict;
    step.translation = estimator_.state().translation.before();
    step.rotation = estimator_.state().rotation.before();
    if (count_ == steps_.size()) {
        first_ = (first_ + 1) % steps_.size();
        --count_;
    }
    steps_[(first_ + count_++) % steps_.size()] = step;
    return verdict;
}

std::optional<PoseEstimate> PoseSmoother::smoothed() const {
    const PoseState& last = estimator_.state();
    const auto now = estimator_.predict(last.time_s);
    if (!now) return {};
    MotionMixture translation = last.translation.now(), rotation = last.rotation.now();
    double time_s = last.time_s;
    Eigen::Quaterniond anchor = last.anchor;
    for (std::size_t k = count_; k-- > 0 && time_s > last.time_s - lag_s_;) {
        const Step& step = steps_[(first_ + k) % steps_.size()];
        const double dt = time_s - step.time_s;
        const Eigen::Vector3d turn =
            rotation_vector((anchor * step.anchor.conjugate()).toRotationMatrix());
        for (int j = 0; j < motion_models; ++j) {
            smooth(step.translation[j], last.translation.options().densities[j], dt,
                   translation.models[j]);
            rotation.models[j].mean.row(0) += turn.transpose();
            smooth(step.rotation[j], last.rotation.options().densities[j], dt, rotation.models[j]);
        }
        time_s = step.time_s;
        anchor = step.anchor;
    }
    return pose_estimate(time_s, translation, rotation, anchor);
}

}  // namespace livetet
