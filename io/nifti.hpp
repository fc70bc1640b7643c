#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace livetet::nifti {

/// Codes of the kinds of voxel that we write.
enum class VoxelType : std::int16_t { uint8 = 2, int16 = 4, int32 = 8, float32 = 16 };

/// A NIfTI file's voxels, scaled as its header says, and where they lie: in the file's own order, i fastest.
struct Volume {
    std::array<int, 3> size;
    Eigen::Matrix4d ras_from_voxel;  ///< metres
    std::vector<double> values;
};

/// Throws Error where `path` is no whole NIfTI file of one three-dimensional image of plain numbers.
Volume read(const std::filesystem::path& path);

/// Writes `bytes`, little-endian voxels of `type`. Throws Error where name or sizes cannot be a NIfTI file's.
void write(const std::filesystem::path& path, const std::array<int, 3>& size, const Eigen::Matrix4d& ras_from_voxel,
           VoxelType type, std::span<const char> bytes);

}  // namespace livetet::nifti
