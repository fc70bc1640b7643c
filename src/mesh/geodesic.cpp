#include "mesh/geodesic.hpp"

#include <algorithm>
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

}  // namespace

std::map<std::int32_t, double> distances_on_surface(std::span<const Vector3> nodes,
                                                    std::span<const Triangle> triangles,
                                                    const SurfacePoint& from, double radius) {
    // A path along the surface is no shorter than the straight line.
    std::vector<Triangle> near{triangles[from.triangle]};
    for (const Triangle& t : triangles) {
        const Vector3 &a = nodes[t[0]], &b = nodes[t[1]], &c = nodes[t[2]];
        const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
        if ((a - from.place).norm() <= radius + longest) near.push_back(t);
    }
    return PointGraph(nodes, near).distances(0, from.place, radius);
}

}  // namespace livetet
