#include "apps/simulation/mesh_rows.hpp"

#include <algorithm>

#include "io/vector_table.hpp"
#include "solvers/nonlinear/body_state.hpp"

namespace livetet {

namespace {

/// Tets of this rank: those whose first corner it owns.
bool is_own(const PartitionedMesh& share, std::size_t e) { return share.tets[e][0] < share.owned; }

/// The block of tets with their nodes in numbers of the whole mesh, and their regions.
void add_tets(const PartitionedMesh& share, std::size_t tets, TetMesh& rows) {
    const bool is_quadratic = share.is_quadratic();
    const bool has_regions = on_any_rank(share, !share.regions.empty());
    const int corners = is_quadratic ? 10 : 4, numbers = corners + (has_regions ? 1 : 0);
    std::vector<std::int32_t> mine;
    std::vector<double> packed;  // whole numbers
    for (std::size_t e = 0; e < share.tets.size(); ++e) {
        if (!is_own(share, e)) continue;
        mine.push_back(share.tet_ids[e]);
        for (int i = 0; i < corners; ++i) packed.push_back(share.nodes[share.node(e, i)]);
        if (has_regions) packed.push_back(share.regions[e]);
    }
    packed = RowBlocks(share.comm, tets, mine).to_block(packed, numbers);
    const auto number = [&](const double* at) { return static_cast<std::int32_t>(*at); };
    for (const double* at = packed.data(); at < packed.data() + packed.size(); at += numbers) {
        Tet& t = rows.tets.emplace_back();
        for (int i = 0; i < 4; ++i) t[i] = number(at + i);
        if (is_quadratic) {
            auto& middles = rows.edge_nodes.emplace_back();
            for (int k = 0; k < 6; ++k) middles[k] = number(at + 4 + k);
        }
        if (has_regions) rows.regions.push_back(number(at + corners));
    }
}

}  // namespace

TetMesh rows_of_file(const TetMesh& mesh, const PartitionedMesh& share, std::size_t tets) {
    TetMesh rows;
    const RowBlocks nodes = node_blocks(share);
    const auto own = [&](const auto& values, int components) {
        return values.first(static_cast<std::size_t>(share.owned * components));
    };
    rows.nodes = vectors_of(nodes.to_block(own(flat(share.rest), 3), 3));
    add_tets(share, tets, rows);
    for (const auto& [name, set] : mesh.node_sets) {
        std::vector<double> is_in(share.nodes.size(), 0);
        for (const std::int32_t n : set) is_in[n] = 1;
        const std::vector<double> of_block = nodes.to_block(own(std::span(is_in), 1), 1);
        std::vector<std::int32_t>& here = rows.node_sets[name];
        for (std::size_t i = 0; i < of_block.size(); ++i)
            if (of_block[i] != 0)
                here.push_back(static_cast<std::int32_t>(nodes.block().first + i));
    }
    for (const auto& [name, set] : mesh.triangle_sets) {
        std::vector<Triangle>& here = rows.triangle_sets[name];
        for (const Triangle& t : set) {
            if (t[0] >= share.owned) continue;  // its first corner's rank gives it
            here.push_back({share.nodes[t[0]], share.nodes[t[1]], share.nodes[t[2]]});
        }
    }
    return rows;
}

}  // namespace livetet
