#pragma once

#include <filesystem>
#include <optional>

#include "io/volume.hpp"

namespace livetet {

/// Reads a NRRD (.nrrd, .nhdr) or MetaImage (.mha, .mhd) through ITK. ITK's MetaImage reader takes
/// a truncated file for a whole one, so what a file holds is measured before it is read. Throws
/// Error as `read_grey_image` says.
Volume read_itk_volume(const std::filesystem::path& path);

/// The file that its voxels lie in, itself or the one that its header names; none where they lie in
/// several.
std::optional<std::filesystem::path> itk_voxel_file(const std::filesystem::path& path);

}  // namespace livetet
