#include "meshing/surface_distance.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "base/thread_team.hpp"

namespace livetet {

namespace {

constexpr int finest_split = 20;

/// Partial sums over a range of triangles.
struct Sum {
    double max = 0, moment = 0, area = 0;
    Vector3 farthest = Vector3::Zero();
};

Sum sum_over(const TriangleMesh& surface, const NearestTriangle& other, double spacing,
             std::size_t begin, std::size_t end) {
    Sum sum;
    for (std::size_t t = begin; t < end; ++t) {
        const auto& [i, j, k] = surface.triangles[t];
        const Vector3 &a = surface.nodes[i], ab = surface.nodes[j] - a, ac = surface.nodes[k] - a;
        const double longest =
            std::sqrt(std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()}));
        const int n =
            static_cast<int>(std::clamp(std::ceil(longest / spacing), 1.0, double{finest_split}));
        double distances = 0;
        const auto visit = [&](double p, double q) {
            const Vector3 x = a + ab * p / n + ac * q / n;
            const double d = other.find(x).distance;
            distances += d;
            if (d <= sum.max) return;
            sum.max = d;
            sum.farthest = x;
        };
        for (int p = 0; p < n; ++p)
            for (int q = 0; p + q < n; ++q) {
                visit(p + 1. / 3, q + 1. / 3);
                if (p + q + 1 < n) visit(p + 2. / 3, q + 2. / 3);
            }
        const double area = ab.cross(ac).norm() / 2;
        sum.area += area;
        sum.moment += area * distances / (n * n);
    }
    return sum;
}

double mean_edge(const TriangleMesh& surface) {
    double sum = 0;
    for (const auto& [a, b, c] : surface.triangles)
        sum += (surface.nodes[a] - surface.nodes[b]).norm() +
               (surface.nodes[b] - surface.nodes[c]).norm() +
               (surface.nodes[c] - surface.nodes[a]).norm();
    return sum / (3.0 * static_cast<double>(surface.triangles.size()));
}

}  // namespace

SurfaceDistance distance_between(const TriangleMesh& surface, const NearestTriangle& other,
                                 double spacing_m) {
    ThreadTeam team(static_cast<int>(std::max(1u, std::thread::hardware_concurrency())));
    const std::size_t pieces = team.size(), count = surface.triangles.size();
    std::vector<Sum> parts(pieces);
    team.run([&](int p) {
        parts[p] =
            sum_over(surface, other, spacing_m, count * p / pieces, count * (p + 1) / pieces);
    });
    SurfaceDistance distance;
    double moment = 0, area = 0;
    for (const Sum& sum : parts) {
        moment += sum.moment;
        area += sum.area;
        if (sum.max <= distance.max_m) continue;
        distance.max_m = sum.max;
        distance.farthest = sum.farthest;
    }
    distance.mean_m = area > 0 ? moment / area : 0;
    return distance;
}

HausdorffDistance hausdorff_distance(const TriangleMesh& level, const TriangleMesh& body,
                                     const NearestTriangle& tree) {
    const NearestTriangle level_tree(level.nodes, level.triangles);
    const double spacing = mean_edge(level) / 3;
    return {distance_between(level, tree, spacing), distance_between(body, level_tree, spacing)};
}

}  // namespace livetet
