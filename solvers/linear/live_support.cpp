#include "solvers/linear/live_support.hpp"

#include <fmt/format.h>

#include "mesh/hex_hierarchy.hpp"
#include "solvers/linear/grid_cycle.hpp"
#include "solvers/linear/single_precision_multigrid.hpp"

namespace livetet {

namespace {

std::string why_no_live_grid(const TetMesh& grid) {
    const std::vector<HexLevel> levels = hex_levels(grid, GridCycle::cells_to_factor);
    if (levels.back().nodes > static_cast<std::int32_t>(GridCycle::max_coarsest_nodes))
        return fmt::format(
            "found {} nodes in the coarsest level of a grid of {} hexahedra, expected at most {}: "
            "its cells hang together too little to be joined to larger ones",
            levels.back().nodes, grid.hexahedra.size(), GridCycle::max_coarsest_nodes);
    return {};
}

}  // namespace

std::string why_not_live(const ElasticModel& model, const MeshHierarchy& hierarchy) {
    constexpr std::size_t max_coarsest_nodes = SinglePrecisionMultigrid::max_coarsest_nodes;
    constexpr double max_contrast = SinglePrecisionMultigrid::max_contrast;
    if (const double contrast = contrast_of(model.materials); contrast > max_contrast)
        return fmt::format("found Young's moduli a factor of {:.3g} apart, expected at most {:g}",
                           contrast, max_contrast);
    if (const TetMesh& mesh = hierarchy.levels.front(); !mesh.hexahedra.empty())
        return why_no_live_grid(mesh);
    const bool is_quadratic = !hierarchy.levels.front().edge_nodes.empty();
    const std::size_t levels = hierarchy.levels.size() - (is_quadratic ? 1 : 0);
    if (const std::size_t nodes = hierarchy.levels.back().nodes.size();
        levels < 2 || nodes > max_coarsest_nodes)
        return fmt::format(
            "found {} level(s) of four-node tets with {} nodes in the coarsest, expected at least "
            "2, the coarsest of at most {} nodes",
            levels, nodes, max_coarsest_nodes);
    return {};
}

}  // namespace livetet
