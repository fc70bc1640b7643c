#include "mesh/surface_patch.hpp"

#include <Eigen/Dense>

#include <algorithm>

#include "geometry/nearest_triangle.hpp"

namespace livetet {

SurfaceNeighbourhood::SurfaceNeighbourhood(const TetMesh& mesh, const Vector3& place)
    : mesh_(mesh), surface_(boundary_triangles(mesh.tets)) {
    const NearestTriangle::Hit hit = NearestTriangle(mesh.nodes, surface_).find(place);
    distance_ = hit.distance;
    at_ = {static_cast<std::size_t>(hit.triangle), hit.place};
    const Triangle& nearest = surface_[at_.triangle];
    centre_ = *std::ranges::min_element(
        nearest, {}, [&](std::int32_t n) { return (mesh.nodes[n] - place).squaredNorm(); });
}

SurfacePatch SurfaceNeighbourhood::patch(double radius) const {
    SurfacePatch patch;
    patch.distance = distance_;
    patch.at = at_;
    patch.centre = centre_;
    for (const auto& [node, distance] : distances(radius)) patch.nodes.push_back(node);
    if (patch.nodes.empty()) patch.nodes.push_back(centre_);
    find_shape(patch);
    return patch;
}

/// Finds a patch's area, normal and centroid. A third of each triangle's area belongs to each of
/// its corners.
void SurfaceNeighbourhood::find_shape(SurfacePatch& patch) const {
    Vector3 moment = Vector3::Zero(), normal = Vector3::Zero();
    for (const Triangle& t : surface_) {
        const Vector3 &a = mesh_.nodes[t[0]], &b = mesh_.nodes[t[1]], &c = mesh_.nodes[t[2]];
        const Vector3 third = (b - a).cross(c - a) / 6;
        for (const std::int32_t n : t) {
            if (!std::ranges::binary_search(patch.nodes, n)) continue;
            patch.area += third.norm();
            moment += third.norm() * (mesh_.nodes[n] - at_.place);
            normal += third;
        }
    }
    if (!(normal.norm() > 0)) return;
    patch.normal = normal.normalized();
    patch.off_centre = (moment - moment.dot(patch.normal) * patch.normal) / patch.area;
}

SurfacePatch surface_patch(const TetMesh& mesh, const Vector3& place, double radius) {
    return SurfaceNeighbourhood(mesh, place).patch(radius);
}

}  // namespace livetet
