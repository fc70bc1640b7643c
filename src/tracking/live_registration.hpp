#pragma once

#include <Eigen/Core>

#include <optional>
#include <span>
#include <vector>

#include "geometry/transform.hpp"
#include "geometry/umeyama.hpp"
#include "tracking/sample.hpp"

namespace livetet {

/// `valid`: from this frame's reference pose; `held`: the reference was lost a moment ago and the last answer stands;
/// `lost`: it has been away longer than that (the last answer is still given), or was never seen.
enum class RegistrationStatus { valid, held, lost };

/// A registration that follows the organ: the fiducials M_i are fixed to a reference sensor on it, so that each frame's
/// P_i = tracker_from_reference * M_i are where the fiducials are now. Umeyama from P to X then is the fit from M to X
/// composed with the sensor's pose, image_from_tracker = image_from_reference * reference_from_tracker, and the fit
/// from M is made once.
class LiveRegistration {
  public:
    /// M (`fiducials_in_reference`) and X (`fiducials_in_image`) in the same order, metres. The last answer is held for
    /// `hold_s` when the reference is lost. Throws Error where `fit_points` does.
    LiveRegistration(std::vector<Eigen::Vector3d> fiducials_in_reference,
                     std::vector<Eigen::Vector3d> fiducials_in_image, double hold_s = 0.5);

    /// M_i = reference_from_tracker * P_i, for fiducials touched while the sensor was at `tracker_from_reference`.
    static std::vector<Eigen::Vector3d> fiducials_in_reference(
        std::span<const Eigen::Vector3d> fiducials_in_tracker,
        const RigidTransform<Tracker, Reference>& tracker_from_reference);

    /// One frame: the reference sensor's pose at `time_s`. A pose that is missing or not finite holds, then loses.
    RegistrationStatus update(double time_s, const TrackedPose& reference);

    /// The newest answer; empty before the reference was first seen.
    const std::optional<RigidTransform<ImageFrame, Tracker>>& image_from_tracker() const { return image_from_tracker_; }
    RegistrationStatus status() const { return status_; }
    const RigidTransform<ImageFrame, Reference>& image_from_reference() const { return image_from_reference_; }
    const Registration<ImageFrame, Reference>& registration() const { return registration_; }

    /// Where the fiducials are now, P_i, in the tracker's frame.
    std::vector<Eigen::Vector3d> fiducials_in_tracker(
        const RigidTransform<Tracker, Reference>& tracker_from_reference) const;
    const std::vector<Eigen::Vector3d>& fiducials_in_image() const { return in_image_; }

  private:
    std::vector<Eigen::Vector3d> in_reference_, in_image_;
    double hold_s_;
    Registration<ImageFrame, Reference> registration_;
    RigidTransform<ImageFrame, Reference> image_from_reference_;
    std::optional<RigidTransform<ImageFrame, Tracker>> image_from_tracker_;
    double seen_s_ = 0;
    RegistrationStatus status_ = RegistrationStatus::lost;
};

}  // namespace livetet
