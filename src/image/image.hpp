#pragma once

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace livetet {

/// Three-dimensional image. Voxel (i, j, k) is values[i + size[0] * (j + size[1] * k)]; its centre
/// is at ras_from_voxel * (i, j, k, 1), in metres, RAS (NIfTI's world; readers convert from mm).
template <class T>
struct Image {
    std::array<int, 3> size{0, 0, 0};
    Eigen::Matrix4d ras_from_voxel = Eigen::Matrix4d::Identity();
    std::vector<T> values;

    std::size_t index(int i, int j, int k) const {
        return i + static_cast<std::size_t>(size[0]) * (j + static_cast<std::size_t>(size[1]) * k);
    }
    T& at(int i, int j, int k) { return values[index(i, j, k)]; }
    const T& at(int i, int j, int k) const { return values[index(i, j, k)]; }
    bool contains(int i, int j, int k) const {
        return i >= 0 && j >= 0 && k >= 0 && i < size[0] && j < size[1] && k < size[2];
    }
};

/// Position of an image's voxels, without values.
struct ImageGrid {
    std::array<int, 3> size{0, 0, 0};
    Eigen::Matrix4d ras_from_voxel = Eigen::Matrix4d::Identity();  ///< metres

    /// Lengths of a voxel along its three axes, metres.
    Eigen::Vector3d spacing() const {
        return ras_from_voxel.topLeftCorner<3, 3>().colwise().norm().transpose();
    }
};

template <class T>
ImageGrid grid_of(const Image<T>& image) {
    return {image.size, image.ras_from_voxel};
}

/// Bounding box of the voxel centres, metres, along the RAS axes.
inline Eigen::AlignedBox3d box_of(const ImageGrid& grid) {
    Eigen::AlignedBox3d box;
    for (int corner = 0; corner < 8; ++corner) {
        Eigen::Vector4d voxel(0, 0, 0, 1);
        for (int d = 0; d < 3; ++d) voxel[d] = corner >> d & 1 ? grid.size[d] - 1 : 0;
        box.extend((grid.ras_from_voxel * voxel).head<3>());
    }
    return box;
}

using GreyImage = Image<float>;
using LabelImage = Image<std::int32_t>;

/// Whether `chosen` contains a voxel's label; an empty `chosen` contains every label but 0.
inline bool is_picked(std::int32_t label, std::span<const std::int32_t> chosen) {
    return label != 0 &&
           (chosen.empty() || std::find(chosen.begin(), chosen.end(), label) != chosen.end());
}

}  // namespace livetet
