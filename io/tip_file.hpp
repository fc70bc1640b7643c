#pragma once

#include <filesystem>
#include <string>

#include "geometry/pivot.hpp"

namespace livetet {

/// JSON: the tool, its tip's offset in mm, and how good the calibration was.
void write_tip(const std::filesystem::path& path, const std::string& tool, const PivotCalibration& calibration);

/// A tool tip's offset as `livetet calibrate pivot` wrote it.
struct ToolTip {
    std::string tool;
    RigidTransform<Tool, Tip> tool_from_tip;
};

/// Throws Error, naming file and key, where something is missing or of another kind.
ToolTip read_tip(const std::filesystem::path& path);

}  // namespace livetet
