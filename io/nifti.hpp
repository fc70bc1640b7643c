#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

#include "image/image.hpp"
#include "io/volume.hpp"

/// NIfTI reader and writer. Not ITK's, because ITK 5.2 refuses a sheared sform or silently uses the
/// qform instead, prefers a qform of code 1 to a sform of code 2, and is absent from builds without
/// images, which still read masks.
namespace livetet::nifti {

/// Number of values in a voxel: one or three.
enum class Values { scalars, vectors };

/// Reads a file. Throws Error unless it is a complete NIfTI file of one three-dimensional image of
/// scalars.
Volume read(const std::filesystem::path& path);

/// Writes little-endian voxels of `type`. For `vectors`, `bytes` has all first components, then all
/// second and third ones; the file is the five-dimensional image with NIfTI's vector intent. Throws
/// Error if the extension or the sizes do not fit a NIfTI file.
void write(const std::filesystem::path& path, const ImageGrid& grid, ScalarType type,
           std::span<const char> bytes, Values values = Values::scalars);

}  // namespace livetet::nifti
