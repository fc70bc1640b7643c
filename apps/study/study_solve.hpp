#pragma once

#include "base/petsc.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/simulation/scene_run.hpp"
#include "io/points_csv.hpp"
#include "mesh/barycentric_map.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

/// The output that says how far the stresses of a solve are to be believed (see
/// DeformableBody::inverted_tets).
inline constexpr const char* inverted_tets_output = "inverted_tets";

/// What one solve of a study came to.
struct StudyRow {
    bool converged = false;
    std::string failure;  ///< one sentence where it did not converge or could not be done
    std::vector<std::pair<std::string, double>>
        outputs;  ///< by name; empty where nothing was computed
    double mesh_s = 0, setup_s = 0, solve_s = 0;
    int iterations = 0, linearisations = 0;
    std::vector<StepRecord> steps;
    std::vector<Vector3> displacement;  ///< m, each node, at the end
};

/// The columns of a history as they are stored.
inline const std::vector<std::string> history_columns{
    "time_s", "step_s", "converged", "linearisations", "iterations", "imbalance", "seconds"};
std::vector<double> history_values(const StudyRow& row);

/// Solves one scene after the other on a group of ranks, and keeps the mesh as long as the scenes
/// name the same one.
class StudySolver {
  public:
    explicit StudySolver(MPI_Comm group) : group_(group) {}

    /// Collective in the group. What is wrong with the scene itself becomes the row's failure.
    /// Throws what is not: out of memory, PETSc's own failures among several ranks.
    StudyRow solve(const Scene& scene, const ProgressCallback& progress);

  private:
    void take_mesh(const Scene& scene);
    void run(const Scene& scene, StudyRow& row, const ProgressCallback& progress);

    MPI_Comm group_;
    std::string mesh_key_;  ///< how the scene names it
    MeshHierarchy hierarchy_;
};

}  // namespace livetet
