#pragma once

#include <optional>

#include "geometry/transform.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// `valid`: from this frame's reference pose; `held`: the reference was lost a moment ago and the
/// last answer stands; `lost`: it has been away longer than that (the last answer is still given),
/// or was never seen.
enum class RegistrationStatus { valid, held, lost };

/// A registration that follows the organ: its fiducials M_i are fixed to a reference sensor on it,
/// so that each frame's P_i = tracker_from_reference * M_i are where the fiducials are now. The fit
/// from P to the image then is the fit from M, made once, composed with the sensor's pose:
/// image_from_tracker = image_from_reference * reference_from_tracker.
class LiveRegistration {
  public:
    /// The last answer is held for `hold_s` when the reference is lost.
    explicit LiveRegistration(const RigidTransform<ImageFrame, Reference>& image_from_reference,
                              double hold_s = 0.5);

    /// One frame: the reference sensor's pose at `time_s`. A pose that is missing or not finite
    /// holds, then loses.
    RegistrationStatus update(double time_s, const TrackedPose& reference);

    /// The newest answer; empty before the reference was first seen.
    const std::optional<RigidTransform<ImageFrame, Tracker>>& image_from_tracker() const {
        return image_from_tracker_;
    }
    RegistrationStatus status() const { return status_; }
    const RigidTransform<ImageFrame, Reference>& image_from_reference() const {
        return image_from_reference_;
    }

  private:
    double hold_s_;
    RigidTransform<ImageFrame, Reference> image_from_reference_;
    std::optional<RigidTransform<ImageFrame, Tracker>> image_from_tracker_;
    double seen_s_ = 0;
    RegistrationStatus status_ = RegistrationStatus::lost;
};

}  // namespace livetet
