#include "mesh/openable_mesh.hpp"

#include "mesh/openable_grid.hpp"
#include "mesh/openable_tets.hpp"

namespace livetet {

std::unique_ptr<OpenableMesh> openable_mesh(const std::vector<TetMesh>& levels) {
    constexpr const char* name = "the tracked body";
    if (levels.front().hexahedra.empty()) return std::make_unique<OpenableTets>(levels, name);
    return std::make_unique<OpenableGrid>(levels.front(), name);
}

}  // namespace livetet
