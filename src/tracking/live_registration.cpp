#include "tracking/live_registration.hpp"

#include <utility>

#include "tracking/poses.hpp"

namespace livetet {

LiveRegistration::LiveRegistration(std::vector<Eigen::Vector3d> fiducials_in_reference,
                                   std::vector<Eigen::Vector3d> fiducials_in_image, double hold_s)
    : in_reference_(std::move(fiducials_in_reference)),
      in_image_(std::move(fiducials_in_image)),
      hold_s_(hold_s),
      registration_(register_points<ImageFrame, Reference>(in_reference_, in_image_, Scaling::rigid)),
      image_from_reference_(rigid_part(registration_.to_from_from)) {
    if (!(hold_s >= 0)) fail("live registration: hold_s = {} must be >= 0", hold_s);
}

std::vector<Eigen::Vector3d> LiveRegistration::fiducials_in_reference(
    std::span<const Eigen::Vector3d> fiducials_in_tracker,
    const RigidTransform<Tracker, Reference>& tracker_from_reference) {
    const auto reference_from_tracker = tracker_from_reference.inverse();
    std::vector<Eigen::Vector3d> result;
    for (const Eigen::Vector3d& p : fiducials_in_tracker) result.push_back(reference_from_tracker * p);
    return result;
}

RegistrationStatus LiveRegistration::update(double time_s, const TrackedPose& reference) {
    if (is_usable(reference)) {
        image_from_tracker_ = image_from_reference_ * tracker_from<Reference>(reference).inverse();
        seen_s_ = time_s;
        return status_ = RegistrationStatus::valid;
    }
    const bool recent = image_from_tracker_ && time_s - seen_s_ <= hold_s_;
    return status_ = recent ? RegistrationStatus::held : RegistrationStatus::lost;
}

std::vector<Eigen::Vector3d> LiveRegistration::fiducials_in_tracker(
    const RigidTransform<Tracker, Reference>& tracker_from_reference) const {
    std::vector<Eigen::Vector3d> result;
    for (const Eigen::Vector3d& m : in_reference_) result.push_back(tracker_from_reference * m);
    return result;
}

}  // namespace livetet
