#include "mesh/hierarchy_rows.hpp"

namespace livetet {

TetMesh rows_of(const TetMesh& whole, std::size_t rank, std::size_t ranks) {
    const auto rows = [&](const auto& table) {
        return rows_of_table(std::span(table), rank, ranks);
    };
    TetMesh mesh;
    mesh.nodes = rows(whole.nodes);
    mesh.tets = rows(whole.tets);
    mesh.edge_nodes = rows(whole.edge_nodes);
    mesh.regions = rows(whole.regions);
    for (const auto& [name, nodes] : whole.node_sets) mesh.node_sets[name] = rows(nodes);
    for (const auto& [name, triangles] : whole.triangle_sets)
        mesh.triangle_sets[name] = rows(triangles);
    return mesh;
}

HierarchyRows rows_of(const MeshHierarchy& whole, std::size_t rank, std::size_t ranks) {
    const auto rows = [&](const auto& table) {
        return rows_of_table(std::span(table), rank, ranks);
    };
    HierarchyRows mine;
    mine.rows.provenance = whole.provenance;
    for (const TetMesh& level : whole.levels) {
        mine.rows.levels.push_back(rows_of(level, rank, ranks));
        mine.sizes.push_back({level.nodes.size(), level.tets.size()});
    }
    for (const BarycentricMap& map : whole.transfers)
        mine.rows.transfers.push_back({rows(map.nodes), rows(map.weights), rows(map.distance)});
    for (const std::vector<std::int32_t>& parents : whole.parents)
        mine.rows.parents.push_back(rows(parents));
    return mine;
}

}  // namespace livetet
