#pragma once

#include <filesystem>

namespace livetet {

/// Checks that a .ply file, ascii or binary, has every row that its header announces. VTK's reader
/// does not detect a truncated file and repeats old values. Throws Error if the header is malformed
/// or a row is incomplete.
void check_ply_is_whole(const std::filesystem::path& path);

}  // namespace livetet
