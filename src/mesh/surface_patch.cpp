#include "mesh/surface_patch.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <queue>
#include <unordered_map>

#include "geometry/nearest_triangle.hpp"

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
    std::unordered_map<std::int32_t, std::vector<std::int32_t>> neighbours;
    for (const Triangle& t : surface)
        for (int i = 0; i < 3; ++i) {
            neighbours[t[i]].push_back(t[(i + 1) % 3]);
            neighbours[t[i]].push_back(t[(i + 2) % 3]);
        }
    using Entry = std::pair<double, std::int32_t>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
    std::unordered_map<std::int32_t, double> reached;
    front.push({0, patch.centre});
    while (!front.empty()) {
        const auto [distance, node] = front.top();
        front.pop();
        if (!reached.emplace(node, distance).second) continue;
        for (const std::int32_t next : neighbours[node])
            if (const double d = distance + (mesh.nodes[next] - mesh.nodes[node]).norm();
                d <= radius)
                front.push({d, next});
    }
    for (const auto& [node, distance] : reached) patch.nodes.push_back(node);
    std::sort(patch.nodes.begin(), patch.nodes.end());
    return patch;
}

}  // namespace livetet
