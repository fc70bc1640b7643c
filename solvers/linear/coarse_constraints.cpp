#include "solvers/linear/coarse_constraints.hpp"

#include <algorithm>

namespace livetet {

void CoarseConstraints::set_constrained(Levels levels, std::span<const std::uint8_t> components) {
    levels.front()->set_constrained(components);
    for (std::size_t l = 1; l < levels.size(); ++l)
        levels[l]->set_constrained(
            between_[l - 1].coarse.constrained(rows(l - 1), levels[l - 1]->constrained()));
}

void CoarseConstraints::set_springs(Levels levels, std::span<const double> stiffness) const {
    const bool is_soft = on_any_rank(levels.front()->share(), !stiffness.empty());
    std::vector<double> level(stiffness.begin(), stiffness.end());
    levels.front()->set_springs(level);
    for (std::size_t l = 1; l < levels.size(); ++l) {
        const TransferRows& rows = between_[l - 1].rows;
        const BarycentricMap& map = rows.map();
        std::vector<double> sums(is_soft ? rows.columns() : 0, 0.0);
        for (std::size_t i = 0; i < map.size() && is_soft; ++i)
            for (int k = 0; k < 4; ++k)  // an extrapolated place has negative weights
                sums[map.nodes[i][k]] += map.mean_weight(i, k) * level[i];
        level = is_soft ? rows.sum_to_owners(std::move(sums), 1) : std::vector<double>{};
        levels[l]->set_springs(level);
    }
}

}  // namespace livetet
