#include "geometry/ellipsoid_surface.hpp"

#include <map>
#include <numbers>
#include <utility>

namespace livetet {

namespace {

constexpr int divisions = 2;

TriangleMesh icosahedron() {
    constexpr double g = std::numbers::phi;
    TriangleMesh surface;
    for (const Vector3& x :
         {Vector3(-1, g, 0), Vector3(1, g, 0), Vector3(-1, -g, 0), Vector3(1, -g, 0),
          Vector3(0, -1, g), Vector3(0, 1, g), Vector3(0, -1, -g), Vector3(0, 1, -g),
          Vector3(g, 0, -1), Vector3(g, 0, 1), Vector3(-g, 0, -1), Vector3(-g, 0, 1)})
        surface.nodes.push_back(x.normalized());
    surface.triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                         {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                         {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                         {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    return surface;
}

/// Divides each triangle into four. New nodes are pushed out to the unit sphere.
void divide(TriangleMesh& surface) {
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
    const auto middle = [&](std::int32_t a, std::int32_t b) {
        const auto [entry, is_new] =
            middles.try_emplace(std::minmax(a, b), static_cast<std::int32_t>(surface.nodes.size()));
        if (is_new)
            surface.nodes.push_back(Vector3(surface.nodes[a] + surface.nodes[b]).normalized());
        return entry->second;
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : surface.triangles) {
        const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        finer.insert(finer.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    surface.triangles = std::move(finer);
}

}  // namespace

const TriangleMesh& unit_sphere_surface() {
    static const TriangleMesh sphere = [] {
        TriangleMesh surface = icosahedron();
        for (int i = 0; i < divisions; ++i) divide(surface);
        return surface;
    }();
    return sphere;
}

TriangleMesh ellipsoid_surface(const Vector3& centre, const ErrorEllipsoid& ellipsoid) {
    TriangleMesh surface = unit_sphere_surface();
    for (Vector3& x : surface.nodes)
        x = centre + ellipsoid.axes * ellipsoid.semi_axes.cwiseProduct(x);
    return surface;
}

}  // namespace livetet
