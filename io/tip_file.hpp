#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "geometry/pivot.hpp"
#include "geometry/spin.hpp"

namespace livetet {

/// Result of a tool's calibrations.
struct ToolTip {
    std::string tool;
    PivotCalibration pivot;
    std::optional<SpinCalibration> spin;
    /// Covariance of the tip's position in the tool's frame, m^2: the tip's part of that of the
    /// pivot calibration. Empty if it is not known, as in files of 0.1.0.
    std::optional<Eigen::Matrix3d> covariance{};

    /// Pose of the tip, with axes along the shaft if it was calibrated.
    RigidTransform<Tool, Tip> tool_from_tip() const {
        return spin ? along_shaft(pivot.tool_from_tip.translation, spin->shaft_in_tool)
                    : pivot.tool_from_tip;
    }
};

/// Writes JSON: the tool, the tip's offset in mm, the shaft's direction if it is known,
/// tool_from_tip as 16 numbers by rows, the quality of the calibrations, and the tip's covariance
/// (mm^2) as 9 numbers by rows if it is known.
void write_tip(const std::filesystem::path& path, const ToolTip& tip);

/// Reads the file; `pivot.covariance` is not in it. Throws Error, naming file and key, if a value
/// is missing or of another type, or if the covariance is none.
ToolTip read_tip(const std::filesystem::path& path);
/// The same; also throws Error if the file belongs to another tool.
ToolTip read_tip(const std::filesystem::path& path, const std::string& tool);

}  // namespace livetet
