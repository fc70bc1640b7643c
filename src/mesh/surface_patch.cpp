#include "mesh/surface_patch.hpp"

#include <Eigen/Dense>

#include <algorithm>

#include "geometry/nearest_triangle.hpp"
#include "mesh/geodesic.hpp"

namespace livetet {

namespace {

/// From a place to the centroid of the area about the patch's nodes (a third of each triangle's for
/// each of its corners), without the part along the area's mean normal.
Vector3 off_centre(const TetMesh& mesh, std::span<const Triangle> surface,
                   const std::vector<std::int32_t>& patch, const Vector3& place) {
    Vector3 moment = Vector3::Zero(), normal = Vector3::Zero();
    double sum = 0;
    for (const Triangle& t : surface) {
        const Vector3 area =
            (mesh.nodes[t[1]] - mesh.nodes[t[0]]).cross(mesh.nodes[t[2]] - mesh.nodes[t[0]]) / 6;
        for (const std::int32_t n : t) {
            if (!std::ranges::binary_search(patch, n)) continue;
            moment += area.norm() * (mesh.nodes[n] - place);
            normal += area;
            sum += area.norm();
        }
    }
    if (sum == 0) return Vector3::Zero();
    normal.normalize();
    return (moment - moment.dot(normal) * normal) / sum;
}

}  // namespace

SurfacePatch surface_patch(const TetMesh& mesh, const Vector3& place, double radius) {
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
    const NearestTriangle::Hit hit = NearestTriangle(mesh.nodes, surface).find(place);
    SurfacePatch patch;
    patch.distance = hit.distance;
    const auto triangle = static_cast<std::size_t>(hit.triangle);
    const Triangle& nearest = surface[triangle];
    patch.centre =
        *std::min_element(nearest.begin(), nearest.end(), [&](std::int32_t a, std::int32_t b) {
            return (mesh.nodes[a] - place).squaredNorm() < (mesh.nodes[b] - place).squaredNorm();
        });
    for (const auto& [node, distance] :
         distances_on_surface(mesh.nodes, surface, {triangle, hit.place}, radius))
        patch.nodes.push_back(node);
    if (patch.nodes.empty()) patch.nodes.push_back(patch.centre);
    patch.off_centre = off_centre(mesh, surface, patch.nodes, hit.place);
    return patch;
}

}  // namespace livetet
