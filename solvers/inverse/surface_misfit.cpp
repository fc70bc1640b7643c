#include "solvers/inverse/surface_misfit.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "geometry/nearest_triangle.hpp"

namespace livetet {

namespace {

constexpr double outlier_z = 9;  ///< d^2 / s^2 from which a point is rather an outlier

/// Sets value, confidences and RMS from the distances and `scale`.
void weigh(SurfaceMatches& matches) {
    matches.value = 0;
    double squares = 0;
    for (SurfaceMatch& m : matches.points) {
        const double z = m.distance * m.distance / (matches.scale * matches.scale);
        const double share = 1 / (1 + z / outlier_z);
        matches.value += z * share / 2;
        m.confidence = share * share;
        squares += m.distance * m.distance;
    }
    matches.rms = std::sqrt(squares / static_cast<double>(matches.points.size()));
}

}  // namespace

SurfaceMisfit::SurfaceMisfit(std::span<const Triangle> surface, std::span<const Vector3> points)
    : surface_(surface.begin(), surface.end()), points_(points.begin(), points.end()) {
    constexpr std::size_t min_points = 10;
    if (surface_.empty()) fail("surface misfit: found a surface without triangles, expected some");
    if (points_.size() < min_points)
        fail("surface misfit: found {} points, expected at least {}", points_.size(), min_points);
    for (std::size_t i = 0; i < points_.size(); ++i)
        if (!points_[i].allFinite())
            fail("surface misfit: point {} is not finite, expected three numbers", i);
}

std::vector<SurfaceMatch> SurfaceMisfit::nearest(std::span<const Vector3> positions) const {
    constexpr double touches_m = 1e-9;  // here the direction to the point is round-off
    const NearestTriangle triangles(positions, surface_);
    std::vector<SurfaceMatch> matches;
    matches.reserve(points_.size());
    for (const Vector3& c : points_) {
        const NearestTriangle::Hit hit = triangles.find(c);
        SurfaceMatch m{.nodes = surface_[hit.triangle], .weights = hit.weights, .direction = {}};
        const auto& [a, b, d] = triangles.corners(hit.triangle);
        const bool inside =
            std::all_of(hit.weights.begin(), hit.weights.end(), [](double w) { return w > 0; });
        if (inside || hit.distance < touches_m)
            m.direction = (b - a).cross(d - a).normalized();
        else
            m.direction = (c - hit.place) / hit.distance;
        m.distance = m.direction.dot(c - hit.place);
        matches.push_back(m);
    }
    return matches;
}

SurfaceMatches SurfaceMisfit::match(std::span<const Vector3> positions, double scale) const {
    SurfaceMatches matches{.points = nearest(positions), .scale = scale};
    weigh(matches);
    return matches;
}

SurfaceMatches SurfaceMisfit::match_from_afar(std::span<const Vector3> positions,
                                              double smallest_scale) const {
    SurfaceMatches matches{.points = nearest(positions)};
    std::vector<double> sizes;
    for (const SurfaceMatch& m : matches.points) sizes.push_back(std::abs(m.distance));
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    matches.scale = std::max(smallest_scale, 1.5 * *middle);
    weigh(matches);
    return matches;
}

std::vector<Vector3> misfit_gradient(const SurfaceMatches& matches, std::size_t nodes) {
    std::vector<Vector3> gradient(nodes, Vector3::Zero());
    const double inverse = 1 / (matches.scale * matches.scale);
    for (const SurfaceMatch& m : matches.points) {
        const Vector3 pull = m.confidence * m.distance * inverse * m.direction;
        for (int k = 0; k < 3; ++k) gradient[m.nodes[k]] -= m.weights[k] * pull;
    }
    return gradient;
}

std::vector<std::int32_t> matched_nodes(const SurfaceMatches& matches) {
    std::vector<std::int32_t> nodes;
    for (const SurfaceMatch& m : matches.points)
        nodes.insert(nodes.end(), m.nodes.begin(), m.nodes.end());
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    return nodes;
}

}  // namespace livetet
