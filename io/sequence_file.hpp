#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "tracking/sample.hpp"

namespace livetet {

/// Reads the tracker's part of a PLUS sequence file (.mha, .mhd, .nrrd); pixels are ignored,
/// compressed or not. `StylusToTracker` becomes the tool "Stylus"; transforms into other frames are
/// skipped. Millimetres become metres and rotations are re-orthonormalised; a matrix that is not
/// finite or not rigid makes the pose broken, a tool without a field in a frame is missing there.
/// Throws Error, with frame and field, where the file is truncated or malformed, holds no tool, or
/// its time stamps go backwards.
Recording read_sequence(const std::filesystem::path& path);

/// Whether a sequence can hold a tool of this name: it is not empty and has no blanks, '=' and ':'.
bool is_sequence_tool(std::string_view name);

/// Writes a recording as PLUS does without images (`.igs.mha`), so that PLUS and `read_sequence`
/// can read it. Throws Error where the name does not end in .mha, or the recording is one that
/// `read_sequence` would refuse.
void write_sequence(const std::filesystem::path& path, const Recording& recording);

}  // namespace livetet
