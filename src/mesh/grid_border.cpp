#include "mesh/grid_border.hpp"

namespace livetet {

namespace {

/// Calls visit(cell, node, cells that share an inner node of this kind). A corner is between 8
/// cells; of the nodes of order two, that of an edge between 4, of a face 2, a middle in 1.
template <class Visit>
void for_each_node_of_cell(const TetMesh& mesh, const Visit& visit) {
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e)
        for (const std::int32_t n : mesh.hexahedra[e]) visit(e, n, 8);
    for (std::size_t e = 0; e < mesh.quadratic_hexahedra.size(); ++e)
        for (int i = 0; i < 27; ++i) {
            const auto sides = [](int place) { return place == 1 ? 1 : 2; };
            visit(e, mesh.quadratic_hexahedra[e][i],
                  sides(i % 3) * sides(i / 3 % 3) * sides(i / 9));
        }
}

}  // namespace

std::vector<std::uint8_t> solid_cells(const TetMesh& mesh) {
    constexpr double least = 0.5;
    std::vector<std::uint8_t> is_solid(mesh.shares.size(), 0), has_solid(mesh.nodes.size(), 0);
    for_each_node_of_cell(mesh, [&](std::size_t e, std::int32_t n, int) {
        if (mesh.shares[e] < least) return;
        is_solid[e] = 1;
        has_solid[n] = 1;
    });
    std::vector<std::uint8_t> is_alone(mesh.shares.size(), 1);
    for_each_node_of_cell(
        mesh, [&](std::size_t e, std::int32_t n, int) { is_alone[e] &= has_solid[n] == 0; });
    for (std::size_t e = 0; e < is_solid.size(); ++e) is_solid[e] |= is_alone[e];
    return is_solid;
}

std::vector<Tet> solid_tets(const TetMesh& mesh) {
    if (mesh.shares.empty()) return mesh.tets;
    const std::vector<std::uint8_t> is_solid = solid_cells(mesh);
    std::vector<Tet> tets;
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
        if (is_solid[t / mesh.tets_per_element()]) tets.push_back(mesh.tets[t]);
    return tets;
}

std::vector<Triangle> body_surface(const TetMesh& mesh) {
    return mesh.shares.empty() ? boundary_triangles(mesh.tets)
                               : boundary_triangles(solid_tets(mesh));
}

std::vector<std::int32_t> border_nodes(const TetMesh& mesh) {
    const std::vector<std::uint8_t> is_solid = solid_cells(mesh);
    std::vector<int> expected(mesh.nodes.size(), 0), found(mesh.nodes.size(), 0);
    for_each_node_of_cell(mesh, [&](std::size_t e, std::int32_t n, int cells) {
        expected[n] = cells;
        found[n] += is_solid[e];
    });
    std::vector<std::int32_t> nodes;
    for (std::size_t n = 0; n < found.size(); ++n)
        if (found[n] < expected[n]) nodes.push_back(static_cast<std::int32_t>(n));
    return nodes;
}

std::vector<double> tissue_around(const TetMesh& mesh) {
    std::vector<double> share(mesh.nodes.size(), 0);
    for_each_node_of_cell(mesh, [&](std::size_t e, std::int32_t n, int cells) {
        share[n] += mesh.shares[e] / cells;
    });
    return share;
}

}  // namespace livetet
