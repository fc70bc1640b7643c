#include "mesh/hex_cut.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <unordered_map>

#include "base/disjoint_sets.hpp"
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

/// A place's number in a grid of so many cells.
class PlaceNumbers {
  public:
    explicit PlaceNumbers(const std::vector<HexPlace>& places) {
        for (const HexPlace& place : places)
            for (int d = 0; d < 3; ++d) size_[d] = std::max(size_[d], place[d] + 1);
    }
    std::int32_t size(int axis) const { return size_[axis]; }
    /// Of the link from a place along an axis.
    std::int64_t of_link(const HexPlace& lower, int axis) const {
        return ((std::int64_t{lower[2]} * size_[1] + lower[1]) * size_[0] + lower[0]) * 3 + axis;
    }

  private:
    HexPlace size_{0, 0, 0};
};

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

std::vector<std::uint8_t> crossed_by(const HexLevel& level, const GridFrame& frame,
                                     const TriangleMesh& surface, const std::string& where) {
    const PlaceNumbers numbers(level.places);
    const std::vector<LatticePoint> points = on_lattice(surface, frame, where);
    std::vector<std::int64_t> crossed;
    for (const Triangle& t : surface.triangles)
        add_crossed(LatticeTriangle({points[t[0]], points[t[1]], points[t[2]]}), numbers, crossed);
    std::sort(crossed.begin(), crossed.end());
    std::vector<std::uint8_t> cut;
    cut.reserve(level.links.size());
    for (const HexLink& link : level.links)
        cut.push_back(std::binary_search(crossed.begin(), crossed.end(),
                                         numbers.of_link(level.places[link.lower], link.axis)));
    return cut;
}

/// Whether a point of a patch's plane lies in the patch, or not farther from it than `rounding`, m.
bool is_in_patch(const PlanePatch& patch, const Vector3& x, double rounding) {
    const Vector3 arm = x - patch.point;
    if (patch.radius) return arm.norm() <= *patch.radius + rounding;
    if (!patch.edges) return true;
    Eigen::Matrix<double, 3, 2> edges;
    edges << (*patch.edges)[0], (*patch.edges)[1];
    // Coordinates along the edges, from the middle.
    const Eigen::Vector2d at = (edges.transpose() * edges).inverse() * (edges.transpose() * arm);
    const double shorter = edges.colwise().norm().minCoeff();
    return at.lpNorm<Eigen::Infinity>() <= 0.5 + rounding / shorter;
}

std::vector<std::uint8_t> crossed_by(const HexLevel& level, const GridFrame& frame,
                                     const PlanePatch& patch) {
    const Vector3 normal = patch.normal.normalized();
    // Centres that lie in the plane but for rounding are on one side, whatever the rounding.
    const double rounding = 1e-9 * frame.axes.colwise().norm().minCoeff();
    const auto height = [&](std::int32_t cell) {
        return (frame.centre(level.places[cell]) - patch.point).dot(normal) + rounding;
    };
    std::vector<std::uint8_t> cut;
    cut.reserve(level.links.size());
    for (const HexLink& link : level.links) {
        const double below = height(link.lower), above = height(link.upper);
        bool crosses = (below >= 0) != (above >= 0);
        if (crosses) {
            const Vector3 from = frame.centre(level.places[link.lower]),
                          to = frame.centre(level.places[link.upper]);
            crosses =
                is_in_patch(patch, from + below / (below - above) * (to - from), 4 * rounding);
        }
        cut.push_back(crosses);
    }
    return cut;
}

/// Sorted and without duplicates.
void tidy(std::vector<std::int32_t>& nodes) {
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
}

/// The triangles of a set with the nodes of a cell that they bound: a corner of one tet of `before`
/// is the same corner of that tet of `after`.
std::map<std::string, std::vector<Triangle>> moved_sets(const TetMesh& before,
                                                        const std::vector<Tet>& after) {
    std::map<std::string, std::vector<Triangle>> sets = before.triangle_sets;
    if (sets.empty()) return sets;
    const auto sorted = [](Triangle t) {
        std::sort(t.begin(), t.end());
        return t;
    };
    std::map<Triangle, std::vector<Triangle*>> wanted;
    for (auto& [name, triangles] : sets)
        for (Triangle& t : triangles) wanted[sorted(t)].push_back(&t);
    for (std::size_t e = 0; e < before.tets.size() && !wanted.empty(); ++e)
        for (int opposite = 0; opposite < 4; ++opposite) {
            Triangle face{};
            for (int i = 0, k = 0; i < 4; ++i)
                if (i != opposite) face[k++] = before.tets[e][i];
            const auto found = wanted.find(sorted(face));
            if (found == wanted.end()) continue;
            for (Triangle* t : found->second)
                for (std::int32_t& n : *t)
                    n = after[e][std::find(before.tets[e].begin(), before.tets[e].end(), n) -
                                 before.tets[e].begin()];
            wanted.erase(found);
        }
    return sets;
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

std::vector<std::uint8_t> crossed_links(const HexLevel& level, const GridFrame& frame,
                                        const CutSurface& surface, const std::string& where) {
    if (const auto* patch = std::get_if<PlanePatch>(&surface))
        return crossed_by(level, frame, *patch);
    return crossed_by(level, frame, std::get<TriangleMesh>(surface), where);
}

TetMesh without_links(const TetMesh& mesh, const HexLevel& level,
                      std::span<const std::uint8_t> cut) {
    std::vector<HexLink> links;
    for (std::size_t l = 0; l < level.links.size(); ++l)
        if (!cut[l]) links.push_back(level.links[l]);
    const HexLevel opened = make_hex_level(level.places, std::move(links));
    TetMesh made = mesh;
    std::vector<std::int32_t> number(static_cast<std::size_t>(opened.nodes), -1);
    std::vector<std::uint8_t> is_taken(mesh.nodes.size(), 0);
    std::vector<std::int32_t> original;  // of each copy
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e)
        for (int c = 0; c < 8; ++c) {
            const std::int32_t old = mesh.hexahedra[e][c];
            std::int32_t& n = number[opened.cells[e][c]];
            if (n < 0 && is_taken[old]) {
                n = static_cast<std::int32_t>(mesh.nodes.size() + original.size());
                original.push_back(old);
            } else if (n < 0) {
                is_taken[old] = 1;
                n = old;
            }
            made.hexahedra[e][c] = n;
        }
    for (const std::int32_t old : original) made.nodes.push_back(mesh.nodes[old]);
    for (auto& [name, nodes] : made.node_sets) {
        std::vector<std::uint8_t> is_in(mesh.nodes.size(), 0);
        for (const std::int32_t n : nodes) is_in[n] = 1;
        for (std::size_t k = 0; k < original.size(); ++k)
            if (is_in[original[k]])
                nodes.push_back(static_cast<std::int32_t>(mesh.nodes.size() + k));
        tidy(nodes);
    }
    made.tets = tets_of_hexahedra(made.hexahedra);
    made.triangle_sets = moved_sets(mesh, made.tets);
    return made;
}

std::vector<GridPiece> grid_pieces(const TetMesh& mesh) {
    DisjointSets joined(mesh.nodes.size());
    for (const Hexahedron& cell : mesh.hexahedra)
        for (int c = 1; c < 8; ++c) joined.join(cell[0], cell[c]);
    std::unordered_map<std::int32_t, std::size_t> piece_of;
    std::vector<GridPiece> pieces;
    const double full = cell_volume(mesh);
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
        const Hexahedron& cell = mesh.hexahedra[e];
        const auto [found, fresh] = piece_of.try_emplace(joined.find(cell[0]), pieces.size());
        if (fresh) pieces.emplace_back();
        GridPiece& piece = pieces[found->second];
        const double volume = full * mesh.shares[e];
        piece.cells.push_back(static_cast<std::int32_t>(e));
        piece.volume += volume;
        piece.centroid += volume / 2 * (mesh.nodes[cell[0]] + mesh.nodes[cell[7]]);
    }
    for (GridPiece& piece : pieces) piece.centroid /= piece.volume;
    std::stable_sort(pieces.begin(), pieces.end(),
                     [](const GridPiece& a, const GridPiece& b) { return a.volume > b.volume; });
    return pieces;
}

TetMesh without_cells(const TetMesh& mesh, std::span<const std::uint8_t> left_out) {
    TetMesh made;
    std::vector<std::int32_t> number(mesh.nodes.size(), -1);
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
        if (left_out[e]) continue;
        for (const std::int32_t n : mesh.hexahedra[e]) number[n] = 0;
        made.hexahedra.push_back(mesh.hexahedra[e]);
        made.shares.push_back(mesh.shares[e]);
        for (std::size_t t = 0; t < tets_per_hexahedron && !mesh.regions.empty(); ++t)
            made.regions.push_back(mesh.regions[tets_per_hexahedron * e + t]);
    }
    for (std::size_t n = 0; n < number.size(); ++n) {
        if (number[n] < 0) continue;
        number[n] = static_cast<std::int32_t>(made.nodes.size());
        made.nodes.push_back(mesh.nodes[n]);
    }
    for (Hexahedron& cell : made.hexahedra)
        for (std::int32_t& n : cell) n = number[n];
    for (const auto& [name, nodes] : mesh.node_sets) {
        std::vector<std::int32_t>& kept = made.node_sets[name];
        for (const std::int32_t n : nodes)
            if (number[n] >= 0) kept.push_back(number[n]);
    }
    for (const auto& [name, triangles] : mesh.triangle_sets) {
        std::vector<Triangle>& kept = made.triangle_sets[name];
        for (const Triangle& t : triangles)
            if (number[t[0]] >= 0 && number[t[1]] >= 0 && number[t[2]] >= 0)
                kept.push_back({number[t[0]], number[t[1]], number[t[2]]});
    }
    made.tets = tets_of_hexahedra(made.hexahedra);
    return made;
}

}  // namespace livetet
