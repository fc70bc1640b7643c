#include "apps/scene/deform_options.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "config/key_places.hpp"

namespace livetet {

void check_deform(const DeformOptions& deform, const KeyPlaces& places) {
    for (std::size_t i = 0; i < deform.forces.size(); ++i)
        check_selection(deform.forces[i], fmt::format("deform.forces[{}]", i), places);
    check_targets(deform.targets, "deform.targets", places);
}

}  // namespace livetet
