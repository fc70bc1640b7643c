#include "mesh/surface_patch.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "geometry/nearest_triangle.hpp"
#include "geometry/triangle_area.hpp"
#include "mesh/grid_border.hpp"
#include "mesh/grid_surface.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

/// The triangles of the body's surface; those of ten-node tets cut into four at the middles of
/// their edges.
std::vector<Triangle> surface_triangles(const TetMesh& mesh) {
    const std::vector<Triangle> whole = body_surface(mesh);
    if (mesh.edge_nodes.empty()) return whole;
    const EdgeNodes middles(mesh);
    std::vector<Triangle> parts;
    for (const auto& [a, b, c] : whole) {
        const std::int32_t ab = middles.between(a, b), bc = middles.between(b, c),
                           ca = middles.between(c, a);
        for (const Triangle& part :
             {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}})
            parts.push_back(part);
    }
    return parts;
}

/// Share of a triangle's area that is held if `corners` of its corners are in a patch.
double held_share(int corners) { return corners == 3 ? 1 : corners / 6.0; }

}  // namespace

SurfaceNeighbourhood::SurfaceNeighbourhood(const TetMesh& mesh, const Vector3& place)
    : mesh_(mesh), surface_(surface_triangles(mesh)) {
    if (!mesh.hexahedra.empty()) smoothed_ = smoothed_surface(mesh, surface_);
    const std::span<const Vector3> nodes = places();
    const NearestTriangle::Hit hit = NearestTriangle(nodes, surface_).find(place);
    distance_ = hit.distance;
    at_ = {static_cast<std::size_t>(hit.triangle), hit.place};
    const Triangle& nearest = surface_[at_.triangle];
    centre_ = *std::ranges::min_element(
        nearest, {}, [&](std::int32_t n) { return (nodes[n] - place).squaredNorm(); });
}

namespace {

/// Share of a triangle within `radius` of a point, by the distances d_i of its corners: for a flat
/// surface, with barycentric coordinates L,
///     d^2 = sum_i L_i d_i^2 - sum_(i<j) L_i L_j |x_i - x_j|^2.
/// Counted at the centres of 256 parts.
double share_within(std::span<const Vector3> nodes, const Triangle& t,
                    const std::array<double, 3>& d, double radius) {
    constexpr int cuts = 16;
    const Vector3 &a = nodes[t[0]], &b = nodes[t[1]], &c = nodes[t[2]];
    const double ab = (b - a).squaredNorm(), bc = (c - b).squaredNorm(), ca = (a - c).squaredNorm();
    int inside = 0;
    const auto count = [&](double x, double y) {
        const double z = 1 - x - y;
        inside += x * d[0] * d[0] + y * d[1] * d[1] + z * d[2] * d[2] - x * y * ab - y * z * bc -
                      z * x * ca <=
                  radius * radius;
    };
    for (int i = 0; i < cuts; ++i)
        for (int j = 0; j < cuts - i; ++j) {
            count((i + 1. / 3) / cuts, (j + 1. / 3) / cuts);
            if (j + 1 < cuts - i) count((i + 2. / 3) / cuts, (j + 2. / 3) / cuts);
        }
    return inside / static_cast<double>(cuts * cuts);
}

/// The longest edge of the triangles with a corner within `radius` of a place.
double longest_edge_near(std::span<const Vector3> nodes, std::span<const Triangle> triangles,
                         const Vector3& place, double radius) {
    double longest = 0;
    for (const Triangle& t : triangles) {
        const Vector3 &a = nodes[t[0]], &b = nodes[t[1]], &c = nodes[t[2]];
        const double edge = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
        if ((a - place).norm() <= radius + edge) longest = std::max(longest, edge);
    }
    return longest;
}

}  // namespace

std::size_t SurfaceNeighbourhood::surface_node_count() const {
    std::set<std::int32_t> nodes;
    for (const Triangle& t : surface_) nodes.insert(t.begin(), t.end());
    return nodes.size();
}

SurfacePatch SurfaceNeighbourhood::patch(double radius) const {
    SurfacePatch patch;
    patch.distance = distance_;
    patch.at = at_.place;
    patch.triangle = surface_[at_.triangle];
    patch.centre = centre_;
    // Far enough for all triangles that the disc touches.
    const double reach = radius + 2 * longest_edge_near(places(), surface_, at_.place, radius);
    const std::map<std::int32_t, double> near = distances(reach);
    for (const Triangle& t : surface_) {
        std::array<double, 3> d{};
        const bool is_near = std::ranges::all_of(t, [&](auto n) { return near.contains(n); });
        for (int k = 0; is_near && k < 3; ++k) d[k] = near.at(t[k]);
        if (is_near)
            patch.disc_area +=
                share_within(places(), t, d, radius) * area_vector(places(), t).norm();
    }
    choose_nodes(patch, near);
    find_shape(patch);
    return patch;
}

/// Takes the nearest nodes, those at one distance together, as long as that brings the area held
/// nearer to the disc's.
void SurfaceNeighbourhood::choose_nodes(SurfacePatch& patch,
                                        const std::map<std::int32_t, double>& distances) const {
    std::vector<std::pair<double, std::int32_t>> order;
    for (const auto& [node, distance] : distances) order.emplace_back(distance, node);
    std::ranges::sort(order);
    std::map<std::int32_t, std::vector<const Triangle*>> around;
    for (const Triangle& t : surface_)
        for (const std::int32_t n : t)
            if (distances.contains(n)) around[n].push_back(&t);
    constexpr double same = 1e-6;  // of the distance
    std::map<const Triangle*, int> corners;
    double held = 0, nearest = patch.disc_area;
    std::size_t count = 0;
    for (std::size_t k = 0; k < order.size();) {
        const double distance = order[k].first;
        for (; k < order.size() && order[k].first <= (1 + same) * distance; ++k)
            for (const Triangle* t : around[order[k].second]) {
                int& in = corners[t];
                held += (held_share(in + 1) - held_share(in)) * area_vector(places(), *t).norm();
                ++in;
            }
        if (const double off = std::abs(held - patch.disc_area); off < nearest) {
            nearest = off;
            count = k;
        }
    }
    for (std::size_t k = 0; k < count; ++k) patch.nodes.push_back(order[k].second);
    std::ranges::sort(patch.nodes);
    if (patch.nodes.empty()) patch.nodes.push_back(centre_);
}

/// Finds a patch's area, normal and centroid.
void SurfaceNeighbourhood::find_shape(SurfacePatch& patch) const {
    const std::span<const Vector3> nodes = places();
    Vector3 moment = Vector3::Zero(), normal = Vector3::Zero();
    for (const Triangle& t : surface_) {
        int corners = 0;
        Vector3 middle = Vector3::Zero();
        for (const std::int32_t n : t)
            if (std::ranges::binary_search(patch.nodes, n)) ++corners, middle += nodes[n];
        const double share = held_share(corners);
        if (share == 0) continue;
        const Vector3 held = share * area_vector(nodes, t);
        patch.area += held.norm();
        moment += held.norm() * (middle / corners - at_.place);
        normal += held;
    }
    moment /= patch.area;
    if (!(normal.norm() > 1e-3 * patch.area))  // round a body, or both sides of a plate
        normal = area_vector(nodes, surface_[at_.triangle]);
    patch.normal = normal.normalized();
    patch.off_centre = moment - moment.dot(patch.normal) * patch.normal;
}

SurfacePatch surface_patch(const TetMesh& mesh, const Vector3& place, double radius) {
    return SurfaceNeighbourhood(mesh, place).patch(radius);
}

}  // namespace livetet
