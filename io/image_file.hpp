#pragma once

#include <filesystem>

#include "mesh/image.hpp"

namespace livetet {

/// Reads a NIfTI image (.nii, .nii.gz; versions 1 and 2, either byte order) with its intensity scaling. The affine is
/// the sform, else the qform, else the spacing alone; millimetres (or the unit that the file states) become metres.
/// Throws Error where the file is missing, truncated, damaged, has another ending, more than three dimensions or
/// colours, an affine that flattens space, or a voxel that is not finite.
GreyImage read_grey_image(const std::filesystem::path& path);

/// The same for labels: every voxel must be a whole number of 32 bits.
LabelImage read_label_image(const std::filesystem::path& path);

/// Writes a NIfTI 1 image (.nii, or compressed .nii.gz) in mm, with sform and, where axes are square to each other,
/// qform. Grey values as float; labels as 8, 16 or 32 bit integers, the smallest that fits.
void write_image(const std::filesystem::path& path, const GreyImage& image);
void write_image(const std::filesystem::path& path, const LabelImage& image);

}  // namespace livetet
