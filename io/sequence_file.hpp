#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "tracking/sample.hpp"

namespace livetet {

/// Reads the tracker poses of a PLUS sequence file (.mha, .mhd, .nrrd), ignoring the pixels.
/// `StylusToTracker` becomes the tool "Stylus"; transforms to other frames are skipped. Poses are
/// in metres with re-orthonormalised rotations. A matrix that is not finite or not rigid makes the
/// pose broken; a tool without a field in a frame is missing in it. Throws Error, with frame and
/// field, if the file is truncated or malformed, has no tool, or its time stamps decrease.
Recording read_sequence(const std::filesystem::path& path);

/// Whether a sequence can store a tool of this name: not empty, and without blanks, '=' and ':'.
bool is_sequence_tool(std::string_view name);

/// Writes a recording as PLUS does without images (`.igs.mha`), readable by PLUS and
/// `read_sequence`. Throws Error if the extension is not .mha or `read_sequence` would reject the
/// recording.
void write_sequence(const std::filesystem::path& path, const Recording& recording);

}  // namespace livetet
