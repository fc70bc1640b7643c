#include "tracking/live_registration.hpp"

#include "tracking/poses.hpp"

namespace livetet {

LiveRegistration::LiveRegistration(
    const RigidTransform<ImageFrame, Reference>& image_from_reference, double hold_s)
    : hold_s_(hold_s), image_from_reference_(image_from_reference) {
    if (!(hold_s >= 0)) fail("live registration: hold_s = {} must be >= 0", hold_s);
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

}  // namespace livetet
