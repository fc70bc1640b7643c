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

/// Where displacements are compared: the nodes of a mesh, each for its share of the volume, and a
/// scene's probes.
struct SamplePoints {
    std::vector<Vector3> places;  ///< m; the nodes first, then the probes
    std::vector<double> volume;   ///< m^3, of each node
    std::vector<std::string> probes;

    SamplePoints(const TetMesh& mesh, const std::vector<NamedPoint>& named);
    std::size_t nodes() const { return volume.size(); }
};

/// What a scene came to in a process of its own.
struct SampledRun {
    std::optional<SolveRun> took;  ///< nothing where it failed
    std::string failure;           ///< one line where it failed or did not converge
    std::vector<double> times_s;
    std::vector<std::vector<Vector3>> displacement;  ///< m, at each time at each of the points

    bool is_good() const { return took && took->converged && !displacement.empty(); }
};

/// How far two runs are from each other over the times that both have.
struct Difference {
    double l2_m = 0;  ///< root of the mean square over the volume, and over the times
    double largest_m = 0;
    std::vector<double> probes_m;  ///< largest of each probe
};

Difference difference(const SamplePoints& points, const SampledRun& a, const SampledRun& b);

/// Runs scenes one by one, each once however often it is asked for.
class SceneRuns {
  public:
    SceneRuns(std::filesystem::path folder, const SamplePoints& points)
        : folder_(std::move(folder)), points_(points) {}

    const SampledRun& run(const Scene& scene);
    /// The same scene once more, for its times alone.
    SolveRun again(const Scene& scene);

  private:
    SolveRun solve(const Scene& scene, std::size_t number);

    std::filesystem::path folder_;
    const SamplePoints& points_;
    std::map<std::string, std::size_t> numbers_;  ///< by the scene's text
    std::map<std::size_t, SampledRun> runs_;
};

}  // namespace livetet
