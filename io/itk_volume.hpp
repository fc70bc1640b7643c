#pragma once

#include <filesystem>
#include <optional>

#include "io/volume.hpp"

namespace livetet {

/// Reads a NRRD (.nrrd, .nhdr) or MetaImage (.mha, .mhd) through ITK. Checks the size of the data
/// first, because ITK's MetaImage reader accepts truncated files. Throws Error as `read_grey_image`
/// does.
Volume read_itk_volume(const std::filesystem::path& path);

/// The file with the voxels: `path` itself or the one that its header names; none if they are in
/// several files.
std::optional<std::filesystem::path> itk_voxel_file(const std::filesystem::path& path);

}  // namespace livetet
