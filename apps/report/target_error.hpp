#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/live/run_result.hpp"
#include "apps/phantom/truth_file.hpp"
#include "base/distribution.hpp"

namespace livetet {

/// One matched frame: RMS over the targets that move (see TargetErrors), in mm.
struct TargetErrorSample {
    double time_s = 0, press_mm = 0;  ///< the true press
    double rigid_mm = 0, deforming_mm = 0;
};

/// What the organ's motion as a whole does to the targets while nothing presses on it: it should do
/// nothing.
struct RestErrors {
    std::size_t frames = 0;
    double organ_travel_mm =
        0;  ///< the furthest that any target came from where it was first, in the tracker's frame
    double organ_turn_deg = 0;  ///< the furthest that the organ turned from how it was first
    Distribution moved_mm;      ///< |u_est| at all targets: what the model moved that did not move
    Distribution registration_mm;  ///< |T_est x - T_true x|
    double registration_lag_ms =
        0;  ///< by how much the registration runs behind the organ, least squares
    double expected_rms_mm =
        0;  ///< what the tracker's noise alone moves targets by, see registration_noise_mm

    /// The model moved targets by no more than noise explains: RMS within what is expected, worst
    /// within 3 times that.
    bool explained() const {
        return moved_mm.rms <= expected_rms_mm && moved_mm.worst <= 3 * expected_rms_mm;
    }
};

/// Errors at the hidden targets, in the tracker's frame:
///   rigid-only    |T_est x - T_true (x + u_true)|
///   deforming     |T_est (x + u_est) - T_true (x + u_true)|
///   registration  |T_est x - T_true x|           deformation  |u_est - u_true|
/// with T = tracker_from_image and x the target's rest position. The distributions are over the
/// moments of deepest press (true depth at least 95 % of the largest) and the targets that truly
/// move more than 3 mm at the deepest.
struct TargetErrors {
    std::size_t targets = 0, moving = 0;
    std::size_t deepest_frames = 0;
    double deepest_press_mm = 0, largest_motion_mm = 0;  ///< true: press, displacement of a target
    std::size_t unregistered_frames = 0;                 ///< left out: they had no registration yet
    Distribution rigid_mm, deforming_mm, registration_mm, deformation_mm;
    RestErrors rest;
    std::vector<TargetErrorSample> samples;

    /// How many times smaller the RMS error is with deformation than without.
    double gain() const { return deforming_mm.rms > 0 ? rigid_mm.rms / deforming_mm.rms : 0; }
};

/// Matches frames with the truth by time stamp. Throws Error for a frame that the truth has no
/// sample for (within 1 ms), for no frame at the deepest press, for no target that moves, and for a
/// target that lies outside the mesh by more than 10 mm.
TargetErrors compare_with_truth(const RunResult& result, const Truth& truth);

}  // namespace livetet
