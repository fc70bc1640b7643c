#include "mesh/mesh_pieces.hpp"

#include <algorithm>
#include <unordered_map>

#include "base/disjoint_sets.hpp"
#include "mesh/hex_grid.hpp"

namespace livetet {

std::vector<MeshPiece> mesh_pieces(const TetMesh& mesh) {
    const std::size_t cells = cell_count(mesh);
    DisjointSets joined(mesh.nodes.size());
    for (std::size_t e = 0; e < cells; ++e)
        for (const std::int32_t n : corners_of_cell(mesh, e))
            joined.join(corners_of_cell(mesh, e)[0], n);
    std::unordered_map<std::int32_t, std::size_t> piece_of;
    std::vector<MeshPiece> pieces;
    const bool is_grid = !mesh.hexahedra.empty();
    const double full = is_grid ? cell_volume(mesh) : 0;
    for (std::size_t e = 0; e < cells; ++e) {
        const auto corners = corners_of_cell(mesh, e);
        const auto [found, fresh] = piece_of.try_emplace(joined.find(corners[0]), pieces.size());
        if (fresh) pieces.emplace_back();
        MeshPiece& piece = pieces[found->second];
        double volume = is_grid ? full * mesh.shares[e] : signed_volume(mesh, mesh.tets[e]);
        if (!is_grid && !mesh.shares.empty()) volume *= mesh.shares[e / mesh.tets_per_element()];
        Vector3 middle = Vector3::Zero();
        for (const std::int32_t n : corners)
            middle += mesh.nodes[n] / static_cast<double>(corners.size());
        piece.cells.push_back(static_cast<std::int32_t>(e));
        piece.volume += volume;
        piece.centroid += volume * middle;
    }
    for (MeshPiece& piece : pieces) piece.centroid /= piece.volume;
    std::stable_sort(pieces.begin(), pieces.end(),
                     [](const MeshPiece& a, const MeshPiece& b) { return a.volume > b.volume; });
    return pieces;
}

std::vector<std::int32_t> nodes_of_pieces(std::span<const MeshPiece> pieces, const TetMesh& mesh) {
    std::vector<std::uint8_t> is_in(mesh.nodes.size(), 0);
    for (const MeshPiece& piece : pieces)
        for (const std::int32_t e : piece.cells) {
            for (const std::int32_t n : corners_of_cell(mesh, static_cast<std::size_t>(e)))
                is_in[n] = 1;
            if (mesh.edge_nodes.empty()) continue;
            for (const std::int32_t n : mesh.edge_nodes[e]) is_in[n] = 1;
        }
    std::vector<std::int32_t> nodes;
    for (std::size_t n = 0; n < is_in.size(); ++n)
        if (is_in[n]) nodes.push_back(static_cast<std::int32_t>(n));
    return nodes;
}

TetMesh without_cells(const TetMesh& mesh, std::span<const std::uint8_t> left_out) {
    TetMesh made;
    const bool is_grid = !mesh.hexahedra.empty();
    const std::size_t tets_a_cell = is_grid ? tets_per_hexahedron : 1;
    std::vector<std::int32_t> number(mesh.nodes.size(), -1);
    for (std::size_t e = 0; e < cell_count(mesh); ++e) {
        if (left_out[e]) continue;
        for (const std::int32_t n : corners_of_cell(mesh, e)) number[n] = 0;
        if (is_grid) {
            made.hexahedra.push_back(mesh.hexahedra[e]);
            made.shares.push_back(mesh.shares[e]);
        } else {
            made.tets.push_back(mesh.tets[e]);
        }
        for (std::size_t t = 0; t < tets_a_cell && !mesh.regions.empty(); ++t)
            made.regions.push_back(mesh.regions[tets_a_cell * e + t]);
    }
    for (std::size_t n = 0; n < number.size(); ++n) {
        if (number[n] < 0) continue;
        number[n] = static_cast<std::int32_t>(made.nodes.size());
        made.nodes.push_back(mesh.nodes[n]);
    }
    const auto renumber = [&](auto& cells) {
        for (auto& cell : cells)
            for (std::int32_t& n : cell) n = number[n];
    };
    renumber(made.hexahedra);
    renumber(made.tets);
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
    if (is_grid) made.tets = tets_of_hexahedra(made.hexahedra);
    return made;
}

}  // namespace livetet
