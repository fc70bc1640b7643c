#include "mesh/hex_hierarchy.hpp"

#include <algorithm>
#include <map>
#include <numeric>

#include "base/sliced_task.hpp"
#include "mesh/hex_cut.hpp"
#include "mesh/hex_transfer.hpp"

namespace livetet {

namespace {

/// A node at a place of a coarse cell, in the tet of Kuhn's that it lies in: with the coordinates
/// x_a >= x_b >= x_c along the axes a, b, c, the tet has the corners 0, a, a + b, a + b + c, and
/// the node the weights 1 - x_a, x_a - x_b, x_b - x_c, x_c.
void add_node(BarycentricMap& map, const Hexahedron& cell, int place) {
    const int at[3] = {place % 3, place / 3 % 3, place / 9};
    std::array<int, 3> axes{0, 1, 2};
    std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return at[a] > at[b]; });
    int corner = 0;
    double before = 1;
    std::array<std::int32_t, 4> nodes{};
    std::array<double, 4> weights{};
    for (int k = 0; k < 4; ++k) {
        const double next = k < 3 ? at[axes[k]] / 2.0 : 0;
        nodes[k] = cell[corner];
        weights[k] = before - next;
        before = next;
        if (k < 3) corner |= 1 << axes[k];
    }
    map.nodes.push_back(nodes);
    map.weights.push_back(weights);
    map.distance.push_back(0);
}

BarycentricMap transfer_between(const HexLevel& fine, const HexLevel& coarse) {
    BarycentricMap map;
    for (const std::int32_t from : places_in_coarser(fine))
        add_node(map, coarse.cells[from / places_in_parent], from % places_in_parent);
    return map;
}

std::vector<Vector3> node_places(const HexLevel& level, const GridFrame& frame) {
    std::vector<Vector3> nodes(level.nodes);
    for (std::size_t e = 0; e < level.cells.size(); ++e)
        for (int c = 0; c < 8; ++c)
            nodes[level.cells[e][c]] =
                frame.corner + frame.axes * Vector3(level.places[e][0] + (c & 1),
                                                    level.places[e][1] + (c >> 1 & 1),
                                                    level.places[e][2] + (c >> 2));
    return nodes;
}

/// Of each coarse cell: the region with the largest sum of its cells' shares.
std::vector<std::int32_t> regions_of(const TetMesh& fine, const HexLevel& level,
                                     std::size_t coarse_cells) {
    std::vector<std::map<std::int32_t, double>> shares(coarse_cells);
    for (std::size_t e = 0; e < level.parents.size(); ++e)
        shares[level.parents[e]][fine.regions[tets_per_hexahedron * e]] += fine.shares[e];
    std::vector<std::int32_t> regions;
    for (const auto& of_cell : shares)
        regions.insert(regions.end(), tets_per_hexahedron,
                       std::ranges::max_element(of_cell, {}, [](const auto& share) {
                           return share.second;
                       })->first);
    return regions;
}

}  // namespace

GridHierarchy grid_hierarchy(const TetMesh& grid, std::size_t enough) {
    GridHierarchy made{hex_levels(grid, enough), {}};
    pause_point();
    made.meshes.levels.push_back(grid);
    GridFrame frame = grid_frame(grid, made.levels.front());
    for (std::size_t l = 1; l < made.levels.size(); ++l) {
        const HexLevel &fine = made.levels[l - 1], &coarse = made.levels[l];
        const TetMesh& finer = made.meshes.levels.back();
        frame.axes *= 2;
        TetMesh mesh;
        mesh.nodes = node_places(coarse, frame);
        mesh.hexahedra = coarse.cells;
        mesh.tets = tets_of_hexahedra(coarse.cells);
        mesh.shares.assign(coarse.cells.size(), 0.0);
        for (std::size_t e = 0; e < fine.parents.size(); ++e)
            mesh.shares[fine.parents[e]] += finer.shares[e] / 8;
        if (!finer.regions.empty()) mesh.regions = regions_of(finer, fine, coarse.cells.size());
        pause_point();
        made.meshes.transfers.push_back(transfer_between(fine, coarse));
        made.meshes.levels.push_back(std::move(mesh));
    }
    return made;
}

}  // namespace livetet
