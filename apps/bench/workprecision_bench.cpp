#include "apps/bench/workprecision_bench.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/scene/body_factory.hpp"
#include "base/distribution.hpp"
#include "base/error.hpp"
#include "base/progress.hpp"

namespace livetet {

namespace {

/// Slower choices run once: their exact time does not matter.
constexpr double longest_repeated_s = 5;

/// Times of a choice in each round.
struct Times {
    std::vector<double> total, setup, step;

    void add(const SolveRun& run) {
        const double before = run.partition_s + run.setup_s;
        total.push_back(run.solution_s());
        setup.push_back(before);
        step.push_back((run.solution_s() - before) / std::max(1, run.steps));
    }
};

}  // namespace

const ChoiceResult* WorkPrecision::cheapest(ErrorMeasure measure, double error_m,
                                            std::optional<double> step_s) const {
    const ChoiceResult* best = nullptr;
    for (const ChoiceResult& r : results)
        if (r.has_figures() && r.error_m(measure) <= error_m && (!step_s || r.step_s <= *step_s) &&
            (!best || r.total_s < best->total_s))
            best = &r;
    return best;
}

const ChoiceResult* WorkPrecision::most_accurate(ErrorMeasure measure, double step_s) const {
    const ChoiceResult* best = nullptr;
    for (const ChoiceResult& r : results)
        if (r.has_figures() && r.step_s <= step_s &&
            (!best || r.error_m(measure) < best->error_m(measure)))
            best = &r;
    return best;
}

WorkPrecision measure_choices(const Scene& scene, const std::filesystem::path& folder, int repeats,
                              const std::string& only) {
    ProgressLine progress("workprecision");
    const Choices choices(scene, load_mesh(scene.mesh, progress.callback()), folder);
    std::vector<SceneChoice> all = choices.all();
    std::erase_if(all, [&](const SceneChoice& c) {
        return (c.varied + ": " + c.name).find(only) == std::string::npos;
    });
    if (all.empty()) fail("--only {}: no choice has that in its name", only);
    const SamplePoints points(
        choices.hierarchy().levels.front(),
        scene.probes ? read_points_csv(scene.probes->points) : std::vector<NamedPoint>{});
    SceneRuns runs(folder, points);

    // 1. reference
    progress.update(0, "the reference: ten-node tets on the finest mesh");
    const SampledRun& reference = runs.run(choices.reference());
    if (!reference.is_good()) fail("the reference failed: {}", reference.failure);
    SampledRun rest = reference;
    for (auto& frame : rest.displacement) std::fill(frame.begin(), frame.end(), Vector3::Zero());
    const Difference whole = difference(points, reference, rest);
    WorkPrecision out{points.probes, whole.largest_m, whole.l2_m, reference.took->solution_s(), {}};

    // 2. error of each choice, and its parts
    std::vector<Times> times(all.size());
    const double count = static_cast<double>(all.size()) * (repeats + 3.0);
    double done = 0;
    for (std::size_t k = 0; k < all.size(); ++k) {
        ChoiceResult r{.choice = all[k]};
        progress.update(done / count, all[k].name);
        done += 4;
        const SampledRun& own = runs.run(all[k].scene);
        if (own.is_good()) {
            times[k].add(*own.took);
            r.peak_bytes = own.took->peak_bytes;
            r.error = difference(points, own, reference);
            const SampledRun* before = &own;
            double* parts[] = {&r.algebraic_m, &r.time_m, &r.model_m};
            const Scene scenes[] = {choices.tight(all[k]), choices.fine_in_time(all[k]),
                                    choices.same_model(all[k])};
            for (int i = 0; i < 3; ++i) {
                const SampledRun& next = runs.run(scenes[i]);
                if (!next.is_good()) {
                    r.failure = fmt::format("no error to be said: {}", next.failure);
                    break;
                }
                *parts[i] = difference(points, *before, next).l2_m;
                before = &next;
            }
            r.mesh_m = difference(points, *before, reference).l2_m;
        } else {
            r.failure = own.failure;
        }
        out.results.push_back(std::move(r));
    }

    // 3. times, round by round
    for (int round = 1; round < repeats; ++round)
        for (std::size_t k = 0; k < all.size(); ++k, ++done) {
            if (!out.results[k].has_figures() || times[k].total.front() > longest_repeated_s)
                continue;
            progress.update(done / count, fmt::format("{}, once more", all[k].name));
            times[k].add(runs.again(all[k].scene));
        }
    for (std::size_t k = 0; k < all.size(); ++k) {
        if (!out.results[k].has_figures()) continue;
        ChoiceResult& r = out.results[k];
        const auto [min, max] = std::minmax_element(times[k].total.begin(), times[k].total.end());
        r.runs = times[k].total.size();
        r.spread_s = (*max - *min) / 2;
        r.total_s = distribution(times[k].total).median;
        r.setup_s = distribution(times[k].setup).median;
        r.step_s = distribution(times[k].step).median;
    }
    return out;
}

}  // namespace livetet
