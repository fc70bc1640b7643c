#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/scene/body_factory.hpp"

namespace livetet {

/// One step of a run: dynamic, its end and its length in s; static, the share of the load it ended
/// at, and its part.
struct StepRecord {
    double time_s = 0;
    double step_s = 0;
    StepReport report;
    bool kept = true;  ///< else it did not come out well enough and was done again otherwise
};

struct [[nodiscard]] RunHistory {
    std::vector<StepRecord> steps;
    bool converged = true;
    /// Static: the share of loads and driven displacements at which the last equilibrium was found.
    double share = 1;
    std::string failure;  ///< one sentence where not converged
};

/// Where a dynamic run stands.
struct RunPlace {
    double time_s = 0;
    double step_s = 0;       ///< the next step's length; 0: the scene's
    std::size_t steps = 0;   ///< accepted so far
    std::size_t frames = 0;  ///< kept so far
    std::string failure;     ///< one sentence where a step so far did not converge
};

/// What a run tells, and where it begins. Empty functions are not called.
struct RunHooks {
    std::function<void(std::size_t frame, double time)>
        keep{};                                         ///< each state that the scene keeps
    std::function<void(const RunPlace&)> checkpoint{};  ///< every `output.checkpoint_every` steps
    ProgressCallback progress{};
    RunPlace start{};  ///< dynamic
};

/// One step of `solve`, of `dt` seconds (static: 0), in parts where it does not converge as a
/// whole: halves, quarters, to a 32nd. `move(share)`: puts constraints and loads where they are
/// after that share of the step. Returns the share that was reached, the body being left there;
/// `record` is told of each part that was tried.
double step_in_parts(
    DeformableBody& body, double dt, const SolveControls& controls,
    const std::function<void(double share)>& move,
    const std::function<void(double share, double part, const StepReport&)>& record);

/// Runs a scene to its end. Static: load steps, in parts where they do not converge; where that
/// does not help, the body is left at its last equilibrium. Dynamic: fixed steps, in parts likewise
/// (where that does not help the run goes on, not converged), or adaptive ones. Collective.
RunHistory run_scene(const Scene& scene, SceneBody& body, SceneConstraints& constraints,
                     const RunHooks& hooks);

}  // namespace livetet
