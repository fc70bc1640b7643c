#include "solvers/assembly/batch_support.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "mechanics/materials/registry.hpp"

namespace livetet {

std::string why_not_batched(bool has_edge_nodes, bool is_mixed,
                            std::span<const ConstitutiveModel* const> models) {
    if (has_edge_nodes) return "found ten-node tets, expected four-node ones (elements: P1)";
    if (is_mixed)
        return "found the mixed form, expected the displacement form (formulation: displacement)";
    for (const ConstitutiveModel* model : models) {
        if (!model->is_hooke_by_rotation()) {
            std::vector<std::string_view> names;
            for (const ConstitutiveModel* other : registered_materials())
                if (other->is_hooke_by_rotation()) names.push_back(other->name());
            return fmt::format("found model {}, expected {}", model->name(),
                               fmt::join(names, " or "));
        }
        if (model->name() != models.front()->name())
            return fmt::format("found models {} and {}, expected one for all regions",
                               models.front()->name(), model->name());
    }
    return {};
}

}  // namespace livetet
