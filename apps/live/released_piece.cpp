#include "apps/live/released_piece.hpp"

#include <Eigen/Geometry>

#include <algorithm>

#include "geometry/umeyama.hpp"

namespace livetet {

bool release_piece(const MeshPiece& piece, const TetMesh& mesh,
                   std::vector<Vector3>& displacement) {
    Eigen::AlignedBox3d box;
    for (const Vector3& x : mesh.nodes) box.extend(x);
    const std::vector<std::int32_t> nodes = nodes_of_pieces({&piece, 1}, mesh);
    std::vector<Vector3> rest, moved;
    for (const std::int32_t n : nodes) {
        rest.push_back(mesh.nodes[n]);
        moved.push_back(mesh.nodes[n] + displacement[n]);
    }
    bool is_near = std::ranges::all_of(moved, [](const Vector3& x) { return x.allFinite(); });
    PointFit fit;
    if (is_near) {
        fit = fit_points(rest, moved, Scaling::rigid);
        is_near = (fit * piece.centroid - piece.centroid).norm() < box.diagonal().norm();
    }
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        Vector3& u = displacement[static_cast<std::size_t>(nodes[i])];
        u.setZero();
        if (is_near) u = fit * rest[i] - rest[i];
    }
    return is_near;
}

}  // namespace livetet
