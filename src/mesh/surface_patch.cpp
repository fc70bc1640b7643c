#include "mesh/surface_patch.hpp"

#include <Eigen/Dense>

#include <algorithm>

#include "geometry/nearest_triangle.hpp"
#include "mesh/geodesic.hpp"

namespace livetet {

SurfacePatch surface_patch(const TetMesh& mesh, const Vector3& place, double radius) {
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
    const NearestTriangle::Hit hit = NearestTriangle(mesh.nodes, surface).find(place);
    SurfacePatch patch;
    patch.distance = hit.distance;
    const Triangle& nearest = surface[hit.triangle];
    patch.centre =
        *std::min_element(nearest.begin(), nearest.end(), [&](std::int32_t a, std::int32_t b) {
            return (mesh.nodes[a] - place).squaredNorm() < (mesh.nodes[b] - place).squaredNorm();
        });
    for (const auto& [node, distance] :
         distances_on_surface(mesh.nodes, surface, patch.centre, radius))
        patch.nodes.push_back(node);
    return patch;
}

}  // namespace livetet
