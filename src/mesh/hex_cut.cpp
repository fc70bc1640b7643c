#include "mesh/hex_cut.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include "base/disjoint_sets.hpp"
#include "mesh/link_crossings.hpp"

namespace livetet {

namespace {

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

std::vector<std::uint8_t> crossed_links(const HexLevel& level, const GridFrame& frame,
                                        const CutSurface& surface, const std::string& where) {
    if (const auto* patch = std::get_if<PlanePatch>(&surface))
        return crossed_by(level, frame, *patch);
    std::vector<std::uint8_t> cut(level.links.size(), 0);
    LinkCrossings(level, frame).mark(std::get<TriangleMesh>(surface), cut, where);
    return cut;
}

OpenedGrid open_links(const TetMesh& mesh, const HexLevel& level,
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
    return {std::move(made), std::move(original)};
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
