#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/live/run_result.hpp"
#include "apps/phantom/truth_file.hpp"
#include "base/distribution.hpp"

namespace livetet {

/// A matched frame: RMS over the targets that move (see TargetErrors), mm.
struct TargetErrorSample {
    double time_s = 0, press_mm = 0;  ///< true press
    double rigid_mm = 0, deforming_mm = 0;
};

/// A target's errors with deformation (see TargetErrors) in all frames of TargetErrors::frames, mm.
struct TargetErrorSeries {
    std::string name;
    std::vector<double> error_mm;
};

/// Effect of rigid motion of the organ on the targets while nothing presses on it: there should be
/// none.
struct RestErrors {
    std::size_t frames = 0;
    double organ_travel_mm =
        0;  ///< largest distance of a target from its first position, in the tracker's frame
    double organ_turn_deg = 0;       ///< largest rotation of the organ from its first orientation
    Distribution moved_mm;           ///< |u_est| at all targets: spurious motion of the model
    Distribution registration_mm;    ///< |T_est x - T_true x|
    double registration_lag_ms = 0;  ///< lag of the registration behind the organ, least squares;
                                     ///< negative: it is ahead
    double expected_rms_mm = 0;  ///< error by the tracker's noise alone, see registration_noise_mm

    /// Whether noise explains the model's motion of targets: RMS within the expected value, worst
    /// within three times that.
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
    double deepest_press_mm = 0,
           largest_motion_mm = 0;         ///< true press, and true displacement of a target
    std::size_t unregistered_frames = 0;  ///< left out, as there was no registration yet
    std::size_t beyond_truth_frames =
        0;                  ///< left out, as predicted to a time after the truth's end
    Distribution ahead_ms;  ///< from a frame's sample to the time of the truth it is compared with
    Distribution rigid_mm, deforming_mm, registration_mm, deformation_mm;
    RestErrors rest;
    std::vector<TargetErrorSample> samples;
    std::vector<std::size_t> frames;        ///< those of the result that were compared
    std::vector<TargetErrorSeries> series;  ///< of each target, moving or not

    /// Ratio of the RMS errors without and with deformation.
    double gain() const { return deforming_mm.rms > 0 ? rigid_mm.rms / deforming_mm.rms : 0; }
};

/// "3 ms behind the organ", "25 ms ahead of the organ": a lag, rounded.
std::string lag_text(double lag_ms);

/// Compares frames with the truth at the times that they are meant for (see match_with_truth).
/// Throws Error if a frame has no true sample within 1 ms, no frame is at the deepest press, no
/// target moves, or a target lies more than 10 mm outside the mesh.
TargetErrors compare_with_truth(const RunResult& result, const Truth& truth);

}  // namespace livetet
