#include "meshing/surface_distance.hpp"

#include <algorithm>
#include <cmath>
#include <thread>

#include "base/thread_team.hpp"

namespace livetet {

namespace {

constexpr int finest_split = 20;
constexpr double max_error = 1e-4;  ///< of a greatest distance, in mean edges

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

/// Search for the greatest distance of triangles from a surface by branch and bound. The distance
/// from a convex set, so from one triangle of the surface, is convex: over a piece of a triangle it
/// is greatest at a corner, which bounds the distance from the whole surface.
class MaximumSearch {
  public:
    using Corners = std::array<Vector3, 3>;

    MaximumSearch(const NearestTriangle& other, const SurfaceDistance& known, double error_m)
        : other_(&other), error_m_(error_m), reached_(known.max_m), farthest_(known.farthest) {}

    void visit(const Corners& piece, int depth = 0) {
        const Vector3 centre = (piece[0] + piece[1] + piece[2]) / 3;
        const NearestTriangle::Hit hit = other_->find(centre);
        if (hit.distance > reached_) {
            reached_ = hit.distance;
            farthest_ = centre;
        }
        double radius = 0, from_triangle = 0;
        for (const Vector3& x : piece) {
            radius = std::max(radius, (x - centre).norm());
            from_triangle = std::max(from_triangle, distance_from(x, hit.triangle));
        }
        const double bound = std::min(hit.distance + radius, from_triangle);
        if (bound <= std::max((1 + relative_error) * reached_, reached_ + error_m_) ||
            depth == max_depth) {
            bound_ = std::max(bound_, bound);
            return;
        }
        const Vector3 ab = (piece[0] + piece[1]) / 2, bc = (piece[1] + piece[2]) / 2,
                      ca = (piece[2] + piece[0]) / 2;
        for (const Corners& quarter : {Corners{piece[0], ab, ca}, Corners{piece[1], bc, ab},
                                       Corners{piece[2], ca, bc}, Corners{ab, bc, ca}})
            visit(quarter, depth + 1);
    }

    /// No point of the visited triangles is farther away than this.
    double bound() const { return std::max(bound_, reached_); }
    const Vector3& farthest() const { return farthest_; }

  private:
    static constexpr double relative_error = 0.01;
    static constexpr int max_depth = 12;

    double distance_from(const Vector3& x, std::int32_t triangle) const {
        const auto& [a, b, c] = other_->corners(triangle);
        const auto w = nearest_weights(x, a, b, c);
        return (w[0] * a + w[1] * b + w[2] * c - x).norm();
    }

    const NearestTriangle* other_;
    double error_m_, reached_, bound_ = 0;
    Vector3 farthest_;
};

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

    // The samples only narrow the search for the maximum.
    std::vector<MaximumSearch> searches(
        pieces, MaximumSearch(other, distance, max_error * mean_edge(surface)));
    team.run([&](int p) {
        for (std::size_t t = count * p / pieces; t < count * (p + 1) / pieces; ++t) {
            const auto& [i, j, k] = surface.triangles[t];
            searches[p].visit({surface.nodes[i], surface.nodes[j], surface.nodes[k]});
        }
    });
    for (const MaximumSearch& search : searches)
        if (search.bound() > distance.max_m) {
            distance.max_m = search.bound();
            distance.farthest = search.farthest();
        }
    return distance;
}

HausdorffDistance hausdorff_distance(const TriangleMesh& level, const TriangleMesh& body,
                                     const NearestTriangle& tree) {
    const NearestTriangle level_tree(level.nodes, level.triangles);
    const double spacing = mean_edge(level) / 3;
    return {distance_between(level, tree, spacing), distance_between(body, level_tree, spacing)};
}

}  // namespace livetet
