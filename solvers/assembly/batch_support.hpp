#pragma once

#include <span>
#include <string>

#include "mechanics/materials/constitutive_model.hpp"

namespace livetet {

/// Why the kernels over batches of tets (mechanics/batch_kernels.hpp) cannot compute a body of
/// these models: "found ..., expected ...". Empty where they can. This is the one place that says
/// which elements, formulations and models they take.
std::string why_not_batched(bool has_edge_nodes, bool is_mixed,
                            std::span<const ConstitutiveModel* const> models);

}  // namespace livetet
