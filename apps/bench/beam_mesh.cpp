#include "apps/bench/beam_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/verification/meshes.hpp"
#include "meshing/gmsh_volume.hpp"

namespace livetet {

namespace {

TriangleMesh surface_of(const TetMesh& mesh) {
    TriangleMesh surface{{}, boundary_triangles(mesh.tets)};
    const std::vector<std::int32_t> nodes = nodes_of(surface.triangles);
    for (const std::int32_t n : nodes) surface.nodes.push_back(mesh.nodes[n]);
    for (Triangle& t : surface.triangles)
        for (std::int32_t& n : t)
            n = static_cast<std::int32_t>(std::lower_bound(nodes.begin(), nodes.end(), n) -
                                          nodes.begin());
    return surface;
}

}  // namespace

MeshHierarchy mesh_beam(double edge, const ProgressCallback& progress) {
    const Vector3 extent(0.2, 0.1, 0.1);
    GmshOptions patient;
    patient.time_limit_s = 1800;  // for a million nodes on a busy machine
    std::vector<TetMesh> levels;
    for (double h = edge; h < 0.06; h *= 2) {
        if (progress)
            progress(0.2 * static_cast<double>(levels.size()),
                     fmt::format("level {}", levels.size()));
        std::array<int, 3> cells;
        for (int a = 0; a < 3; ++a)
            cells[a] = std::max(1, static_cast<int>(std::lround(extent[a] / h)));
        levels.push_back(fill_surface(surface_of(verification::box(extent, cells)), h, patient));
    }
    return make_hierarchy(std::move(levels), "beam");
}

}  // namespace livetet
