#include "meshing/shells.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "geometry/triangle_area.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {

namespace {

/// A shell by the triangles of the surface that it is a part of.
struct Shell {
    std::vector<Triangle> triangles;  ///< with the nodes of the whole surface
    double volume_m3 = 0;             ///< signed
};

/// The connected parts of a surface; those of larger volume, whatever its sign, first.
std::vector<Shell> shells_of(const TriangleMesh& surface) {
    const std::vector<std::int32_t> parts = connected_parts(surface);
    std::vector<Shell> shells;
    for (std::size_t i = 0; i < parts.size(); ++i) {
        if (static_cast<std::size_t>(parts[i]) >= shells.size()) shells.emplace_back();
        shells[parts[i]].triangles.push_back(surface.triangles[i]);
    }
    for (Shell& shell : shells) {
        const Vector3 origin = surface.nodes[shell.triangles.front()[0]];
        for (const auto& [a, b, c] : shell.triangles)
            shell.volume_m3 +=
                (surface.nodes[a] - origin)
                    .dot((surface.nodes[b] - origin).cross(surface.nodes[c] - origin)) /
                6;
    }
    std::stable_sort(shells.begin(), shells.end(), [](const Shell& a, const Shell& b) {
        return std::abs(a.volume_m3) > std::abs(b.volume_m3);
    });
    return shells;
}

/// The triangles with only their nodes.
TriangleMesh compact(std::span<const Vector3> nodes, std::span<const Triangle> triangles) {
    const std::vector<std::int32_t> used = nodes_of(triangles);
    TriangleMesh surface;
    for (const std::int32_t n : used) surface.nodes.push_back(nodes[n]);
    for (Triangle t : triangles) {
        for (std::int32_t& n : t)
            n = static_cast<std::int32_t>(std::lower_bound(used.begin(), used.end(), n) -
                                          used.begin());
        surface.triangles.push_back(t);
    }
    return surface;
}

void add_sets(TetMesh& mesh, const std::string& name, const std::vector<Triangle>& triangles) {
    std::vector<Triangle>& all = mesh.triangle_sets[name];
    all.insert(all.end(), triangles.begin(), triangles.end());
    mesh.node_sets[name] = nodes_of(all);
}

/// The nodes of each connected piece of the mesh, by the lowest node of the piece.
std::vector<std::vector<std::int32_t>> nodes_by_piece(const TetMesh& mesh) {
    std::vector<std::int32_t> root(mesh.nodes.size());
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](std::int32_t n) {
        while (root[n] != n) n = root[n] = root[root[n]];
        return n;
    };
    for (const Tet& t : mesh.tets)
        for (int k = 1; k < 4; ++k) {
            const std::int32_t a = find(t[0]), b = find(t[k]);
            root[std::max(a, b)] = std::min(a, b);
        }
    std::map<std::int32_t, std::pair<double, std::vector<std::int32_t>>> pieces;
    for (std::int32_t n = 0; n < static_cast<std::int32_t>(root.size()); ++n)
        pieces[find(n)].second.push_back(n);
    for (const Tet& t : mesh.tets) pieces[find(t[0])].first += signed_volume(mesh, t);
    std::vector<std::pair<double, std::vector<std::int32_t>>> sorted;
    for (auto& [first, piece] : pieces) sorted.push_back(std::move(piece));
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::vector<std::vector<std::int32_t>> nodes;
    for (auto& [volume, piece] : sorted) nodes.push_back(std::move(piece));
    return nodes;
}

}  // namespace

double BodyPiece::volume_m3() const {
    double sum = signed_volume(outer);
    for (const TriangleMesh& cavity : cavities) sum += signed_volume(cavity);
    return sum;
}

double winding_number(std::span<const Vector3> nodes, std::span<const Triangle> triangles,
                      const Vector3& position) {
    double angle = 0;
    for (const auto& [i, j, k] : triangles) {
        const Vector3 a = nodes[i] - position, b = nodes[j] - position, c = nodes[k] - position;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        angle += 2 * std::atan2(a.dot(b.cross(c)),
                                la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return angle / (4 * std::numbers::pi);
}

TriangleMesh joined(std::span<const TriangleMesh> surfaces) {
    TriangleMesh all;
    for (const TriangleMesh& s : surfaces) {
        const auto first = static_cast<std::int32_t>(all.nodes.size());
        all.nodes.insert(all.nodes.end(), s.nodes.begin(), s.nodes.end());
        for (const auto& [a, b, c] : s.triangles)
            all.triangles.push_back({first + a, first + b, first + c});
    }
    return all;
}

TriangleMesh joined(std::span<const BodyPiece> pieces) {
    std::vector<TriangleMesh> surfaces;
    for (const BodyPiece& piece : pieces) {
        surfaces.push_back(piece.outer);
        surfaces.insert(surfaces.end(), piece.cavities.begin(), piece.cavities.end());
    }
    return joined(surfaces);
}

std::vector<std::vector<std::vector<Triangle>>> shells_by_piece(const TriangleMesh& surface) {
    struct Piece {
        double volume_m3;
        std::vector<std::vector<Triangle>> shells;
    };
    std::vector<Piece> pieces;
    std::vector<Shell> hollows;
    for (Shell& shell : shells_of(surface))
        if (shell.volume_m3 > 0)
            pieces.push_back({shell.volume_m3, {std::move(shell.triangles)}});
        else
            hollows.push_back(std::move(shell));
    for (Shell& hollow : hollows) {
        const auto& [a, b, c] = hollow.triangles.front();
        const Vector3 place = (surface.nodes[a] + surface.nodes[b] + surface.nodes[c]) / 3;
        // The outer shells are sorted: the last one around the place is the smallest.
        const auto around = std::find_if(pieces.rbegin(), pieces.rend(), [&](const Piece& piece) {
            return winding_number(surface.nodes, piece.shells.front(), place) > 0.5;
        });
        if (around == pieces.rend()) continue;
        around->volume_m3 += hollow.volume_m3;
        around->shells.push_back(std::move(hollow.triangles));
    }
    std::stable_sort(pieces.begin(), pieces.end(),
                     [](const Piece& a, const Piece& b) { return a.volume_m3 > b.volume_m3; });
    std::vector<std::vector<std::vector<Triangle>>> shells;
    for (Piece& piece : pieces) shells.push_back(std::move(piece.shells));
    return shells;
}

std::vector<BodyPiece> pieces_of(const TriangleMesh& surface) {
    std::vector<BodyPiece> pieces;
    for (const auto& shells : shells_by_piece(surface)) {
        BodyPiece& piece = pieces.emplace_back();
        piece.outer = compact(surface.nodes, shells.front());
        for (std::size_t s = 1; s < shells.size(); ++s)
            piece.cavities.push_back(compact(surface.nodes, shells[s]));
    }
    return pieces;
}

ShellCount count_shells(std::span<const BodyPiece> pieces) {
    ShellCount count{pieces.size(), 0};
    for (const BodyPiece& piece : pieces) count.cavities += piece.cavities.size();
    return count;
}

TriangleMesh largest_shells(const TriangleMesh& surface, const ShellCount& count) {
    std::vector<TriangleMesh> parts = parts_of(surface), kept;
    std::stable_sort(parts.begin(), parts.end(), [](const TriangleMesh& a, const TriangleMesh& b) {
        return std::abs(signed_volume(a)) > std::abs(signed_volume(b));
    });
    ShellCount found;
    for (TriangleMesh& part : parts)
        if (signed_volume(part) > 0 ? found.pieces++ < count.pieces
                                    : found.cavities++ < count.cavities)
            kept.push_back(std::move(part));
    return joined(kept);
}

void shift_to_volume(TriangleMesh& shell, double volume_m3) {
    constexpr int newton_steps = 4;
    for (int step = 0; step < newton_steps; ++step) {
        std::vector<Vector3> normals(shell.nodes.size(), Vector3::Zero());
        double area = 0;
        for (const Triangle& t : shell.triangles) {
            const Vector3 n = area_vector(shell.nodes, t);
            area += n.norm();
            for (const std::int32_t i : t) normals[i] += n;
        }
        const double shift = (volume_m3 - signed_volume(shell)) / area;
        for (std::size_t i = 0; i < normals.size(); ++i)
            shell.nodes[i] += shift * normals[i].normalized();
    }
}

void name_shells(TetMesh& mesh) {
    const std::vector<Shell> shells = shells_of({mesh.nodes, boundary_triangles(mesh.tets)});
    const auto cavities =
        std::count_if(shells.begin(), shells.end(), [](const Shell& s) { return s.volume_m3 < 0; });
    int number = 0;
    for (const Shell& shell : shells) {
        if (cavities == 0) break;
        add_sets(mesh, shell.volume_m3 < 0 ? "cavity" : "outer", shell.triangles);
        if (shell.volume_m3 < 0 && cavities > 1)
            add_sets(mesh, fmt::format("cavity_{}", ++number), shell.triangles);
    }
    if (shells.size() - static_cast<std::size_t>(cavities) < 2) return;
    number = 0;
    for (std::vector<std::int32_t>& nodes : nodes_by_piece(mesh))
        mesh.node_sets[fmt::format("part_{}", ++number)] = std::move(nodes);
}

}  // namespace livetet
