#pragma once

#include <optional>

#include "geometry/transform.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// State of the registration.
/// - `valid`: computed from the current frame's reference pose.
/// - `held`: the reference is lost for less than the hold time; the last result stands.
/// - `lost`: the reference is lost for longer (the last result is still returned) or was never
///   seen.
enum class RegistrationStatus { valid, held, lost };

/// Registration that follows the organ through a reference sensor fixed to it. The fiducials M_i
/// are known in the sensor's frame, so their current positions are tracker_from_reference * M_i.
/// The fit from M_i to the image is made once; each frame composes it with the sensor's pose:
///
///     image_from_tracker = image_from_reference * reference_from_tracker
class LiveRegistration {
  public:
    /// `hold_s`: how long the last result is held when the reference is lost, seconds.
    explicit LiveRegistration(const RigidTransform<ImageFrame, Reference>& image_from_reference,
                              double hold_s = 0.5);

    /// Processes one frame: the reference sensor's pose at `time_s`. A pose that is missing or not
    /// finite counts as lost.
    RegistrationStatus update(double time_s, const TrackedPose& reference);

    /// The latest result; empty before the reference was first seen.
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
