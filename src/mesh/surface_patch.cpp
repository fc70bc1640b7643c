#include "mesh/surface_patch.hpp"

#include <Eigen/Dense>

#include <algorithm>

#include "geometry/nearest_triangle.hpp"

namespace livetet {

namespace {

/// Finds a patch's area, normal and centroid. A third of each triangle's area belongs to each of
/// its corners.
void find_shape(SurfacePatch& patch, const TetMesh& mesh, std::span<const Triangle> surface,
                const Vector3& place) {
    Vector3 moment = Vector3::Zero(), normal = Vector3::Zero();
    for (const Triangle& t : surface) {
        const Vector3 third =
            (mesh.nodes[t[1]] - mesh.nodes[t[0]]).cross(mesh.nodes[t[2]] - mesh.nodes[t[0]]) / 6;
        for (const std::int32_t n : t) {
            if (!std::ranges::binary_search(patch.nodes, n)) continue;
            patch.area += third.norm();
            moment += third.norm() * (mesh.nodes[n] - place);
            normal += third;
        }
    }
    if (!(normal.norm() > 0)) return;
    patch.normal = normal.normalized();
    patch.off_centre = (moment - moment.dot(patch.normal) * patch.normal) / patch.area;
}

}  // namespace

SurfacePatch surface_patch(const TetMesh& mesh, const Vector3& place, double radius) {
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
    const NearestTriangle::Hit hit = NearestTriangle(mesh.nodes, surface).find(place);
    SurfacePatch patch;
    patch.distance = hit.distance;
    patch.at = {static_cast<std::size_t>(hit.triangle), hit.place};
    const Triangle& nearest = surface[patch.at.triangle];
    patch.centre =
        *std::min_element(nearest.begin(), nearest.end(), [&](std::int32_t a, std::int32_t b) {
            return (mesh.nodes[a] - place).squaredNorm() < (mesh.nodes[b] - place).squaredNorm();
        });
    for (const auto& [node, distance] : distances_on_surface(mesh.nodes, surface, patch.at, radius))
        patch.nodes.push_back(node);
    if (patch.nodes.empty()) patch.nodes.push_back(patch.centre);
    find_shape(patch, mesh, surface, hit.place);
    return patch;
}

}  // namespace livetet
