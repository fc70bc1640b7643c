#include "image/mask_selection.hpp"

#include <Eigen/Dense>

#include <cmath>

#include "base/error.hpp"

namespace livetet {

std::vector<std::int32_t> nodes_in_mask(const TetMesh& mesh, const LabelImage& mask,
                                        NodeScope scope) {
    const Eigen::Matrix4d& ras_from_voxel = mask.ras_from_voxel;
    const double voxel_volume = std::abs(ras_from_voxel.topLeftCorner<3, 3>().determinant());
    if (!(voxel_volume > 0))
        fail("mask image: its affine is singular, expected three independent axes");
    const Eigen::Matrix4d voxel_from_ras = ras_from_voxel.inverse();
    return select_nodes(mesh, scope, [&](const Vector3& x) {
        const Vector3 voxel = (voxel_from_ras * x.homogeneous()).head<3>();
        for (int d = 0; d < 3; ++d)
            if (!(voxel[d] >= -0.5 && voxel[d] < mask.size[d] - 0.5)) return false;
        const Eigen::Vector3i v = (voxel.array() + 0.5).floor().cast<int>();
        return mask.at(v[0], v[1], v[2]) != 0;
    });
}

}  // namespace livetet
