#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "geometry/transform.hpp"
#include "tracking/sample.hpp"

namespace livetet {

struct DwellOptions {
    std::string tool = "Stylus";
    /// Sensor on the body, in whose frame stillness is judged; none: the tracker's frame.
    std::optional<std::string> reference;
    double radius_mm = 2;  ///< maximum distance of the smoothed tip from its mean
    double min_duration_s = 2;
    /// Length of the centred window over which the tip is averaged before it is judged.
    double smoothing_s = 1;
    /// A tool whose RMS rotation from its mean orientation is less lies unheld on something and
    /// does not count as a dwell; 0: accept any.
    double min_turn_deg = 2;
    /// `dwells_in_windows` rejects a window in which the unsmoothed tip has a larger RMS scatter.
    double max_scatter_mm = 4;
    /// Consecutive dwells whose means are closer than this are merged.
    double min_separation_mm = 3;
};

/// A stretch of a recording in which the tip rested on one point.
struct Dwell {
    std::size_t first = 0, last = 0;  ///< frames [first, last)
    /// Mean over the frames used, metres.
    Eigen::Vector3d tip_in_tracker = Eigen::Vector3d::Zero();
    /// Mean of reference_from_tracker * tip over the frames used, metres; empty without a
    /// reference.
    std::optional<Eigen::Vector3d> tip_in_reference;
    /// RMS distance of the tip from its mean in the frame in which stillness is judged, metres.
    double scatter = 0;
    /// RMS angle between the tool's orientation and its mean in the frame in which stillness is
    /// judged.
    double turn_deg = 0;
    /// Mean of the tool's rotation over the frames used, in the frame in which stillness is judged:
    /// reference_from_tool with a reference, else tracker_from_tool. A mean of rotations, which is
    /// shorter than a rotation.
    Eigen::Matrix3d mean_turn = Eigen::Matrix3d::Identity();
    std::size_t used = 0;  ///< frames with a usable pose of the tool and the reference
};

/// A window of frames [first, last).
struct FrameWindow {
    std::size_t first = 0, last = 0;
};

/// Stretches in which the tip rested: dwells, and those in which the tool lay still.
struct Rests {
    std::vector<Dwell> dwells, unheld;
};

/// Finds all dwells, in time order: stretches in which the tip (tracker_from_tip =
/// tracker_from_tool * tool_from_tip), averaged over `smoothing_s`, stays within `radius_mm` of the
/// stretch's running mean for at least `min_duration_s`. Frames without a usable pose are skipped;
/// a gap longer than `smoothing_s` ends a stretch. Throws Error for a tool that the recording does
/// not have and for options that are not positive.
std::vector<Dwell> find_dwells(const Recording& recording,
                               const RigidTransform<Tool, Tip>& tool_from_tip,
                               const DwellOptions& options = {});

/// The same, with the stretches in which the tool turned by less than `min_turn_deg`.
Rests find_rests(const Recording& recording, const RigidTransform<Tool, Tip>& tool_from_tip,
                 const DwellOptions& options = {});

/// The dwells of given windows. Throws Error for a window outside the recording, a window without a
/// usable frame, and a window in which the tip moves: scatter above `max_scatter_mm`, or a drift
/// between the means of its first and last third above 2 * `radius_mm`.
std::vector<Dwell> dwells_in_windows(const Recording& recording,
                                     const RigidTransform<Tool, Tip>& tool_from_tip,
                                     std::span<const FrameWindow> windows,
                                     const DwellOptions& options = {});

/// The tip's positions (metres) in each usable frame of the windows, or of the whole recording if
/// there are none; in the reference sensor's frame if a reference is given, else the tracker's.
/// Used for a tip that is moved over a surface. Throws Error for a tool that the recording does not
/// have and for a window outside it.
std::vector<Eigen::Vector3d> tip_places(const Recording& recording,
                                        const RigidTransform<Tool, Tip>& tool_from_tip,
                                        std::span<const FrameWindow> windows,
                                        const DwellOptions& options = {});

}  // namespace livetet
