#include "mechanics/gravity_load.hpp"

#include "mechanics/mapped_hexahedron.hpp"
#include "mesh/hex_grid.hpp"

namespace livetet {

std::vector<Vector3> gravity_load(const TetMesh& mesh, std::span<const Material> materials,
                                  const Vector3& gravity) {
    std::vector<Vector3> force(mesh.nodes.size(), Vector3::Zero());
    if (!mesh.hexahedra.empty()) {
        const double volume = cell_volume(mesh);
        for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
            const Material& material = material_of(
                materials, mesh.regions.empty() ? 0 : mesh.regions[tets_per_hexahedron * e]);
            for (int c = 0; c < 8; ++c)
                force[mesh.hexahedra[e][c]] += ElementShape<8>::force_share(c) *
                                               material.density_kg_per_m3 * mesh.shares[e] *
                                               volume * gravity;
        }
        return force;
    }
    if (!mesh.quadratic_hexahedra.empty()) {
        for (std::size_t e = 0; e < mesh.quadratic_hexahedra.size(); ++e) {
            const Material& material = material_of(
                materials,
                mesh.regions.empty() ? 0 : mesh.regions[tets_per_quadratic_hexahedron * e]);
            const auto volumes = force_volumes(mapped_hexahedron(mesh, e));
            for (int i = 0; i < 27; ++i)
                force[mesh.quadratic_hexahedra[e][i]] +=
                    volumes[i] * material.density_kg_per_m3 * gravity;
        }
        return force;
    }
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        const Material& material =
            material_of(materials, mesh.regions.empty() ? 0 : mesh.regions[e]);
        const Vector3 weight =
            material.density_kg_per_m3 * signed_volume(mesh, mesh.tets[e]) * gravity;
        if (mesh.edge_nodes.empty()) {
            for (int i = 0; i < 4; ++i)
                force[mesh.tets[e][i]] += TetShape<4>::force_share(i) * weight;
            continue;
        }
        for (int i = 0; i < 4; ++i) force[mesh.tets[e][i]] += TetShape<10>::force_share(i) * weight;
        for (int k = 0; k < 6; ++k)
            force[mesh.edge_nodes[e][k]] += TetShape<10>::force_share(4 + k) * weight;
    }
    return force;
}

}  // namespace livetet
