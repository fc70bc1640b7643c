#pragma once

#include <vector>

#include "apps/scene/body_factory.hpp"
#include "apps/simulation/checkpoint.hpp"

namespace livetet {

/// The fields that the scene requests (output.fields), of the body's present state: this rank's
/// share of their rows. Collective.
std::vector<ResultFrame::Field> result_fields(const Scene& scene, DeformableBody& body);

}  // namespace livetet
