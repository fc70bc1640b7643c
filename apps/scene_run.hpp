#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/scene_body.hpp"

namespace livetet {

/// One step of a run: dynamic, its end and its length in s; static, the share of the load it ended at, and its part.
struct StepRecord {
    double time_s = 0;
    double step_s = 0;
    StepReport report;
};

struct [[nodiscard]] RunHistory {
    std::vector<StepRecord> steps;
    bool converged = true;
    /// Static: the share of loads and driven displacements at which the last equilibrium was found.
    double share = 1;
    std::string failure;  ///< one sentence where not converged
};

/// Runs a scene to its end. Static: load steps, each halved (up to five times) where it does not converge; where that
/// does not help, the body is left at its last equilibrium. Dynamic: fixed steps, or adaptive ones. `keep(time)` is
/// called with each state that the scene keeps, `progress` where it is not empty. Collective.
RunHistory run_scene(const Scene& scene, SceneBody& body, SceneConstraints& constraints,
                     const std::function<void(double time)>& keep, const ProgressCallback& progress);

}  // namespace livetet
