#pragma once

#include <string>
#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// A part of the program that a scene has built or left out, and why.
struct ExplainedPart {
    bool built;
    std::string part, why;
};

/// What a scene builds, and what it leaves out and why. `tets`, `levels`: of its mesh; `multigrid`:
/// whether its solver resolves to one on these levels.
std::vector<ExplainedPart> explain_parts(const Scene& scene, std::size_t tets, std::size_t levels,
                                         bool multigrid);

/// The same of a run that is over, from what its result holds: the scene's text, and the solver as
/// it names itself. `tracked`: else what the scene says of tracking was not used. Empty where the
/// scene has keys that this version does not know.
std::vector<ExplainedPart> explain_run(const std::string& scene_text, const std::string& source,
                                       std::size_t tets, std::size_t levels,
                                       const std::string& solver, bool tracked);

/// Whether `track` solves a scene by the live solver, and if not, why. `hierarchy`: as the body
/// takes it, with its quadratic level.
ExplainedPart explain_live(const Scene& scene, const MeshHierarchy& hierarchy);

}  // namespace livetet
