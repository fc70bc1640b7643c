#pragma once

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace livetet {

/// Types of a stored voxel.
enum class ScalarType {
    uint8,
    int8,
    uint16,
    int16,
    uint32,
    int32,
    uint64,
    int64,
    float32,
    float64
};

/// Size of a voxel in bytes.
std::size_t bytes_of(ScalarType type);

/// The stored data of an image file: voxels in the machine's byte order, i fastest, and their
/// position. A voxel's value is slope * stored + intercept.
struct Volume {
    std::array<int, 3> size{0, 0, 0};
    Eigen::Matrix4d ras_from_voxel = Eigen::Matrix4d::Identity();  ///< metres
    ScalarType type = ScalarType::uint8;
    std::vector<char> bytes;
    double slope = 1, intercept = 0;
    std::map<std::int32_t, std::string> label_names{};  ///< of a segmentation that names them
};

/// Throws Error, naming the file `where` and its field `source`, if an affine (metres) is singular.
void check_spans_space(const Eigen::Matrix4d& ras_from_voxel, const std::string& where,
                       const char* source);

/// Number of voxels of an image of these sizes. Throws Error, naming `where`, if it is zero or
/// above 4e9.
std::size_t checked_voxel_count(const std::array<std::int64_t, 3>& size, const std::string& where);

}  // namespace livetet
