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
    std::optional<std::string>
        reference;  ///< sensor on the body: stillness is judged in its frame; none: the tracker's
    double radius_mm = 2;  ///< the smoothed tip stays this near to its mean
    double min_duration_s = 2;
    double smoothing_s =
        1;  ///< the tip is averaged over a window of this length, centred, before it is judged
    double min_turn_deg = 2;  ///< a tool that turns less about its tip (RMS about its mean pose)
                              ///< lies somewhere; 0: any
    double max_scatter_mm =
        4;  ///< an explicit window whose unsmoothed tip scatters (RMS) more is refused
    double min_separation_mm =
        3;  ///< stretches that follow each other with means nearer than this are one
};

/// A stretch of a recording in which the tip rested on something.
struct Dwell {
    std::size_t first = 0, last = 0;  ///< frames, half-open
    Eigen::Vector3d tip_in_tracker =
        Eigen::Vector3d::Zero();  ///< mean over the usable frames, metres
    std::optional<Eigen::Vector3d>
        tip_in_reference;  ///< mean of reference_from_tracker * tip, metres
    double scatter =
        0;  ///< RMS distance from the mean, in the frame in which stillness is judged, metres
    double turn_deg =
        0;  ///< RMS angle between the tool's orientation and its mean, in the judged frame
    std::size_t used = 0;  ///< frames in which all tools asked for were seen
};

/// A window of frames, half-open.
struct FrameWindow {
    std::size_t first = 0, last = 0;
};

/// All stretches in which the tip (tracker_from_tip = tracker_from_tool * tool_from_tip) rests: its
/// position, averaged over `smoothing_s`, stays within `radius_mm` of the stretch's running mean
/// for at least `min_duration_s`. Frames in which a tool is not seen are passed over; one missing
/// for longer than `smoothing_s` ends a stretch. In time order. Throws Error for a tool the
/// recording does not have and for options that are not positive.
std::vector<Dwell> find_dwells(const Recording& recording,
                               const RigidTransform<Tool, Tip>& tool_from_tip,
                               const DwellOptions& options = {});

/// The same for windows known beforehand. Throws Error for a window outside the recording, one
/// without a usable frame, and one in which the tip moves: scatter above `max_scatter_mm`, or a
/// drift between the means of the window's first and last third above `radius_mm` (times 2).
std::vector<Dwell> dwells_in_windows(const Recording& recording,
                                     const RigidTransform<Tool, Tip>& tool_from_tip,
                                     std::span<const FrameWindow> windows,
                                     const DwellOptions& options = {});

/// Where the tip was in each frame of these windows (of all, where there are none) in which the
/// tools asked for were seen: in the reference sensor's frame where one is asked for, else the
/// tracker's; metres. What a tip that is led over a surface draws. Throws Error for a tool the
/// recording does not have and a window outside it.
std::vector<Eigen::Vector3d> tip_places(const Recording& recording,
                                        const RigidTransform<Tool, Tip>& tool_from_tip,
                                        std::span<const FrameWindow> windows,
                                        const DwellOptions& options = {});

}  // namespace livetet
