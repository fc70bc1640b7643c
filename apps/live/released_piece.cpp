#include "apps/live/released_piece.hpp"

#include <optional>

#include "base/error.hpp"
#include "geometry/bounding_box.hpp"
#include "geometry/umeyama.hpp"

namespace livetet {

namespace {

/// None, if no rigid motion is near, or it takes the points' middle farther than `limit`, m.
std::optional<PointFit> rigid_motion(std::span<const Vector3> rest, std::span<const Vector3> moved,
                                     double limit) {
    Vector3 way = Vector3::Zero();  // of the middle
    for (std::size_t i = 0; i < rest.size(); ++i)
        way += (moved[i] - rest[i]) / static_cast<double>(rest.size());
    if (!(way.norm() < limit)) return {};  // so that NaN is far, too
    try {
        return fit_points(rest, moved, Scaling::rigid);
    } catch (const Error&) {  // the moved points lie on a line, or are one
        return {};
    }
}

}  // namespace

bool release_piece(const MeshPiece& piece, const TetMesh& mesh,
                   std::vector<Vector3>& displacement) {
    const std::vector<std::int32_t> nodes = nodes_of_pieces({&piece, 1}, mesh);
    std::vector<Vector3> rest, moved;
    for (const std::int32_t n : nodes) {
        rest.push_back(mesh.nodes[n]);
        moved.push_back(mesh.nodes[n] + displacement[n]);
    }
    const auto motion = rigid_motion(rest, moved, box_of(mesh.nodes).diagonal().norm());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        Vector3& u = displacement[static_cast<std::size_t>(nodes[i])];
        u.setZero();
        if (motion) u = *motion * rest[i] - rest[i];
    }
    return motion.has_value();
}

}  // namespace livetet
