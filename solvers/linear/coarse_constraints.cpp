#include "solvers/linear/coarse_constraints.hpp"

#include <algorithm>

namespace livetet {

CoarseConstraints::CoarseConstraints(const MeshHierarchy& hierarchy) {
    for (std::size_t l = 1; l < hierarchy.levels.size(); ++l) {
        maps_.push_back(&hierarchy.transfers[l - 1]);
        bodies_.emplace_back(hierarchy.levels[l], hierarchy.levels[l - 1],
                             hierarchy.transfers[l - 1]);
    }
}

void CoarseConstraints::set_constrained(std::span<const std::unique_ptr<LevelAssembler>> levels,
                                        std::span<const std::uint8_t> components) {
    components_.assign(1, {components.begin(), components.end()});
    levels.front()->set_constrained(components);
    for (std::size_t l = 1; l < levels.size(); ++l) {
        components_.push_back(coarse_components(*maps_[l - 1], components_[l - 1], bodies_[l - 1]));
        levels[l]->set_constrained(components_[l]);
    }
}

void CoarseConstraints::set_springs(std::span<const std::unique_ptr<LevelAssembler>> levels,
                                    std::span<const double> stiffness) const {
    std::vector<double> level(stiffness.begin(), stiffness.end());
    levels.front()->set_springs(level);
    for (std::size_t l = 1; l < levels.size(); ++l) {
        std::vector<double> lower(level.empty() ? 0 : levels[l]->share().number_of_node.size(),
                                  0.0);
        const BarycentricMap& map = *maps_[l - 1];
        for (std::size_t i = 0; i < level.size(); ++i)
            for (int k = 0; k < 4; ++k)  // an extrapolated place has negative weights
                lower[map.nodes[i][k]] += std::max(map.weights[i][k], 0.0) * level[i];
        levels[l]->set_springs(lower);
        level = std::move(lower);
    }
}

}  // namespace livetet
