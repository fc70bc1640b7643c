#include "mesh/surface_ring.hpp"

#include <Eigen/Dense>

#include <algorithm>

namespace livetet {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

constexpr double inner_radii = 1.3, outer_radii = 2.5, max_radii = 8;
constexpr std::size_t min_nodes = 6;

std::vector<std::int32_t> ring_nodes(const SurfaceNeighbourhood& around, const SurfacePatch& patch,
                                     double radius) {
    std::vector<std::int32_t> nodes;
    for (double outer = outer_radii; nodes.size() < min_nodes && outer <= max_radii; outer *= 1.3) {
        nodes.clear();
        for (const auto& [node, distance] : around.distances(outer * radius))
            if (distance > inner_radii * radius && !std::ranges::binary_search(patch.nodes, node))
                nodes.push_back(node);
    }
    if (nodes.size() < min_nodes) nodes.clear();
    return nodes;
}

/// `places`: in the tangent plane, from the place that is interpolated to.
std::vector<double> linear_weights(const std::vector<Vector2d>& places) {
    const auto count = static_cast<double>(places.size());
    Vector2d mean = Vector2d::Zero();
    for (const Vector2d& y : places) mean += y / count;
    Matrix2d moment = Matrix2d::Zero();
    for (const Vector2d& y : places) moment += (y - mean) * (y - mean).transpose() / count;
    const Vector2d slope = moment.inverse() * mean;
    std::vector<double> weights;
    for (const Vector2d& y : places) weights.push_back((1 - slope.dot(y - mean)) / count);
    if (!std::ranges::all_of(weights, [](double w) { return w >= 0; }))  // nor NaN
        weights.assign(places.size(), 1 / count);
    return weights;
}

}  // namespace

Vector3 SurfaceRing::interpolate(std::span<const Vector3> values) const {
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = 0; i < nodes.size(); ++i) sum += weights[i] * values[nodes[i]];
    return sum;
}

SurfaceRing surface_ring(const SurfaceNeighbourhood& around, const SurfacePatch& patch,
                         double radius) {
    const TetMesh& mesh = around.mesh();
    SurfaceRing ring;
    ring.nodes = ring_nodes(around, patch, radius);
    for (const std::int32_t n : patch.nodes)
        ring.middle += mesh.nodes[n] / static_cast<double>(patch.nodes.size());
    const Vector3 side = patch.normal.unitOrthogonal(), other = patch.normal.cross(side);
    std::vector<Vector2d> places;
    for (const std::int32_t n : ring.nodes) {
        const Vector3 from = mesh.nodes[n] - ring.middle;
        places.emplace_back(from.dot(side), from.dot(other));
    }
    ring.weights = linear_weights(places);
    return ring;
}

}  // namespace livetet
