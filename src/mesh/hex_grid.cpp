#include "mesh/hex_grid.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

#include "base/counted.hpp"
#include "base/disjoint_sets.hpp"
#include "base/error.hpp"
#include "base/sliced_task.hpp"
#include "mesh/cut_ends.hpp"

namespace livetet {

namespace {

/// The corners of a face: the four with bit `axis` as `upper` says, in the same order on both
/// sides.
std::array<int, 4> face_corners(int axis, bool upper) {
    std::array<int, 4> corners{};
    int count = 0;
    for (int c = 0; c < 8; ++c)
        if ((c >> axis & 1) == static_cast<int>(upper)) corners[count++] = c;
    return corners;
}

HexPlace parent_place(const HexPlace& p) { return {p[0] >> 1, p[1] >> 1, p[2] >> 1}; }

Eigen::Matrix3d cell_axes(const TetMesh& mesh, const Hexahedron& cell) {
    Eigen::Matrix3d axes;
    for (int d = 0; d < 3; ++d) axes.col(d) = mesh.nodes[cell[1 << d]] - mesh.nodes[cell[0]];
    return axes;
}

void check_indices_and_shares(const TetMesh& mesh, const std::string& where) {
    if (mesh.hexahedra.empty()) fail("{}: found no hexahedra, expected a grid of them", where);
    if (mesh.shares.size() != mesh.hexahedra.size())
        fail("{}: found {} shares, expected one for each of {} hexahedra", where,
             mesh.shares.size(), mesh.hexahedra.size());
    const auto nodes = std::ssize(mesh.nodes);
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
        if (!(mesh.shares[e] > 0 && mesh.shares[e] <= 1))
            fail("{}: hexahedron {} has the share {}, expected more than 0 and at most 1", where, e,
                 mesh.shares[e]);
        for (const std::int32_t n : mesh.hexahedra[e]) {
            if (n < 0 || n >= nodes)
                fail("{}: hexahedron {} names node {}, expected 0 to {}", where, e, n, nodes - 1);
            if (!mesh.nodes[n].allFinite())
                fail("{}: node {} is not finite, expected metres", where, n);
        }
    }
}

/// Throws Error unless every cell is that of the first, moved by whole multiples of its axes.
std::vector<HexPlace> places_of(const TetMesh& mesh, const std::string& where) {
    check_indices_and_shares(mesh, where);
    const Eigen::Matrix3d axes = cell_axes(mesh, mesh.hexahedra.front());
    const double volume = axes.determinant(), longest = axes.colwise().norm().maxCoeff();
    if (!(volume > 1e-9 * longest * longest * longest))
        fail("{}: hexahedron 0 has a volume of {:.3g} mm^3, expected a right-handed cell", where,
             1e9 * volume);
    const Eigen::Matrix3d in_cells = axes.inverse();
    const Vector3 origin = mesh.nodes[mesh.hexahedra.front()[0]];
    constexpr double tolerance = 1e-3, farthest = 1 << 20;  // cells
    std::vector<HexPlace> places;
    HexPlace low{};
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
        pause_point_at(e);
        const Hexahedron& cell = mesh.hexahedra[e];
        const Vector3 at = in_cells * (mesh.nodes[cell[0]] - origin);
        const Vector3 whole = at.array().round();
        double off = (at - whole).lpNorm<Eigen::Infinity>();
        for (int c = 1; c < 8; ++c) {
            const Vector3 corner = in_cells * (mesh.nodes[cell[c]] - mesh.nodes[cell[0]]);
            off = std::max(
                off, (corner - Vector3(c & 1, c >> 1 & 1, c >> 2 & 1)).lpNorm<Eigen::Infinity>());
        }
        // Written so that NaN fails the test.
        if (!(off <= tolerance && whole.lpNorm<Eigen::Infinity>() < farthest))
            fail(
                "{}: hexahedron {} at ({:.1f}, {:.1f}, {:.1f}) mm does not fit the grid of the "
                "first one, expected equal cells at multiples of their edges",
                where, e, 1e3 * mesh.nodes[cell[0]].x(), 1e3 * mesh.nodes[cell[0]].y(),
                1e3 * mesh.nodes[cell[0]].z());
        HexPlace& place = places.emplace_back();
        for (int d = 0; d < 3; ++d) {
            place[d] = static_cast<std::int32_t>(whole[d]);
            low[d] = std::min(low[d], place[d]);
        }
    }
    for (HexPlace& place : places)
        for (int d = 0; d < 3; ++d) place[d] -= low[d];
    return places;
}

}  // namespace

HexLevel make_hex_level(std::vector<HexPlace> places, std::vector<HexLink> links) {
    DisjointSets corners(8 * places.size());
    for (const HexLink& link : links) {
        const auto above = face_corners(link.axis, true), below = face_corners(link.axis, false);
        for (int k = 0; k < 4; ++k)
            corners.join(8 * link.lower + above[k], 8 * link.upper + below[k]);
    }
    HexLevel level{std::move(places), std::move(links), {}, 0};
    // The place of each class of corners, and one corner of it.
    std::vector<std::pair<HexPlace, std::int32_t>> nodes;
    for (std::int32_t c = 0; c < static_cast<std::int32_t>(8 * level.places.size()); ++c) {
        if (corners.find(c) != c) continue;
        const HexPlace& cell = level.places[c / 8];
        nodes.push_back({{cell[2] + (c >> 2 & 1), cell[1] + (c >> 1 & 1), cell[0] + (c & 1)}, c});
    }
    std::sort(nodes.begin(), nodes.end());
    level.nodes = static_cast<std::int32_t>(nodes.size());
    std::vector<std::int32_t> number(8 * level.places.size());
    for (std::int32_t n = 0; n < level.nodes; ++n) number[nodes[n].second] = n;
    level.cells.resize(level.places.size());
    for (std::size_t c = 0; c < number.size(); ++c)
        level.cells[c / 8][c % 8] = number[corners.find(static_cast<std::int32_t>(c))];
    return level;
}

namespace {

/// The next coarser level as if the cells of `fine` had these links alone; sets `fine.parents`.
HexLevel coarsened(HexLevel& fine, std::span<const HexLink> links) {
    DisjointSets parts(fine.places.size());
    for (const HexLink& link : links)
        if (parent_place(fine.places[link.lower]) == parent_place(fine.places[link.upper]))
            parts.join(link.lower, link.upper);
    std::vector<HexPlace> places;
    std::vector<std::int32_t> number(fine.places.size(), -1);
    fine.parents.clear();
    for (std::size_t e = 0; e < fine.places.size(); ++e) {
        std::int32_t& of_part = number[parts.find(static_cast<std::int32_t>(e))];
        if (of_part < 0) {
            of_part = static_cast<std::int32_t>(places.size());
            places.push_back(parent_place(fine.places[e]));
        }
        fine.parents.push_back(of_part);
    }
    pause_point();
    std::vector<HexLink> of_parents;
    for (const HexLink& link : links)
        if (fine.parents[link.lower] != fine.parents[link.upper])
            of_parents.push_back({fine.parents[link.lower], fine.parents[link.upper], link.axis});
    std::sort(of_parents.begin(), of_parents.end());
    of_parents.erase(std::unique(of_parents.begin(), of_parents.end()), of_parents.end());
    pause_point();
    return make_hex_level(std::move(places), std::move(of_parents));
}

}  // namespace

HexLevel coarser_level(HexLevel& fine) {
    HexLevel coarse = coarsened(fine, fine.links);
    const std::vector<HexLink> open = links_without_cut_ends(fine);
    if (open.size() == fine.links.size()) return coarse;
    pause_point();
    const std::vector<std::int32_t> parents = fine.parents;
    HexLevel opened = coarsened(fine, open);
    if (count_pieces(opened) == count_pieces(coarse)) return opened;
    fine.parents = parents;
    return coarse;
}

HexLevel hex_level_of(const TetMesh& mesh, const std::string& where) {
    HexLevel level{
        places_of(mesh, where), {}, mesh.hexahedra, static_cast<std::int32_t>(mesh.nodes.size())};
    // Cells by place: the next along an axis is found by bisection.
    std::vector<std::int32_t> order(level.places.size());
    std::iota(order.begin(), order.end(), 0);
    const auto before = [&](std::int32_t a, const HexPlace& p) { return level.places[a] < p; };
    std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
        return std::tie(level.places[a], a) < std::tie(level.places[b], b);
    });
    for (std::size_t e = 0; e < level.places.size(); ++e) {
        pause_point_at(e);
        for (int axis = 0; axis < 3; ++axis) {
            const auto above = face_corners(axis, true), below = face_corners(axis, false);
            HexPlace next = level.places[e];
            ++next[axis];
            for (auto other = std::lower_bound(order.begin(), order.end(), next, before);
                 other != order.end() && level.places[*other] == next; ++other) {
                bool same = true;
                for (int k = 0; k < 4; ++k)
                    same = same && level.cells[e][above[k]] == level.cells[*other][below[k]];
                if (same) level.links.push_back({static_cast<std::int32_t>(e), *other, axis});
            }
        }
    }
    return level;
}

std::vector<HexLevel> hex_levels(const TetMesh& mesh, std::size_t enough) {
    std::vector<HexLevel> levels{hex_level_of(mesh, "grid")};
    while (levels.back().cells.size() > enough) {
        pause_point();
        HexLevel next = coarser_level(levels.back());
        if (2 * next.cells.size() > levels.back().cells.size()) {
            levels.back().parents.clear();
            break;
        }
        levels.push_back(std::move(next));
    }
    return levels;
}

std::vector<Tet> tets_of_hexahedra(std::span<const Hexahedron> hexahedra) {
    constexpr int orders[tets_per_hexahedron][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1},
                                                    {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
    std::vector<Tet> tets;
    tets.reserve(tets_per_hexahedron * hexahedra.size());
    for (const Hexahedron& cell : hexahedra)
        for (std::size_t o = 0; o < tets_per_hexahedron; ++o) {
            const int first = 1 << orders[o][0], second = first | 1 << orders[o][1];
            Tet t{cell[0], cell[first], cell[second], cell[7]};
            if (o >= 3) std::swap(t[2], t[3]);  // odd orders of the axes wind the other way
            tets.push_back(t);
        }
    return tets;
}

std::string elements_text(const TetMesh& mesh) {
    if (!mesh.quadratic_hexahedra.empty())
        return counted(mesh.quadratic_hexahedra.size(), "hexahedron", "hexahedra") + " of 27 nodes";
    return mesh.hexahedra.empty() ? counted(mesh.tets.size(), "tet")
                                  : counted(mesh.hexahedra.size(), "hexahedron", "hexahedra");
}

double cell_volume(const TetMesh& mesh) {
    return cell_axes(mesh, mesh.hexahedra.front()).determinant();
}

}  // namespace livetet
