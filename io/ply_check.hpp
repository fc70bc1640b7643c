#pragma once

#include <filesystem>

namespace livetet {

/// Steps over every row that the header of a .ply file announces, ascii or binary. VTK's reader
/// does not see where a file ends: it takes what it read before for what is missing. Throws Error
/// where the header is malformed or a row is not whole.
void check_ply_is_whole(const std::filesystem::path& path);

}  // namespace livetet
