#pragma once

#include <filesystem>

#include "io/volume.hpp"

namespace livetet {

/// Reads a NRRD (.nrrd, .nhdr) or MetaImage (.mha, .mhd) through ITK. ITK's MetaImage reader takes a truncated file for
/// a whole one, so what a file holds is measured before it is read. Throws Error as `read_grey_image` says.
Volume read_itk_volume(const std::filesystem::path& path);

}  // namespace livetet
