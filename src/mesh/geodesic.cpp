#include "mesh/geodesic.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

namespace livetet {

namespace {

constexpr int points_an_edge = 6;

/// Points on a part of a surface, and the triangles that join them.
class PointGraph {
  public:
    PointGraph(std::span<const Vector3> nodes, std::span<const Triangle> triangles)
        : nodes_(nodes) {
        for (const Triangle& t : triangles) {
            std::vector<std::int32_t>& points = points_of_.emplace_back();
            for (int k = 0; k < 3; ++k) {
                points.push_back(corner(t[k]));
                const std::int32_t first = first_on_edge(t[k], t[(k + 1) % 3]);
                for (int p = 0; p < points_an_edge; ++p) points.push_back(first + p);
            }
            for (const std::int32_t p : points)
                triangles_of_[p].push_back(static_cast<std::int32_t>(points_of_.size()) - 1);
        }
    }

    /// Dijkstra's distances of the corners up to `radius`, from a place in a triangle.
    std::map<std::int32_t, double> distances(std::size_t triangle, const Vector3& place,
                                             double radius) const {
        std::vector<double> reached(places_.size(), std::numeric_limits<double>::infinity());
        using Entry = std::pair<double, std::int32_t>;
        std::priority_queue<Entry, std::vector<Entry>, std::greater<>> front;
        const auto reach = [&](std::int32_t point, double distance) {
            if (distance >= reached[point] || distance > radius) return;
            reached[point] = distance;
            front.push({distance, point});
        };
        for (const std::int32_t p : points_of_[triangle]) reach(p, (places_[p] - place).norm());
        while (!front.empty()) {
            const auto [distance, point] = front.top();
            front.pop();
            if (distance > reached[point]) continue;
            for (const std::int32_t t : triangles_of_[point])
                for (const std::int32_t next : points_of_[t])
                    reach(next, distance + (places_[next] - places_[point]).norm());
        }
        std::map<std::int32_t, double> found;
        for (const auto& [node, point] : corners_)
            if (reached[point] <= radius) found[node] = reached[point];
        return found;
    }

  private:
    std::int32_t add(const Vector3& place) {
        places_.push_back(place);
        triangles_of_.emplace_back();
        return static_cast<std::int32_t>(places_.size()) - 1;
    }

    std::int32_t corner(std::int32_t node) {
        const auto [at, fresh] = corners_.try_emplace(node, 0);
        if (fresh) at->second = add(nodes_[node]);
        return at->second;
    }

    std::int32_t first_on_edge(std::int32_t a, std::int32_t b) {
        const auto [at, fresh] = edges_.try_emplace(std::minmax(a, b), 0);
        if (!fresh) return at->second;
        for (int p = 0; p < points_an_edge; ++p) {
            const double share = (p + 1.) / (points_an_edge + 1);
            const std::int32_t point = add((1 - share) * nodes_[a] + share * nodes_[b]);
            if (p == 0) at->second = point;
        }
        return at->second;
    }

    std::span<const Vector3> nodes_;
    std::vector<Vector3> places_;
    std::vector<std::vector<std::int32_t>> triangles_of_, points_of_;
    std::map<std::int32_t, std::int32_t> corners_;
    std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> edges_;
};

/// Distances of step 1 are too large by less than this share; those of step 2 that are smaller are
/// not taken: the surface is curved or folded there, or its triangles are slivers.
constexpr double max_excess = 0.02;

/// Distance of corner c of a triangle, if those of a and b are known: with the source at s in the
/// triangle's plane, on the other side of the edge ab, |s - a| = of_a and |s - b| = of_b, it is
/// |s - c|. Infinite if the line from s to c does not cross that edge, or if there is no such s.
double unfolded_distance(const Vector3& a, const Vector3& b, const Vector3& c, double of_a,
                         double of_b) {
    constexpr double none = std::numeric_limits<double>::infinity();
    const double ab = (b - a).norm();
    if (!(ab > 0)) return none;
    // In the plane: a = (0, 0), b = (ab, 0), c = (cx, cy), s = (sx, -sy).
    const double cx = (c - a).dot(b - a) / ab;
    const double cy = std::sqrt(std::max(0.0, (c - a).squaredNorm() - cx * cx));
    const double sx = (of_a * of_a - of_b * of_b + ab * ab) / (2 * ab);
    const double below = of_a * of_a - sx * sx;
    if (below < 0 || !(cy > 0)) return none;
    const double sy = std::sqrt(below), crossing = sx + (cx - sx) * sy / (sy + cy);
    return crossing >= 0 && crossing <= ab ? std::hypot(cx - sx, cy + sy) : none;
}

/// Step 2: lowers `distances`, which hold those of step 1.
void unfold(std::span<const Vector3> nodes, std::span<const Triangle> triangles,
            std::map<std::int32_t, double>& distances) {
    struct Update {
        std::array<std::int32_t, 3> corners;  ///< the last is the one that is updated
        std::array<double*, 3> distance;
        double far;  ///< the last one's distance of step 1
    };
    std::vector<Update> updates;
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) {
            const std::array<std::int32_t, 3> corners{t[(k + 1) % 3], t[(k + 2) % 3], t[k]};
            Update update{corners, {}, 0};
            for (int i = 0; i < 3; ++i)
                if (const auto at = distances.find(corners[i]); at != distances.end())
                    update.distance[i] = &at->second;
            if (std::ranges::count(update.distance, nullptr) > 0) continue;
            update.far = *update.distance[2];
            updates.push_back(update);
        }
    std::ranges::sort(updates, {}, &Update::far);
    // In order of distance, as a front passes; again where an obtuse corner is reached too early.
    constexpr int passes = 3;
    for (int pass = 0; pass < passes; ++pass)
        for (const auto& [c, distance, first] : updates) {
            const double length = unfolded_distance(nodes[c[0]], nodes[c[1]], nodes[c[2]],
                                                    *distance[0], *distance[1]);
            if (length < *distance[2] && length >= (1 - max_excess) * first) *distance[2] = length;
        }
}

}  // namespace

std::map<std::int32_t, double> distances_on_surface(std::span<const Vector3> nodes,
                                                    std::span<const Triangle> triangles,
                                                    const SurfacePoint& from, double radius) {
    // A path along the surface is no shorter than the straight line.
    std::vector<Triangle> near{triangles[from.triangle]};
    for (const Triangle& t : triangles) {
        const Vector3 &a = nodes[t[0]], &b = nodes[t[1]], &c = nodes[t[2]];
        const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
        if ((a - from.place).norm() <= radius / (1 - max_excess) + longest) near.push_back(t);
    }
    std::map<std::int32_t, double> distances =
        PointGraph(nodes, near).distances(0, from.place, radius / (1 - max_excess));
    unfold(nodes, near, distances);
    std::erase_if(distances, [&](const auto& of_node) { return of_node.second > radius; });
    return distances;
}

}  // namespace livetet
