#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

#include "image/image.hpp"
#include "io/volume.hpp"

/// A reader of our own, though ITK reads NIfTI too: ITK 5.2 refuses a sheared sform or takes the
/// qform in its stead without a word, takes a qform of code 1 before a sform of code 2, and a build
/// without images still reads masks.
namespace livetet::nifti {

/// What a voxel holds: a number, or three.
enum class Values { scalars, vectors };

/// Throws Error where `path` is no whole NIfTI file of one three-dimensional image of plain
/// numbers.
Volume read(const std::filesystem::path& path);

/// Writes `bytes`, little-endian voxels of `type`; of `vectors`, first all of their first
/// components, then all of their second and third ones, as the five-dimensional image with intent
/// "vector" that NIfTI has for them. Throws Error where name or sizes cannot be a NIfTI file's.
void write(const std::filesystem::path& path, const ImageGrid& grid, ScalarType type,
           std::span<const char> bytes, Values values = Values::scalars);

}  // namespace livetet::nifti
