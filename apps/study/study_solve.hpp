#pragma once

#include "base/petsc.hpp"

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "apps/simulation/scene_run.hpp"
#include "io/hdf5.hpp"
#include "io/points_csv.hpp"
#include "mesh/barycentric_map.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

/// Output by which the stresses of a solve can be judged (see DeformableBody::inverted_tets).
inline constexpr const char* inverted_tets_output = "inverted_tets";
/// Output: the number of ways in which a result leaves what its model stands for (beyond_model).
inline constexpr const char* beyond_model_output = "beyond_model";

/// Result of one solve of a study.
struct StudyRow {
    bool converged = false;
    std::string failure;                                  ///< one sentence if it failed
    std::vector<std::pair<std::string, double>> outputs;  ///< by name; empty if the solve failed
    double mesh_s = 0, setup_s = 0, solve_s = 0;
    int iterations = 0, newton_iterations = 0;
    std::vector<StepRecord> steps;
    std::vector<Vector3> displacement;  ///< of each node at the end, m; on the first rank alone
};

/// Columns of a stored history; its times are in a table of their own, as they differ between two
/// runs of the same.
inline const std::vector<std::string> history_columns{"time_s",         "step_s",     "converged",
                                                      "linearisations", "iterations", "imbalance"};
std::vector<double> history_values(std::span<const StepRecord> steps);
std::vector<double> step_seconds(std::span<const StepRecord> steps);
/// The steps of a stored history. Throws Error if the tables do not fit each other.
std::vector<StepRecord> read_steps(const hdf5::File& file, const std::string& history,
                                   const std::string& seconds);

/// Solves scenes one after the other on a group of ranks. Keeps the mesh while scenes name the same
/// one.
class StudySolver {
  public:
    explicit StudySolver(MPI_Comm group) : group_(group) {}

    /// Collective in the group. Errors of the scene become the row's failure; others are thrown:
    /// out of memory, failures of PETSc on some of several ranks.
    StudyRow solve(const Scene& scene, const ProgressCallback& progress);

  private:
    void take_mesh(const Scene& scene);
    void run(const Scene& scene, StudyRow& row, const ProgressCallback& progress);

    MPI_Comm group_;
    std::string mesh_key_;  ///< mesh_identity of its scene
    SceneMesh mesh_;
};

}  // namespace livetet
