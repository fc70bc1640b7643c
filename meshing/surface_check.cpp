#include "meshing/surface_check.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <numeric>

#include "base/error.hpp"

namespace livetet {

namespace {

/// A triangle is degenerate if twice its area divided by its squared longest edge is below this.
constexpr double degenerate_shape = 1e-12;

bool is_degenerate(const TriangleMesh& surface, const Triangle& t) {
    const Vector3 &a = surface.nodes[t[0]], &b = surface.nodes[t[1]], &c = surface.nodes[t[2]];
    const double longest =
        std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    return (b - a).cross(c - a).norm() <= degenerate_shape * longest;
}

void check_indices(const TriangleMesh& surface) {
    if (surface.triangles.empty()) fail("surface: it has no triangles, expected a closed surface");
    const auto count = static_cast<std::int32_t>(surface.nodes.size());
    for (std::size_t i = 0; i < surface.triangles.size(); ++i)
        for (const std::int32_t n : surface.triangles[i])
            if (n < 0 || n >= count)
                fail("surface: triangle {} names node {}, expected 0 to {}", i, n, count - 1);
    for (std::int32_t n = 0; n < count; ++n)
        if (!surface.nodes[n].allFinite())
            fail("surface: node {} has a coordinate that is not finite", n);
}

/// A directed edge of a triangle.
struct DirectedEdge {
    std::int32_t low, high;
    bool upwards;
    auto operator<=>(const DirectedEdge&) const = default;
};

std::vector<DirectedEdge> sorted_edges(const TriangleMesh& surface) {
    std::vector<DirectedEdge> edges;
    edges.reserve(3 * surface.triangles.size());
    for (const Triangle& t : surface.triangles)
        for (int k = 0; k < 3; ++k) {
            const std::int32_t a = t[k], b = t[(k + 1) % 3];
            if (a != b) edges.push_back({std::min(a, b), std::max(a, b), a < b});
        }
    std::sort(edges.begin(), edges.end());
    return edges;
}

}  // namespace

SurfaceTopology check_topology(const TriangleMesh& surface) {
    check_indices(surface);
    SurfaceTopology result;
    int worst = 0;
    const auto found = [&](int kind, std::int64_t& count, const Vector3& place) {
        ++count;
        if (kind <= worst) return;
        worst = kind;
        result.place = place;
    };
    for (const Triangle& t : surface.triangles)
        if (is_degenerate(surface, t))
            found(1, result.degenerate_triangles,
                  (surface.nodes[t[0]] + surface.nodes[t[1]] + surface.nodes[t[2]]) / 3);
    const std::vector<DirectedEdge> edges = sorted_edges(surface);
    for (std::size_t i = 0, j = 0; i < edges.size(); i = j) {
        while (j < edges.size() && edges[j].low == edges[i].low && edges[j].high == edges[i].high)
            ++j;
        const Vector3 middle = (surface.nodes[edges[i].low] + surface.nodes[edges[i].high]) / 2;
        if (j - i == 1) found(3, result.border_edges, middle);
        if (j - i > 2) found(4, result.non_manifold_edges, middle);
        if (j - i == 2 && edges[i].upwards == edges[i + 1].upwards)
            found(2, result.misoriented_edges, middle);
    }
    return result;
}

double signed_volume(const TriangleMesh& surface) {
    if (surface.nodes.empty()) return 0;
    // An origin near the surface avoids cancellation.
    const Vector3 origin = surface.nodes.front();
    double sum = 0;
    for (const Triangle& t : surface.triangles)
        sum += (surface.nodes[t[0]] - origin)
                   .dot((surface.nodes[t[1]] - origin).cross(surface.nodes[t[2]] - origin));
    return sum / 6;
}

std::vector<std::int32_t> connected_parts(const TriangleMesh& surface) {
    std::vector<std::int32_t> root(surface.nodes.size());
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](std::int32_t n) {
        while (root[n] != n) n = root[n] = root[root[n]];
        return n;
    };
    for (const Triangle& t : surface.triangles)
        for (int k = 1; k < 3; ++k) {
            const std::int32_t a = find(t[0]), b = find(t[k]);
            root[std::max(a, b)] = std::min(a, b);
        }
    std::vector<std::int32_t> number(surface.nodes.size(), -1), parts;
    std::int32_t count = 0;
    for (const Triangle& t : surface.triangles) {
        std::int32_t& part = number[find(t[0])];
        if (part < 0) part = count++;
        parts.push_back(part);
    }
    return parts;
}

std::vector<TriangleMesh> parts_of(const TriangleMesh& surface) {
    const std::vector<std::int32_t> parts = connected_parts(surface);
    if (parts.empty()) return {};
    std::vector<TriangleMesh> split(*std::max_element(parts.begin(), parts.end()) + 1);
    std::vector<std::int32_t> renumbered(surface.nodes.size(), -1);
    for (std::size_t i = 0; i < parts.size(); ++i) {
        TriangleMesh& part = split[parts[i]];
        Triangle t = surface.triangles[i];
        for (std::int32_t& n : t) {
            if (renumbered[n] < 0) {
                renumbered[n] = static_cast<std::int32_t>(part.nodes.size());
                part.nodes.push_back(surface.nodes[n]);
            }
            n = renumbered[n];
        }
        part.triangles.push_back(t);
    }
    return split;
}

std::string place_mm(const Vector3& x) {
    return fmt::format("({:.2f}, {:.2f}, {:.2f}) mm", 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
}

std::string box_mm(std::span<const Vector3> positions) {
    Eigen::AlignedBox3d box;
    for (const Vector3& x : positions) box.extend(x);
    return fmt::format("{} to {}", place_mm(box.min()), place_mm(box.max()));
}

}  // namespace livetet
