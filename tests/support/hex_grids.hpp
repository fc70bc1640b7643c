#pragma once

#include <array>
#include <functional>
#include <map>

#include "mesh/hex_grid.hpp"

namespace livetet::test {

/// Whose element is that of the cell (see ElementShape<8>).
inline Tet corner_tet(const Hexahedron& cell) { return {cell[0], cell[1], cell[2], cell[4]}; }

/// A grid of n cells over the box [0, size] of those whose middle is `inside`; neighbours are
/// linked.
inline TetMesh hex_grid(
    std::array<int, 3> n, const Vector3& size,
    const std::function<bool(const Vector3&)>& inside = [](const Vector3&) { return true; }) {
    const Vector3 edge = size.cwiseQuotient(Vector3(n[0], n[1], n[2]));
    std::vector<HexPlace> places;
    std::map<HexPlace, std::int32_t> number;
    for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
            for (int i = 0; i < n[0]; ++i) {
                if (!inside(edge.cwiseProduct(Vector3(i + 0.5, j + 0.5, k + 0.5)))) continue;
                number[{i, j, k}] = static_cast<std::int32_t>(places.size());
                places.push_back({i, j, k});
            }
    std::vector<HexLink> links;
    for (const auto& [place, cell] : number)
        for (int axis = 0; axis < 3; ++axis) {
            HexPlace next = place;
            ++next[axis];
            if (const auto found = number.find(next); found != number.end())
                links.push_back({cell, found->second, axis});
        }
    const HexLevel level = make_hex_level(std::move(places), std::move(links));
    TetMesh mesh;
    mesh.hexahedra = level.cells;
    mesh.tets = tets_of_hexahedra(mesh.hexahedra);
    mesh.shares.assign(level.cells.size(), 1);
    mesh.nodes.resize(static_cast<std::size_t>(level.nodes));
    for (std::size_t e = 0; e < level.cells.size(); ++e)
        for (int c = 0; c < 8; ++c)
            mesh.nodes[level.cells[e][c]] = edge.cwiseProduct(
                Vector3(level.places[e][0] + (c & 1), level.places[e][1] + (c >> 1 & 1),
                        level.places[e][2] + (c >> 2 & 1)));
    return mesh;
}

}  // namespace livetet::test
