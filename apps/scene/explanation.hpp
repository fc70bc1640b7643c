#pragma once

#include <string>
#include <vector>

#include "apps/scene/body_factory.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// A part of the program that a scene builds or leaves out, and why.
struct ExplainedPart {
    bool built;
    std::string part, why;
};

/// The parts that a scene builds and leaves out, with reasons. `tets`, `levels`: of its mesh;
/// `kind`: of its solver, resolved.
std::vector<ExplainedPart> explain_parts(const Scene& scene, std::size_t tets, std::size_t levels,
                                         SolverKind kind);

/// The parts of a finished run, from the text of its scene and the name of its solver. Use::solve:
/// the scene's tracking options were not used. Empty if the scene has keys that this
/// version does not know.
std::vector<ExplainedPart> explain_run(const std::string& scene_text, const std::string& source,
                                       std::size_t tets, std::size_t levels,
                                       const std::string& solver, Use use);

/// Whether `track` solves a scene by the live solver, and if not, why. `hierarchy`: as the body
/// takes it, with its quadratic level.
ExplainedPart explain_live(const Scene& scene, const MeshHierarchy& hierarchy);

}  // namespace livetet
