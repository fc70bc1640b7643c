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

    /// Pose of the tip, with axes along the shaft if it was calibrated.
    RigidTransform<Tool, Tip> tool_from_tip() const {
        return spin ? along_shaft(pivot.tool_from_tip.translation, spin->shaft_in_tool)
                    : pivot.tool_from_tip;
    }
};

/// Writes JSON: the tool, the tip's offset in mm, the shaft's direction if it is known,
/// tool_from_tip as 16 numbers by rows, and the quality of the calibrations.
void write_tip(const std::filesystem::path& path, const ToolTip& tip);

/// Reads the file. Throws Error, naming file and key, if a value is missing or of another type.
ToolTip read_tip(const std::filesystem::path& path);
/// The same; also throws Error if the file belongs to another tool.
ToolTip read_tip(const std::filesystem::path& path, const std::string& tool);

}  // namespace livetet
