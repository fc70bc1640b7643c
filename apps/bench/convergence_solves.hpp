#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "base/work_folder.hpp"

namespace livetet {

/// What `bench convergence` solves.
struct ConvergenceArguments {
    double min_nodes = 1050, max_nodes = 1.1e6;  ///< range of mesh sizes
    double nodes = 1e4;  ///< size of the mesh on which everything else is varied
    std::string only;    ///< part of the name "VARIED, METHOD", such as "nodes, multigrid"
    std::filesystem::path csv, json, figure, folder;
};

/// Above this size the finest mesh is refined from the next: Gmsh takes minutes for a million
/// nodes.
constexpr double max_meshed_nodes = 5e5;

struct SolveMethod {
    std::string name, solver;
    double max_nodes;        ///< left out above this size, where it takes minutes
    bool one_level = false;  ///< of bodies: solved without their coarse levels
};

/// Those that solve beams; multigrid is the first.
const std::vector<SolveMethod>& convergence_methods();

/// Names of methods that solve bodies alone.
constexpr const char *automatic_with_levels = "automatic",
                     *automatic_on_one_level = "automatic, one level";

/// Parameters of a beam, or a body of `convergence_bodies`.
struct ConvergenceSetting {
    std::string against;  ///< what is varied: "nodes", "nu", ..., "body"
    double value = 0;
    std::string body{};  ///< in place of the value where bodies are varied
    double edge_m = 0.0054;
    int refine = 0;  ///< number of uniform refinements of a mesh that is coarser by as much
    double poisson = 0.45;
    double contrast = 1;  ///< of Young's modulus, upper half to lower half
    double stretch = 1;   ///< scaling of the mesh along z
    int levels = 0;       ///< 0: all
    int smoothing = 0;    ///< 0: default of the solver

    /// The value, or the body's name.
    std::string value_text() const;
};

/// What a solve took.
struct ConvergencePoint {
    ConvergenceSetting setting;
    std::string method;
    std::string failure;
    double nodes = 0, iterations = 0, seconds = 0;

    /// Of the residual, in one iteration.
    double factor() const;
};

/// The solves selected by `only`. Throws Error if there are none, or none for `figure`.
std::vector<std::pair<ConvergenceSetting, SolveMethod>> convergence_solves(
    const ConvergenceArguments& arguments);

/// Solves scenes of settings.
class ConvergenceScenes {
  public:
    /// `nodes`: about those of bodies that are not beams.
    ConvergenceScenes(const WorkFolder& folder, double nodes) : folder_(folder), nodes_(nodes) {}

    ConvergencePoint solve(const ConvergenceSetting& s, const SolveMethod& method);

  private:
    /// Lines of a scene: a beam, clamped and pressed.
    std::string beam(const ConvergenceSetting& s);
    /// Lines of a scene: a body with its boundary conditions, of as many levels as the method uses.
    std::string body(const ConvergenceSetting& s, const SolveMethod& m);
    std::string mesh_of(const ConvergenceSetting& s);

    const WorkFolder& folder_;
    double nodes_;
    int count_ = 0;
};

}  // namespace livetet
