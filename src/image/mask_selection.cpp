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

void check_mask_reaches(const LabelImage& mask, std::span<const Vector3> positions) {
    Eigen::AlignedBox3d body, covered;
    for (const Vector3& x : positions) body.extend(x);
    const Vector3 half = Vector3::Constant(0.5) * grid_of(mask).spacing().maxCoeff();
    std::size_t n = 0;
    for (int k = 0; k < mask.size[2]; ++k)
        for (int j = 0; j < mask.size[1]; ++j)
            for (int i = 0; i < mask.size[0]; ++i)
                if (mask.values[n++] != 0) {
                    const Vector3 x = (mask.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>();
                    if (Eigen::AlignedBox3d(x - half, x + half).intersects(body)) return;
                    covered.extend(x);
                }
    const auto text = [](const Vector3& x) {
        return fmt::format("({:.1f}, {:.1f}, {:.1f})", 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
    };
    if (covered.isEmpty()) fail("mask: every voxel is 0, expected a mask of something");
    fail("mask: it covers {} to {} mm, the body spans {} to {} mm: are both in the same world?",
         text(covered.min()), text(covered.max()), text(body.min()), text(body.max()));
}

}  // namespace livetet
