#include "apps/bench/sampled_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/file.hpp"
#include "base/run_program.hpp"
#include "config/yaml.hpp"
#include "io/result_file.hpp"
#include "mesh/quadratic.hpp"
#include "solvers/linear/transfer.hpp"

namespace livetet {

SamplePoints::SamplePoints(const TetMesh& mesh, const std::vector<NamedPoint>& named)
    : places(mesh.nodes), volume(nodal_volumes(mesh)) {
    for (const NamedPoint& p : named) {
        places.push_back(p.position);
        probes.push_back(p.name);
    }
}

Difference difference(const SamplePoints& points, const SampledRun& a, const SampledRun& b) {
    Difference d;
    d.probes_m.assign(points.probes.size(), 0);
    double squares = 0, volume = 0;
    for (std::size_t i = 0, k = 0; i < a.times_s.size() && k < b.times_s.size();) {
        const double apart = a.times_s[i] - b.times_s[k];
        if (std::abs(apart) > 1e-6 * std::max(a.times_s.back(), b.times_s.back())) {
            apart < 0 ? ++i : ++k;
            continue;
        }
        for (std::size_t p = 0; p < points.places.size(); ++p) {
            const double off = (a.displacement[i][p] - b.displacement[k][p]).norm();
            d.largest_m = std::max(d.largest_m, off);
            if (p >= points.nodes()) {
                double& of_probe = d.probes_m[p - points.nodes()];
                of_probe = std::max(of_probe, off);
                continue;
            }
            squares += points.volume[p] * off * off;
            volume += points.volume[p];
        }
        ++i;
        ++k;
    }
    d.l2_m = volume > 0 ? std::sqrt(squares / volume) : 0;
    return d;
}

SolveRun SceneRuns::solve(const Scene& scene, std::size_t number,
                          std::optional<double> time_limit_s) {
    Scene own = scene;
    own.output.file = folder_ / fmt::format("{}.h5", number);
    if (own.probes) own.probes->displacements = folder_ / fmt::format("{}.csv", number);
    const std::filesystem::path file = folder_ / fmt::format("{}.yaml", number);
    write_text_file(file, to_yaml(own) + "\n");
    return run_solve(fmt::format("{}", number), "", 1, file, time_limit_s);
}

const SampledRun& SceneRuns::run(const Scene& scene, std::optional<double> time_limit_s) {
    const auto [place, fresh] = numbers_.try_emplace(to_yaml(scene), numbers_.size());
    SampledRun& run = runs_[place->second];
    if (!fresh) return run;
    try {
        run.took = solve(scene, place->second, time_limit_s);
        if (!run.took->converged) run.failure = "did not converge";
        const std::filesystem::path file = folder_ / fmt::format("{}.h5", place->second);
        {
            const ResultReader result(file);
            const PointSampler sampler(result.mesh(), points_.places, Outside::extrapolated);
            run.times_s = result.times_s();
            for (std::size_t k = 0; k < result.frame_count(); ++k)
                run.displacement.push_back(sampler.sample(result.displacement(k)));
        }
        std::filesystem::remove(file);
    } catch (const Error& error) {
        run.failure = error.what();
        run.took.reset();
    } catch (const Interrupted&) {  // not a run of this scene
        numbers_.erase(place);
        throw;
    }
    return run;
}

SolveRun SceneRuns::again(const Scene& scene) {
    const std::size_t number = numbers_.at(to_yaml(scene));
    SolveRun took = solve(scene, number, {});
    std::filesystem::remove(folder_ / fmt::format("{}.h5", number));
    return took;
}

}  // namespace livetet
