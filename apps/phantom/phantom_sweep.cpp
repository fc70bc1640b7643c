#include "apps/phantom/phantom_sweep.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <optional>

#include "base/error.hpp"

namespace livetet {

namespace {

/// The highest place of the surface above (x, y), if it looks upwards there.
std::optional<Vector3> place_above(const TriangleMesh& surface, double x, double y, double min_up) {
    std::optional<Vector3> highest;
    double up = 0;
    for (const Triangle& t : surface.triangles) {
        const Vector3 &a = surface.nodes[t[0]], &b = surface.nodes[t[1]], &c = surface.nodes[t[2]];
        const Vector3 normal = (b - a).cross(c - a);
        if (!(normal.z() > 0)) continue;
        // Barycentric coordinates of (x, y) in the triangle seen from above.
        const Vector3 p(x, y, 0);
        const double wa = (b - p).cross(c - p).z() / normal.z(),
                     wb = (c - p).cross(a - p).z() / normal.z(), wc = 1 - wa - wb;
        if (std::min({wa, wb, wc}) < -1e-9) continue;  // a place on an edge is in a triangle
        const Vector3 place = wa * a + wb * b + wc * c;
        if (highest && place.z() <= highest->z()) continue;
        highest = place;
        up = normal.normalized().z();
    }
    return up >= min_up ? highest : std::nullopt;
}

/// Appends the way from the last place to `to`, through the air.
void lift_over(std::vector<Vector3>& places, const Vector3& to, const SweepPath& path) {
    const Vector3 from = places.back();
    const int steps = static_cast<int>((to - from).norm() / path.step_m);
    for (int k = 1; k < steps; ++k) {
        const double s = static_cast<double>(k) / steps;
        places.push_back((1 - s) * from + s * to +
                         4 * path.lift_m * s * (1 - s) * Vector3::UnitZ());
    }
}

}  // namespace

std::vector<Vector3> sweep_path(const TriangleMesh& surface, const SweepPath& path) {
    constexpr double longest_slide = 3;  // steps: from row to row the tip stays on the surface
    Eigen::AlignedBox3d box;
    for (const Vector3& x : surface.nodes) box.extend(x);
    const Vector3 extent = box.sizes();
    std::vector<Vector3> places;
    const int rows = static_cast<int>(extent.y() / path.row_m),
              columns = static_cast<int>(extent.x() / path.step_m);
    for (int row = 0; row < rows; ++row)
        for (int k = 0; k < columns; ++k) {
            const int column = row % 2 == 0 ? k : columns - 1 - k;
            const auto place = place_above(surface, box.min().x() + (column + 0.5) * path.step_m,
                                           box.min().y() + (row + 0.5) * path.row_m, path.min_up);
            if (!place) continue;
            if (!places.empty() && (*place - places.back()).norm() > longest_slide * path.step_m)
                lift_over(places, *place, path);
            places.push_back(*place);
        }
    if (places.empty()) fail("sweep: the surface has no place that is seen from above");
    return places;
}

}  // namespace livetet
