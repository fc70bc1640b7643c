#include "mesh/segment_crossings.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <unsupported/Eigen/BVH>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "base/error.hpp"

namespace livetet {

namespace {

/// Holds sums of products of three coordinates of at most 38 bits.
__extension__ using Wide = __int128;
using WideVector = std::array<Wide, 3>;
using LatticePoint = std::array<std::int64_t, 3>;

constexpr double steps_a_side = 1 << 30, farthest_sides = 100;

int sign_of(Wide value) { return value > 0 ? 1 : value < 0 ? -1 : 0; }

/// The sign of `value`, or where that is zero, of its change as points move by (e, e^2, e^3).
int sign_of(Wide value, const WideVector& change) {
    if (value != 0) return sign_of(value);
    for (const Wide c : change)
        if (c != 0) return sign_of(c);
    return 0;
}

WideVector minus(const LatticePoint& a, const LatticePoint& b) {
    return {Wide{a[0]} - b[0], Wide{a[1]} - b[1], Wide{a[2]} - b[2]};
}

WideVector cross(const WideVector& a, const WideVector& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Wide dot(const WideVector& a, const WideVector& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

using LatticeTriangle = std::array<LatticePoint, 3>;

/// The side of the triangle's plane that `p` is on: the sign of n . (p - a), n = (b - a) x (c - a).
int side_of_plane(const LatticeTriangle& t, const LatticePoint& p) {
    const WideVector n = cross(minus(t[1], t[0]), minus(t[2], t[0]));
    return sign_of(dot(n, minus(p, t[0])), n);
}

/// The side of the edge from a to b on which the line from p to q passes: the sign of
///
///     d . ((a - p) x (b - p)),      d = q - p,
///
/// which changes by -delta . ((b - a) x d) as p and q move by delta.
int side_of_edge(const LatticePoint& p, const LatticePoint& q, const LatticePoint& a,
                 const LatticePoint& b) {
    const WideVector d = minus(q, p);
    return sign_of(dot(d, cross(minus(a, p), minus(b, p))), cross(d, minus(b, a)));
}

bool crosses(const LatticeTriangle& t, const LatticePoint& p, const LatticePoint& q) {
    if (side_of_plane(t, p) == side_of_plane(t, q)) return false;
    const int first = side_of_edge(p, q, t[0], t[1]);
    return first == side_of_edge(p, q, t[1], t[2]) && first == side_of_edge(p, q, t[2], t[0]);
}

/// The share of the way from p to q at the triangle's plane; rounded.
double share_at_plane(const LatticeTriangle& t, const LatticePoint& p, const LatticePoint& q) {
    const WideVector n = cross(minus(t[1], t[0]), minus(t[2], t[0]));
    const auto below = static_cast<double>(dot(n, minus(p, t[0])));
    const auto above = static_cast<double>(dot(n, minus(q, t[0])));
    return below == above ? 0.5 : std::clamp(below / (below - above), 0.0, 1.0);
}

using Box = Eigen::AlignedBox3d;

}  // namespace

struct SegmentCrossings::Triangles {
    Vector3 corner = Vector3::Zero();  ///< of the points' box, m
    double step = 1;                   ///< of the lattice, m
    std::vector<LatticeTriangle> lattice;
    Eigen::KdBVH<double, 3, int> tree;  ///< of their boxes, in steps

    LatticePoint rounded(const Vector3& x) const {
        const Vector3 q = (x - corner) / step;
        return {std::llround(q[0]), std::llround(q[1]), std::llround(q[2])};
    }
};

namespace {

Vector3 place_of(const LatticePoint& p) {
    return Eigen::Matrix<std::int64_t, 3, 1>(p[0], p[1], p[2]).cast<double>();
}

Vector3 normal_of(const LatticeTriangle& t) {
    const WideVector n = cross(minus(t[1], t[0]), minus(t[2], t[0]));
    return Vector3(static_cast<double>(n[0]), static_cast<double>(n[1]), static_cast<double>(n[2]))
        .normalized();
}

/// The edges of the border of a parallelogram or, but for 0.1 % of its radius, a disc.
SurfaceBorder border_of(const PlanePatch& patch) {
    std::vector<Vector3> corners;
    if (patch.edges) {
        const auto& [a, b] = *patch.edges;
        for (const auto& [s, t] : {std::pair{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}})
            corners.push_back(patch.point + s * a + t * b);
    } else if (patch.radius) {
        constexpr int count = 72;
        const Vector3 a = patch.normal.unitOrthogonal(), b = patch.normal.normalized().cross(a);
        for (int k = 0; k < count; ++k) {
            const double angle = 2 * std::numbers::pi * k / count;
            corners.push_back(patch.point +
                              *patch.radius * (std::cos(angle) * a + std::sin(angle) * b));
        }
    }
    SurfaceBorder edges;
    for (std::size_t k = 0; k < corners.size(); ++k)
        edges.push_back({corners[k], corners[(k + 1) % corners.size()]});
    return edges;
}

/// The edges that belong to one triangle. Those with the same places of their ends are one edge.
SurfaceBorder border_of(const std::vector<LatticeTriangle>& triangles, const auto& place) {
    std::map<std::array<LatticePoint, 2>, int> count;
    for (const LatticeTriangle& t : triangles) {
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;  // no more than an edge
        for (int k = 0; k < 3; ++k) {
            const auto& [low, high] = std::minmax(t[k], t[(k + 1) % 3]);
            ++count[{low, high}];
        }
    }
    SurfaceBorder edges;
    for (const auto& [edge, times] : count)
        if (times == 1) edges.push_back({place(edge[0]), place(edge[1])});
    return edges;
}

/// A search of Eigen's tree for the triangles that a segment crosses.
struct CrossingSearch {
    const std::vector<LatticeTriangle>& triangles;
    LatticePoint from, to;
    Box box;
    SegmentCrossing found{};

    bool intersectVolume(const Box& other) const { return box.intersects(other); }  // NOLINT: name
    bool intersectObject(int t) {                                                   // NOLINT: name
        if (!crosses(triangles[t], from, to)) return false;
        const double share = share_at_plane(triangles[t], from, to);
        if (found.count == 0 || share < found.first) {
            found.first = share;
            found.normal = normal_of(triangles[t]);
        }
        ++found.count;
        return false;  // go on
    }
};

}  // namespace

SegmentCrossings::SegmentCrossings(const CutSurface& surface, std::span<const Vector3> points,
                                   const std::string& where) {
    Box box;
    for (const Vector3& x : points) box.extend(x);
    const double side = box.sizes().maxCoeff();
    if (const auto* patch = std::get_if<PlanePatch>(&surface)) {
        patch_ = *patch;
        patch_.normal.normalize();
        rounding_ = 1e-12 * side;
        return;
    }
    const auto& mesh = std::get<TriangleMesh>(surface);
    triangles_ = std::make_unique<Triangles>();
    triangles_->corner = box.min();
    triangles_->step = side / steps_a_side;
    for (const Vector3& x : mesh.nodes)
        if (!x.allFinite() || box.exteriorDistance(x) > farthest_sides * side)
            fail(
                "{}: the corner ({:.4g}, {:.4g}, {:.4g}) mm of a triangle is more than {:.0f} "
                "times the body's size from it, expected a surface in its coordinates",
                where, 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z(), farthest_sides);
    std::vector<Box> boxes;
    std::vector<int> numbers;
    for (const Triangle& t : mesh.triangles) {
        const LatticeTriangle corners{triangles_->rounded(mesh.nodes[t[0]]),
                                      triangles_->rounded(mesh.nodes[t[1]]),
                                      triangles_->rounded(mesh.nodes[t[2]])};
        Box around;
        for (const LatticePoint& p : corners) around.extend(place_of(p));
        numbers.push_back(static_cast<int>(numbers.size()));
        triangles_->lattice.push_back(corners);
        boxes.push_back(around);
    }
    triangles_->tree.init(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());
}

SegmentCrossings::~SegmentCrossings() = default;

SegmentCrossing SegmentCrossings::with_patch(const Vector3& from, const Vector3& to) const {
    const double below = (from - patch_.point).dot(patch_.normal) + rounding_,
                 above = (to - patch_.point).dot(patch_.normal) + rounding_;
    if ((below >= 0) == (above >= 0)) return {};
    const double share = below / (below - above);
    if (!is_in_patch(patch_, from + share * (to - from), 4 * rounding_)) return {};
    return {1, std::clamp(share, 0.0, 1.0), patch_.normal};
}

SurfaceBorder SegmentCrossings::border() const {
    if (!triangles_) return border_of(patch_);
    return border_of(triangles_->lattice, [&](const LatticePoint& p) -> Vector3 {
        return triangles_->corner + triangles_->step * place_of(p);
    });
}

std::optional<Vector3> nearest_on(const SurfaceBorder& border, const Vector3& x, double within) {
    std::optional<Vector3> nearest;
    for (const auto& [a, b] : border) {
        const Vector3 way = b - a;
        const double length = way.squaredNorm();
        const double share = length > 0 ? std::clamp((x - a).dot(way) / length, 0.0, 1.0) : 0;
        const Vector3 there = a + share * way;
        if ((there - x).norm() > within) continue;
        within = (there - x).norm();
        nearest = there;
    }
    return nearest;
}

SegmentCrossing SegmentCrossings::between(const Vector3& from, const Vector3& to) const {
    if (!triangles_) return with_patch(from, to);
    CrossingSearch search{
        triangles_->lattice, triangles_->rounded(from), triangles_->rounded(to), {}};
    search.box.extend(place_of(search.from)).extend(place_of(search.to));
    if (!triangles_->lattice.empty()) Eigen::BVIntersect(triangles_->tree, search);
    return search.found;
}

}  // namespace livetet
