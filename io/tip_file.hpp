#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "geometry/pivot.hpp"
#include "geometry/spin.hpp"

namespace livetet {

/// What the calibrations of a tool found.
struct ToolTip {
    std::string tool;
    PivotCalibration pivot;
    std::optional<SpinCalibration> spin;

    /// The tip's place, and its axes along the shaft where that is known.
    RigidTransform<Tool, Tip> tool_from_tip() const {
        return spin ? along_shaft(pivot.tool_from_tip.translation, spin->shaft_in_tool)
                    : pivot.tool_from_tip;
    }
};

/// JSON: the tool, its tip's offset in mm, the shaft's direction where it is known, tool_from_tip
/// as 16 numbers by rows, and how good the calibrations were.
void write_tip(const std::filesystem::path& path, const ToolTip& tip);

/// Throws Error, naming file and key, where something is missing or of another kind.
ToolTip read_tip(const std::filesystem::path& path);
/// The tip of `tool`: throws Error, too, where the file holds that of another one.
ToolTip read_tip(const std::filesystem::path& path, const std::string& tool);

}  // namespace livetet
