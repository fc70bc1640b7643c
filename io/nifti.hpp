#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>

#include "io/volume.hpp"

/// A reader of our own, though ITK reads NIfTI too: ITK 5.2 refuses a sheared sform or takes the qform in its stead
/// without a word, takes a qform of code 1 before a sform of code 2, and a build without images still reads masks.
namespace livetet::nifti {

/// Codes of the kinds of voxel that we write.
enum class VoxelType : std::int16_t { uint8 = 2, int16 = 4, int32 = 8, float32 = 16 };

/// Throws Error where `path` is no whole NIfTI file of one three-dimensional image of plain numbers.
Volume read(const std::filesystem::path& path);

/// Writes `bytes`, little-endian voxels of `type`. Throws Error where name or sizes cannot be a NIfTI file's.
void write(const std::filesystem::path& path, const std::array<int, 3>& size, const Eigen::Matrix4d& ras_from_voxel,
           VoxelType type, std::span<const char> bytes);

}  // namespace livetet::nifti
