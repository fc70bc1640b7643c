#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "apps/bench/solve_run.hpp"
#include "apps/scene/scene.hpp"
#include "io/points_csv.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Points at which displacements are compared: the nodes of a mesh, weighted by volume, and the
/// probes of a scene.
struct SamplePoints {
    std::vector<Vector3> places;  ///< m; first the nodes, then the probes
    std::vector<double> volume;   ///< of each node, m^3
    std::vector<std::string> probes;

    SamplePoints(const TetMesh& mesh, const std::vector<NamedPoint>& named);
    std::size_t nodes() const { return volume.size(); }
};

/// Result of a scene that ran in a process of its own.
struct SampledRun {
    std::optional<SolveRun> took;  ///< empty if it failed
    std::string failure;           ///< one line if it failed or did not converge
    std::vector<double> times_s;
    std::vector<std::vector<Vector3>> displacement;  ///< m, at each time, at each point

    bool is_good() const { return took && took->converged && !displacement.empty(); }
};

/// Difference of two runs over their common times.
struct Difference {
    double l2_m = 0;  ///< RMS over volume and times
    double largest_m = 0;
    std::vector<double> probes_m;  ///< largest, for each probe
};

Difference difference(const SamplePoints& points, const SampledRun& a, const SampledRun& b);

/// Runs scenes, each only once.
class SceneRuns {
  public:
    SceneRuns(std::filesystem::path folder, const SamplePoints& points)
        : folder_(std::move(folder)), points_(points) {}

    /// A run that takes longer than `time_limit_s` has failed.
    const SampledRun& run(const Scene& scene, std::optional<double> time_limit_s = {});
    /// Runs a scene again, for its times.
    SolveRun again(const Scene& scene);

  private:
    SolveRun solve(const Scene& scene, std::size_t number, std::optional<double> time_limit_s);

    std::filesystem::path folder_;
    const SamplePoints& points_;
    std::map<std::string, std::size_t> numbers_;  ///< by text of the scene
    std::map<std::size_t, SampledRun> runs_;
};

}  // namespace livetet
