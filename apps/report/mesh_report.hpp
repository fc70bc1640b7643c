#pragma once

#include <nlohmann/json.hpp>

#include "mesh/hierarchy.hpp"
#ifdef LIVETET_IMAGES
#include "apps/scene/mesh_input.hpp"
#endif

namespace livetet {

/// What `livetet mesh` prints of a mesh, and the same as JSON (volumes in ml, lengths in mm).
struct MeshReport {
    std::string text;
    nlohmann::json json;
};

/// Of a mesh that was read: the quality of its levels.
MeshReport report_of(const MeshHierarchy& hierarchy);

#ifdef LIVETET_IMAGES
/// Of one that was meshed: also what of the image was picked, how far levels and surface are apart,
/// how regions keep their volumes, and the notes.
MeshReport report_of(const MeshedInput& meshed);
#endif

}  // namespace livetet
