#include "mesh/node_selection.hpp"

#include <Eigen/Dense>

#include <cmath>
#include <numeric>

#include "base/error.hpp"

namespace livetet {

namespace {

template <class Predicate>
std::vector<std::int32_t> select(const TetMesh& mesh, NodeScope scope, const Predicate& inside) {
    std::vector<std::int32_t> candidates;
    if (scope == NodeScope::surface_only) {
        candidates = nodes_of(boundary_triangles(mesh.tets));
    } else {
        candidates.resize(mesh.nodes.size());
        std::iota(candidates.begin(), candidates.end(), 0);
    }
    std::erase_if(candidates, [&](std::int32_t n) { return !inside(mesh.nodes[n]); });
    return candidates;
}

}  // namespace

std::vector<std::int32_t> nodes_in_mask(const TetMesh& mesh, const LabelImage& mask,
                                        NodeScope scope) {
    const Eigen::Matrix4d& ras_from_voxel = mask.ras_from_voxel;
    const double voxel_volume = std::abs(ras_from_voxel.topLeftCorner<3, 3>().determinant());
    if (!(voxel_volume > 0))
        fail("mask image: its affine is singular, expected three independent axes");
    const Eigen::Matrix4d voxel_from_ras = ras_from_voxel.inverse();
    return select(mesh, scope, [&](const Vector3& x) {
        const Vector3 voxel = (voxel_from_ras * x.homogeneous()).head<3>();
        for (int d = 0; d < 3; ++d)
            if (!(voxel[d] >= -0.5 && voxel[d] < mask.size[d] - 0.5)) return false;
        const Eigen::Vector3i v = (voxel.array() + 0.5).floor().cast<int>();
        return mask.at(v[0], v[1], v[2]) != 0;
    });
}

std::vector<std::int32_t> nodes_in_box(const TetMesh& mesh, const Vector3& low, const Vector3& high,
                                       NodeScope scope) {
    if (!(low.array() <= high.array()).all())
        fail("box: from ({}) to ({}) mm is empty, expected low <= high along each axis",
             fmt::format("{:.2f}, {:.2f}, {:.2f}", 1e3 * low.x(), 1e3 * low.y(), 1e3 * low.z()),
             fmt::format("{:.2f}, {:.2f}, {:.2f}", 1e3 * high.x(), 1e3 * high.y(), 1e3 * high.z()));
    const Eigen::AlignedBox3d box(low, high);
    return select(mesh, scope, [&](const Vector3& x) { return box.contains(x); });
}

std::vector<std::int32_t> nodes_in_sphere(const TetMesh& mesh, const Vector3& centre, double radius,
                                          NodeScope scope) {
    if (!(radius >= 0)) fail("sphere: its radius of {} mm must be >= 0", 1e3 * radius);
    return select(mesh, scope, [&](const Vector3& x) { return (x - centre).norm() <= radius; });
}

std::vector<std::int32_t> nodes_in_half_space(const TetMesh& mesh, const Vector3& point,
                                              const Vector3& normal, NodeScope scope) {
    if (!(normal.norm() > 0)) fail("half-space: its normal is zero, expected a direction");
    return select(mesh, scope, [&](const Vector3& x) { return (x - point).dot(normal) <= 0; });
}

}  // namespace livetet
