#include "mesh/link_crossings.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"

namespace livetet {

namespace {

/// Holds sums of products of three coordinates of at most 41 bits.
__extension__ using Wide = __int128;

using LatticePoint = std::array<std::int64_t, 3>;

/// Lattice steps of a cell's edge, and the farthest corner of a triangle from the grid.
constexpr std::int64_t steps_a_cell = std::int64_t{1} << 20, half_cell = steps_a_cell / 2;
constexpr double farthest_cells = 1 << 20;

int sign_of(Wide value) { return value > 0 ? 1 : value < 0 ? -1 : 0; }

/// The first that is not zero.
int first_sign(Wide a, Wide b, Wide c = 0) {
    if (a != 0) return sign_of(a);
    return b != 0 ? sign_of(b) : sign_of(c);
}

/// A triangle on the lattice, and which centres it lies between.
///
/// Links run along the grid's axes. So a link along axis d crosses the triangle if its line does,
/// which is decided in the projection along d, and if its two centres are on different sides of the
/// triangle's plane. Both are signs of integers; where one is zero, that of the centre moved by
/// (e, e^2, e^3) decides.
class LatticeTriangle {
  public:
    explicit LatticeTriangle(const std::array<LatticePoint, 3>& corners) : corners_(corners) {
        for (int d = 0; d < 3; ++d) {
            const int u = (d + 1) % 3, v = (d + 2) % 3;
            normal_[d] = edge(1, u) * edge(2, v) - edge(1, v) * edge(2, u);
        }
    }

    /// Whether the line along `axis` through the centre at `place` crosses it.
    bool is_on_line(const HexPlace& place, int axis) const {
        if (normal_[axis] == 0) return false;
        const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
        const int first = side_of_edge(0, place, u, v);
        return first == side_of_edge(1, place, u, v) && first == side_of_edge(2, place, u, v);
    }

    /// 1 or -1: the side of its plane that the centre at `place` is on.
    int side(const HexPlace& place) const {
        Wide s = 0;
        for (int d = 0; d < 3; ++d) s += normal_[d] * (centre(place, d) - corners_[0][d]);
        return s != 0 ? sign_of(s) : first_sign(normal_[0], normal_[1], normal_[2]);
    }

    /// Where the line along `axis` through a centre meets its plane, in places; rounded.
    double crossing(HexPlace place, int axis) const {
        place[axis] = 0;
        double s = 0;
        for (int d = 0; d < 3; ++d)
            s += static_cast<double>(normal_[d]) *
                 static_cast<double>(centre(place, d) - corners_[0][d]);
        return -s / (static_cast<double>(normal_[axis]) * static_cast<double>(steps_a_cell));
    }

    /// First and last place along an axis whose centre may be within its extent.
    std::pair<std::int32_t, std::int32_t> places(int axis, std::int32_t size) const {
        const auto [low, high] =
            std::minmax({corners_[0][axis], corners_[1][axis], corners_[2][axis]});
        const auto place = [&](std::int64_t x) {
            return std::floor(static_cast<double>(x - half_cell) / steps_a_cell);
        };
        return {static_cast<std::int32_t>(std::clamp<double>(place(low), 0, size)),
                static_cast<std::int32_t>(std::clamp<double>(place(high) + 1, -1, size - 1))};
    }

  private:
    static Wide centre(const HexPlace& place, int d) { return place[d] * steps_a_cell + half_cell; }
    Wide edge(int corner, int d) const { return corners_[corner][d] - corners_[0][d]; }

    /// The side of an edge's projection along the third axis; u < v.
    int side_of_edge(int k, const HexPlace& place, int u, int v) const {
        const LatticePoint &a = corners_[k], &b = corners_[(k + 1) % 3];
        const Wide du = b[u] - a[u], dv = b[v] - a[v];
        const Wide s = du * (centre(place, v) - a[v]) - dv * (centre(place, u) - a[u]);
        return s != 0 ? sign_of(s) : first_sign(-dv, du);
    }

    std::array<LatticePoint, 3> corners_;
    std::array<Wide, 3> normal_{};
};

/// Appends the numbers of the links that a triangle crosses.
void add_crossed(const LatticeTriangle& triangle, const PlaceNumbers& numbers,
                 std::vector<std::int64_t>& crossed) {
    for (int axis = 0; axis < 3; ++axis) {
        const int u = axis == 0 ? 1 : 0, v = axis == 2 ? 1 : 2;
        const auto [u_first, u_last] = triangle.places(u, numbers.size(u));
        const auto [v_first, v_last] = triangle.places(v, numbers.size(v));
        HexPlace place{};
        for (place[v] = v_first; place[v] <= v_last; ++place[v])
            for (place[u] = u_first; place[u] <= u_last; ++place[u]) {
                if (!triangle.is_on_line(place, axis)) continue;
                const double at = std::clamp(std::floor(triangle.crossing(place, axis)), -2.0,
                                             static_cast<double>(numbers.size(axis)));
                // The rounded crossing may be off by one; the sides are exact.
                for (int k = static_cast<int>(at) - 1; k <= static_cast<int>(at) + 1; ++k) {
                    if (k < 0 || k + 1 >= numbers.size(axis)) continue;
                    HexPlace lower = place, upper = place;
                    lower[axis] = k, upper[axis] = k + 1;
                    if (triangle.side(lower) != triangle.side(upper))
                        crossed.push_back(numbers.of_link(lower, axis));
                }
            }
    }
}

std::vector<LatticePoint> on_lattice(const TriangleMesh& surface, const GridFrame& frame,
                                     const std::string& where) {
    const Eigen::Matrix3d in_cells = frame.axes.inverse();
    std::vector<LatticePoint> points;
    points.reserve(surface.nodes.size());
    for (const Vector3& x : surface.nodes) {
        const Vector3 q = in_cells * (x - frame.corner);
        if (!(q.lpNorm<Eigen::Infinity>() < farthest_cells))  // so that NaN fails
            fail(
                "{}: the corner ({:.4g}, {:.4g}, {:.4g}) mm of a triangle is more than {:.0f} "
                "cells from the grid, expected a surface in its coordinates",
                where, 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z(), farthest_cells);
        LatticePoint& point = points.emplace_back();
        for (int d = 0; d < 3; ++d)
            point[d] = std::llround(q[d] * static_cast<double>(steps_a_cell));
    }
    return points;
}

}  // namespace

GridFrame grid_frame(const TetMesh& mesh, const HexLevel& level) {
    GridFrame frame;
    const Hexahedron& cell = mesh.hexahedra.front();
    for (int d = 0; d < 3; ++d) frame.axes.col(d) = mesh.nodes[cell[1 << d]] - mesh.nodes[cell[0]];
    const HexPlace& place = level.places.front();
    frame.corner = mesh.nodes[cell[0]] - frame.axes * Vector3(place[0], place[1], place[2]);
    return frame;
}

LinkCrossings::LinkCrossings(const HexLevel& level, const GridFrame& frame)
    : numbers_(level.places), frame_(frame) {
    links_.reserve(level.links.size());
    for (std::size_t l = 0; l < level.links.size(); ++l) {
        const HexLink& link = level.links[l];
        links_.emplace_back(numbers_.of_link(level.places[link.lower], link.axis),
                            static_cast<std::int32_t>(l));
    }
    std::sort(links_.begin(), links_.end());
}

std::size_t LinkCrossings::mark(const TriangleMesh& surface, std::span<std::uint8_t> cut,
                                const std::string& where) const {
    const std::vector<LatticePoint> points = on_lattice(surface, frame_, where);
    std::vector<std::int64_t> crossed;
    for (const Triangle& t : surface.triangles)
        add_crossed(LatticeTriangle({points[t[0]], points[t[1]], points[t[2]]}), numbers_, crossed);
    std::size_t fresh = 0;
    for (const std::int64_t number : crossed)
        for (auto link = std::lower_bound(links_.begin(), links_.end(), std::pair{number, 0});
             link != links_.end() && link->first == number; ++link) {
            fresh += cut[link->second] == 0;
            cut[link->second] = 1;
        }
    return fresh;
}

}  // namespace livetet
