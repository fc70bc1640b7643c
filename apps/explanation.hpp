#pragma once

#include <string>
#include <vector>

#include "apps/scene.hpp"

namespace livetet {

/// A part of the program that a scene has built or left out, and why.
struct ExplainedPart {
    bool built;
    std::string part, why;
};

/// What a scene builds, and what it leaves out and why. `tets`, `levels`: of its mesh; `multigrid`: whether its solver
/// resolves to one on these levels.
std::vector<ExplainedPart> explain_parts(const Scene& scene, std::size_t tets, std::size_t levels, bool multigrid);

}  // namespace livetet
