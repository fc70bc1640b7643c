#pragma once

#include <nlohmann/json_fwd.hpp>

#include "apps/simulation/scene_run.hpp"
#include "apps/simulation/solve_profile.hpp"

namespace livetet {

/// Figures of a run that are not in its history.
struct RunFigures {
    int ranks = 1;
    double mesh_s = 0, setup_s = 0;
    StepReport sum;  ///< counts and times of all steps
    double largest_displacement_m = 0;
    std::size_t inverted_tets = 0;
    std::vector<std::string> beyond_model;                ///< sentences on a result that cannot be
    std::vector<std::pair<std::string, Vector3>> forces;  ///< N on the body, by constraint
    std::vector<ProfileRow> profile;                      ///< of --profile
};

/// Counts and times of all steps of a run.
StepReport sum_of(const RunHistory& history);

/// The run's description, for the result and --json; `start_s`: where a restarted run went on.
/// Collective.
nlohmann::json describe_run(const Scene& scene, const SceneBody& body, const RunHistory& history,
                            const RunFigures& figures, double start_s);

}  // namespace livetet
