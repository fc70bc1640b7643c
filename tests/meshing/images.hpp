#pragma once

#include <Eigen/Geometry>

#include <functional>

#include "image/image.hpp"

/// Label images for tests.
namespace livetet::shapes {

/// An image of `size` voxels with the affine `ras_from_voxel` (metres); each voxel is label(its
/// centre).
inline LabelImage label_image(std::array<int, 3> size, const Eigen::Matrix4d& ras_from_voxel,
                              const std::function<int(const Eigen::Vector3d&)>& label) {
    LabelImage image{size, ras_from_voxel, {}};
    for (int k = 0; k < size[2]; ++k)
        for (int j = 0; j < size[1]; ++j)
            for (int i = 0; i < size[0]; ++i)
                image.values.push_back(
                    label((ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>()));
    return image;
}

/// An image with voxels of `spacing_mm`, rotated by `rotation`, centred at the origin.
inline Eigen::Matrix4d centred_affine(
    std::array<int, 3> size, const Eigen::Vector3d& spacing_mm,
    const Eigen::Matrix3d& rotation = Eigen::Matrix3d::Identity()) {
    Eigen::Matrix4d affine = Eigen::Matrix4d::Identity();
    affine.topLeftCorner<3, 3>() = 1e-3 * rotation * spacing_mm.asDiagonal();
    const Eigen::Vector3d middle(0.5 * (size[0] - 1), 0.5 * (size[1] - 1), 0.5 * (size[2] - 1));
    affine.topRightCorner<3, 1>() = -affine.topLeftCorner<3, 3>() * middle;
    return affine;
}

}  // namespace livetet::shapes
