#pragma once

#include <functional>
#include <string>
#include <vector>

#include "apps/simulation/run_description.hpp"
#include "apps/simulation/state_keeper.hpp"

namespace livetet {

/// How a scene is solved. Empty functions are not called.
struct SolveRequest {
    RunStart start = RunStart::anew;
    bool profile = false;  ///< measure memory and time of each part
    bool whole = false;    ///< mesh and displacement of the solved scene are whole on every rank
    ProgressCallback progress{};
    /// Called after each iteration of each linear solve.
    std::function<void()> iterated{};
};

/// What a solve came to.
struct [[nodiscard]] SolvedScene {
    SceneBody body;
    RunHistory history;
    RunFigures figures;
    std::vector<Vector3> displacement;  ///< of the last state kept, at the nodes of the body's mesh
    std::size_t frames = 0;             ///< states that were kept; 0: none was reached
    std::string description;            ///< of the run, JSON: describe_run and `output_s`
};

/// Solves a scene: loads its mesh, makes the body, runs it and writes what the scene asks for:
/// result, checkpoints, displacements of the probes. Throws Error as its parts do; no file is
/// replaced then. Needs a PetscSession. Collective, on PETSC_COMM_WORLD.
SolvedScene solve_scene(const Scene& scene, const SolveRequest& request);

}  // namespace livetet
