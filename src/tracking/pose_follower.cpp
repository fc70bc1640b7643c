#include "tracking/pose_follower.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

bool is_accepted(PoseVerdict verdict) {
    return verdict == PoseVerdict::accepted || verdict == PoseVerdict::started;
}

TrackedPose pose_of(const std::optional<PoseEstimate>& estimate) {
    if (!estimate) return {.status = PoseStatus::stale};
    return {estimate->rotation, estimate->translation, PoseStatus::ok};
}

}  // namespace

PoseFollower::PoseFollower(const PoseFollowerOptions& options)
    : smoother_(options.estimator),
      ahead_s_(options.ahead_s),
      max_gap_s_(options.estimator.max_gap_s) {
    check_ahead(ahead_s_);
    if (options.filter) filter_.emplace(*options.filter);
}

void PoseFollower::check_ahead(double ahead_s) const {
    if (!(ahead_s >= 0 && ahead_s <= max_gap_s_))
        fail("pose follower: ahead_s = {} must be from 0 to {}", ahead_s, max_gap_s_);
}

PoseFollower::Result PoseFollower::update(double time_s, const TrackedPose& measured,
                                          std::optional<double> ahead_s) {
    if (ahead_s) check_ahead(*ahead_s);
    const double used_ahead_s = ahead_s.value_or(ahead_s_);
    const PoseVerdict verdict = smoother_.update(time_s, measured);
    used_.reset();
    if (verdict == PoseVerdict::unusable) return {measured, {}, verdict};
    if (verdict == PoseVerdict::repeated) return again(time_s, used_ahead_s);
    verdict_ = verdict;
    if (is_accepted(verdict)) accepted_ = measured;
    const TrackedPose pose = used_at(time_s, used_ahead_s);
    if (const auto smoothed = smoother_.smoothed()) lag_.compare(*smoothed);
    return {pose, is_accepted(verdict) ? measured : TrackedPose{}, verdict};
}

/// A sample of the same time as the last one.
PoseFollower::Result PoseFollower::again(double time_s, double ahead_s) {
    Result result{used_at(time_s, ahead_s), {}, verdict_};
    if (is_accepted(verdict_)) result.unfiltered = pose_of(estimated(time_s, 0));
    return result;
}

TrackedPose PoseFollower::used_at(double time_s, double ahead_s) {
    if (!filter_) used_ = estimated(time_s, ahead_s);
    const TrackedPose pose = filter_ ? filter_->update(time_s, accepted_) : pose_of(used_);
    if (is_usable(pose)) lag_.use(time_s, pose.translation);
    return pose;
}

std::optional<PoseEstimate> PoseFollower::estimated(double time_s, double ahead_s) const {
    const auto& accepted_s = estimator().accepted_s();
    const double latest_s = accepted_s.value_or(time_s) + max_gap_s_;
    return estimator().predict(time_s > latest_s ? time_s : std::min(time_s + ahead_s, latest_s));
}

}  // namespace livetet
