#include "mesh/hierarchy.hpp"

namespace livetet {

MeshHierarchy make_hierarchy(std::vector<TetMesh> levels, std::string provenance) {
    MeshHierarchy hierarchy{std::move(levels), {}, std::move(provenance)};
    for (std::size_t l = 0; l + 1 < hierarchy.levels.size(); ++l)
        hierarchy.transfers.push_back(
            map_into(hierarchy.levels[l + 1], hierarchy.levels[l].nodes, Outside::extrapolated));
    return hierarchy;
}

}  // namespace livetet
