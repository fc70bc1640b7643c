#include "mesh/hierarchy.hpp"

#include "base/error.hpp"

namespace livetet {

namespace {

void check_levels(const std::vector<TetMesh>& levels) {
    if (levels.empty()) fail("mesh hierarchy: found no levels, expected at least one mesh");
    for (std::size_t l = 0; l < levels.size(); ++l) {
        check_tet_mesh(levels[l], fmt::format("mesh hierarchy, level {}", l));
        if (l > 0) check_finer(levels[l - 1].tets.size(), levels[l].tets.size(), l);
    }
}

}  // namespace

void check_finer(std::size_t tets, std::size_t coarser_tets, std::size_t coarser) {
    if (coarser_tets <= tets) return;
    fail(
        "mesh hierarchy: found {} tets in level {} and {} in level {}, expected the finest level "
        "first",
        tets, coarser - 1, coarser_tets, coarser);
}

void check_hierarchy(const MeshHierarchy& hierarchy) {
    const auto& [levels, transfers, provenance, parents] = hierarchy;
    check_levels(levels);
    if (transfers.size() + 1 != levels.size())
        fail("mesh hierarchy: found {} transfers for {} levels, expected {} (see make_hierarchy)",
             transfers.size(), levels.size(), levels.size() - 1);
    for (std::size_t l = 0; l < transfers.size(); ++l)
        if (transfers[l].size() != levels[l].nodes.size())
            fail("mesh hierarchy: transfer {} has {} points, expected the {} nodes of level {}", l,
                 transfers[l].size(), levels[l].nodes.size(), l);
}

MeshHierarchy make_hierarchy(std::vector<TetMesh> levels, std::string provenance) {
    check_levels(levels);
    MeshHierarchy hierarchy{std::move(levels), {}, std::move(provenance)};
    for (std::size_t l = 0; l + 1 < hierarchy.levels.size(); ++l)
        hierarchy.transfers.push_back(
            map_into(hierarchy.levels[l + 1], hierarchy.levels[l].nodes, Outside::extrapolated));
    return hierarchy;
}

}  // namespace livetet
