#include "geometry/nearest_triangle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace livetet {

namespace {

constexpr std::int32_t leaf_size = 4;

/// part / whole clamped to [0, 1]; 0 if `whole` is not positive (a degenerate triangle).
double fraction(double part, double whole) {
    return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0.0;
}

}  // namespace

std::array<double, 3> nearest_weights(const Vector3& x, const Vector3& a, const Vector3& b,
                                      const Vector3& c) {
    const Vector3 ab = b - a, ac = c - a;
    const double d1 = ab.dot(x - a), d2 = ac.dot(x - a);
    if (d1 <= 0 && d2 <= 0) return {1, 0, 0};
    const double d3 = ab.dot(x - b), d4 = ac.dot(x - b);
    if (d3 >= 0 && d4 <= d3) return {0, 1, 0};
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        const double t = fraction(d1, d1 - d3);
        return {1 - t, t, 0};
    }
    const double d5 = ab.dot(x - c), d6 = ac.dot(x - c);
    if (d6 >= 0 && d5 <= d6) return {0, 0, 1};
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        const double t = fraction(d2, d2 - d6);
        return {1 - t, 0, t};
    }
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6) {
        const double t = fraction(d4 - d3, (d4 - d3) + (d5 - d6));
        return {0, 1 - t, t};
    }
    const double v = fraction(vb, va + vb + vc);
    const double w = std::min(fraction(vc, va + vb + vc), 1 - v);
    return {1 - v - w, v, w};
}

NearestTriangle::NearestTriangle(std::span<const Vector3> nodes,
                                 std::span<const Triangle> triangles) {
    corners_.reserve(triangles.size());
    for (const Triangle& t : triangles) corners_.push_back({nodes[t[0]], nodes[t[1]], nodes[t[2]]});
    order_.resize(triangles.size());
    std::iota(order_.begin(), order_.end(), 0);
    boxes_.reserve(triangles.size());
    boxes_.emplace_back();
    build(0, 0, static_cast<std::int32_t>(order_.size()));
}

void NearestTriangle::build(std::int32_t box, std::int32_t first, std::int32_t count) {
    Eigen::AlignedBox3d bounds, centres;
    const auto centre = [&](std::int32_t t) {
        return (corners_[t][0] + corners_[t][1] + corners_[t][2]).eval();
    };
    for (std::int32_t i = first; i < first + count; ++i) {
        for (const Vector3& corner : corners_[order_[i]]) bounds.extend(corner);
        centres.extend(centre(order_[i]));
    }
    boxes_[box] = {bounds, first, count};
    if (count <= leaf_size) return;
    int axis = 0;
    centres.sizes().maxCoeff(&axis);
    const std::int32_t half = count / 2;
    std::nth_element(order_.begin() + first, order_.begin() + first + half,
                     order_.begin() + first + count, [&](std::int32_t s, std::int32_t t) {
                         const double cs = centre(s)[axis], ct = centre(t)[axis];
                         return cs != ct ? cs < ct : s < t;
                     });
    const auto children = static_cast<std::int32_t>(boxes_.size());
    boxes_.emplace_back();
    boxes_.emplace_back();
    boxes_[box].first = children;
    boxes_[box].count = 0;
    build(children, first, half);
    build(children + 1, first + half, count - half);
}

NearestTriangle::Hit NearestTriangle::find(const Vector3& x) const {
    Hit hit;
    double best_squared = std::numeric_limits<double>::infinity();
    // A median split of 2^31 triangles is 31 levels deep; each level leaves one pending box.
    std::array<std::pair<std::int32_t, double>, 128> stack;
    std::size_t depth = 0;
    stack[depth++] = {0, 0.0};
    while (depth > 0) {
        const auto [index, bound_squared] = stack[--depth];
        if (bound_squared >= best_squared) continue;
        const Box& box = boxes_[index];
        if (box.count == 0) {
            std::pair<std::int32_t, double> near{box.first,
                                                 boxes_[box.first].box.squaredExteriorDistance(x)};
            std::pair<std::int32_t, double> far{
                box.first + 1, boxes_[box.first + 1].box.squaredExteriorDistance(x)};
            if (far.second < near.second) std::swap(near, far);
            stack[depth++] = far;
            stack[depth++] = near;
            continue;
        }
        for (std::int32_t i = box.first; i < box.first + box.count; ++i) {
            const auto& [a, b, c] = corners_[order_[i]];
            const std::array<double, 3> w = nearest_weights(x, a, b, c);
            const Vector3 place = w[0] * a + w[1] * b + w[2] * c;
            const double distance_squared = (place - x).squaredNorm();
            if (distance_squared >= best_squared) continue;
            best_squared = distance_squared;
            hit = {order_[i], w, place, 0};
        }
    }
    hit.distance = std::sqrt(best_squared);
    return hit;
}

}  // namespace livetet
