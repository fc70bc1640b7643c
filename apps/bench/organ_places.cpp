#include "apps/bench/organ_places.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "geometry/nearest_triangle.hpp"
#include "geometry/spread_points.hpp"
#include "geometry/triangle_area.hpp"

namespace livetet {

namespace {

Vector3 middle_of(const TriangleMesh& surface, const Triangle& t) {
    return (surface.nodes[t[0]] + surface.nodes[t[1]] + surface.nodes[t[2]]) / 3;
}

}  // namespace

SurfacePlace place_towards(const TriangleMesh& surface, const Vector3& centre,
                           const Vector3& direction) {
    constexpr double about_m = 0.015;
    double best = -2;
    SurfacePlace found{Vector3::Zero(), Vector3::Zero()};
    for (const Triangle& t : surface.triangles) {
        const Vector3 middle = middle_of(surface, t);
        const double along = (middle - centre).normalized().dot(direction.normalized());
        if (along > best) best = along, found.place = middle;
    }
    for (const Triangle& t : surface.triangles)
        if ((middle_of(surface, t) - found.place).norm() < about_m)
            found.normal += area_vector(surface.nodes, t);
    found.normal.normalize();
    return found;
}

std::vector<NamedPoint> targets_inside(const TetMesh& mesh, const Vector3& place,
                                       const TargetPlaces& wanted) {
    const std::vector<Triangle> surface = boundary_triangles(mesh.tets);
    const NearestTriangle nearest(mesh.nodes, surface);
    std::vector<Vector3> inside;
    for (const Tet& tet : mesh.tets) {
        Vector3 x = Vector3::Zero();
        for (const std::int32_t n : tet) x += mesh.nodes[n] / 4;
        if ((x - place).norm() < wanted.near && nearest.find(x).distance > wanted.deep)
            inside.push_back(x);
    }
    if (inside.size() < wanted.count)
        fail(
            "targets: found {} places inside within {:.0f} mm of ({:.1f}, {:.1f}, {:.1f}) mm, "
            "expected {} or more",
            inside.size(), 1e3 * wanted.near, 1e3 * place.x(), 1e3 * place.y(), 1e3 * place.z(),
            wanted.count);
    std::vector<NamedPoint> targets;
    for (const std::size_t i : spread_points(inside, wanted.count).chosen)
        targets.push_back({fmt::format("T{:02}", targets.size() + 1), inside[i]});
    return targets;
}

}  // namespace livetet
