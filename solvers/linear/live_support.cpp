#include "solvers/linear/live_support.hpp"

#include <fmt/format.h>

#include "solvers/linear/single_precision_multigrid.hpp"

namespace livetet {

std::string why_not_live(const ElasticModel& model, const MeshHierarchy& hierarchy, int ranks) {
    constexpr std::size_t max_coarsest_nodes = SinglePrecisionMultigrid::max_coarsest_nodes;
    constexpr double max_contrast = SinglePrecisionMultigrid::max_contrast;
    if (ranks > 1) return fmt::format("found {} ranks, expected one", ranks);
    if (const double contrast = contrast_of(model.materials); contrast > max_contrast)
        return fmt::format("found Young's moduli a factor of {:.3g} apart, expected at most {:g}",
                           contrast, max_contrast);
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
