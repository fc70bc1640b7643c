#include "tracking/pose_follower.hpp"

#include "base/error.hpp"

namespace livetet {

PoseFollower::PoseFollower(const PoseFollowerOptions& options)
    : smoother_(options.estimator), ahead_s_(options.ahead_s) {
    if (!(ahead_s_ >= 0)) fail("pose follower: ahead_s = {} must be >= 0", ahead_s_);
    if (options.filter) filter_.emplace(*options.filter);
}

PoseFollower::Result PoseFollower::update(double time_s, const TrackedPose& measured) {
    const PoseVerdict verdict = smoother_.update(time_s, measured);
    if (verdict == PoseVerdict::unusable) return {measured, verdict};
    const TrackedPose pose = pose_at(time_s, measured, verdict);
    lag_.use(time_s, pose.translation);
    if (const auto smoothed = smoother_.smoothed()) lag_.compare(*smoothed);
    return {pose, verdict};
}

TrackedPose PoseFollower::pose_at(double time_s, const TrackedPose& measured, PoseVerdict verdict) {
    if (!filter_) return estimated(time_s);
    if (verdict != PoseVerdict::held) accepted_ = measured;
    return filter_->update(time_s, accepted_);
}

TrackedPose PoseFollower::estimated(double time_s) const {
    auto estimate = estimator().predict(time_s + ahead_s_);
    if (!estimate) estimate = estimator().predict(time_s);
    if (!estimate) return {.status = PoseStatus::stale};
    return {estimate->rotation, estimate->translation, PoseStatus::ok};
}

}  // namespace livetet
