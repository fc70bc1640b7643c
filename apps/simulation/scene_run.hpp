#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/scene/body_factory.hpp"

namespace livetet {

/// A step of a run. Dynamic: end and length in s. Static: share of the load at its end, and its
/// increment.
struct StepRecord {
    double time_s = 0;
    double step_s = 0;
    StepReport report;
    bool kept = true;  ///< false: rejected and repeated
};

struct [[nodiscard]] RunHistory {
    std::vector<StepRecord> steps;
    bool converged = true;
    /// Static: share of loads and driven displacements at the last equilibrium.
    double share = 1;
    std::string failure;  ///< one sentence if not converged
};

/// Position of a dynamic run.
struct RunPlace {
    double time_s = 0;
    double step_s = 0;       ///< length of the next step; 0: as the scene says
    std::size_t steps = 0;   ///< accepted so far
    std::size_t frames = 0;  ///< kept so far
    std::string failure;     ///< one sentence if a step did not converge
};

/// Callbacks of a run, and where it starts. Empty functions are not called.
struct RunHooks {
    std::function<void(std::size_t frame, double time)>
        keep{};  ///< called with each state that the scene keeps
    std::function<void(const RunPlace&)>
        checkpoint{};  ///< called every `output.checkpoint_every` steps
    ProgressCallback progress{};
    /// Called after each iteration of each linear solve.
    std::function<void()> iterated{};
    RunPlace start{};  ///< of a dynamic run
};

/// A step of `solve` of `dt` seconds (static: 0). If it does not converge, it is repeated in parts,
/// each half as long as the one that failed, down to a 32nd; after a part that converges the next
/// one is longer or shorter by the iterations that it took. `move(share)` moves constraints and
/// loads to that share of the step. Returns the share reached, where the body is left; `record` is
/// called with each part tried. No part is repeated once `controls.is_time_up`, or after 200 Newton
/// iterations (four times `controls.max_newton` if that is more).
double step_in_parts(
    DeformableBody& body, double dt, const SolveControls& controls,
    const std::function<void(double share)>& move,
    const std::function<void(double share, double part, const StepReport&)>& record);

/// Runs a scene to its end. Static: load steps, divided if they do not converge; if that fails, the
/// body is left at its last equilibrium. Dynamic: fixed steps, divided likewise (if that fails the
/// run continues, not converged), or adaptive ones. Either ends at its last state when the time
/// that solver.time_limit_s allows is up, by the first rank's clock. `forces`: of the scene (see
/// scene_forces), at the body's nodes. Collective.
RunHistory run_scene(const Scene& scene, DeformableBody& body, SceneConstraints& constraints,
                     std::span<const Vector3> forces, const RunHooks& hooks);

}  // namespace livetet
