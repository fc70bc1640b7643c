#include "mesh/node_selection.hpp"

#include <Eigen/Geometry>

#include "base/error.hpp"

namespace livetet {

std::vector<std::int32_t> nodes_in_box(const TetMesh& mesh, const Vector3& low, const Vector3& high,
                                       NodeScope scope) {
    if (!(low.array() <= high.array()).all())
        fail("box: from ({}) to ({}) mm is empty, expected low <= high along each axis",
             fmt::format("{:.2f}, {:.2f}, {:.2f}", 1e3 * low.x(), 1e3 * low.y(), 1e3 * low.z()),
             fmt::format("{:.2f}, {:.2f}, {:.2f}", 1e3 * high.x(), 1e3 * high.y(), 1e3 * high.z()));
    const Eigen::AlignedBox3d box(low, high);
    return select_nodes(mesh, scope, [&](const Vector3& x) { return box.contains(x); });
}

std::vector<std::int32_t> nodes_in_sphere(const TetMesh& mesh, const Vector3& centre, double radius,
                                          NodeScope scope) {
    if (!(radius >= 0)) fail("sphere: its radius of {} mm must be >= 0", 1e3 * radius);
    return select_nodes(mesh, scope,
                        [&](const Vector3& x) { return (x - centre).norm() <= radius; });
}

std::vector<std::int32_t> nodes_in_half_space(const TetMesh& mesh, const Vector3& point,
                                              const Vector3& normal, NodeScope scope) {
    if (!(normal.norm() > 0)) fail("half-space: its normal is zero, expected a direction");
    return select_nodes(mesh, scope,
                        [&](const Vector3& x) { return (x - point).dot(normal) <= 0; });
}

}  // namespace livetet
