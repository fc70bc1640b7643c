#include "apps/bench/workprecision_bench.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/scene/body_factory.hpp"
#include "base/distribution.hpp"
#include "base/error.hpp"
#include "base/progress.hpp"
#include "base/stop_signals.hpp"

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

namespace {

/// The steps of `measure_choices`.
class Measurement {
  public:
    Measurement(const Choices& choices, std::vector<SceneChoice> all, const SamplePoints& points,
                const std::filesystem::path& folder, const WorkPrecisionOptions& options,
                ProgressLine& progress)
        : choices_(choices),
          all_(std::move(all)),
          points_(points),
          runs_(folder, points),
          options_(options),
          progress_(progress),
          times_(all_.size()),
          count_(static_cast<double>(all_.size()) * (options.repeats + 3.0)) {}

    WorkPrecision run() {
        run_reference();
        try {
            measure_errors();
            measure_times();
        } catch (const Interrupted& by) {
            out_.interrupted = by;
        }
        summarise();
        return std::move(out_);
    }

  private:
    void run_reference() {
        progress_.update(0, "the reference: ten-node tets on the finest mesh");
        reference_ = &runs_.run(choices_.reference());
        if (!reference_->is_good()) fail("the reference failed: {}", reference_->failure);
        SampledRun rest = *reference_;
        for (auto& frame : rest.displacement)
            std::fill(frame.begin(), frame.end(), Vector3::Zero());
        const Difference whole = difference(points_, *reference_, rest);
        out_ = {points_.probes, whole.largest_m, whole.l2_m, reference_->took->solution_s(), {}};
    }

    /// Error of each choice, and its parts.
    void measure_errors() {
        for (std::size_t k = 0; k < all_.size(); ++k) {
            progress_.update(done_ / count_, all_[k].name);
            done_ += 4;
            out_.results.push_back(result_of(k));
            keep();
            check_stop();
        }
    }

    ChoiceResult result_of(std::size_t k) {
        ChoiceResult r{.choice = all_[k]};
        const SampledRun& own = runs_.run(all_[k].scene, options_.time_limit_s);
        if (!own.is_good()) {
            r.failure = own.failure;
            return r;
        }
        r.peak_bytes = own.took->peak_bytes;
        r.error = difference(points_, own, *reference_);
        const SampledRun* before = &own;
        double* parts[] = {&r.algebraic_m, &r.time_m, &r.model_m};
        const Scene scenes[] = {choices_.tight(all_[k]), choices_.fine_in_time(all_[k]),
                                choices_.same_model(all_[k])};
        for (int i = 0; i < 3; ++i) {
            const SampledRun& next = runs_.run(scenes[i], options_.time_limit_s);
            if (!next.is_good()) {
                r.failure = fmt::format("no error to be said: {}", next.failure);
                return r;
            }
            *parts[i] = difference(points_, *before, next).l2_m;
            before = &next;
        }
        r.mesh_m = difference(points_, *before, *reference_).l2_m;
        times_[k].add(*own.took);
        return r;
    }

    /// Times, round by round.
    void measure_times() {
        for (int round = 1; round < options_.repeats; ++round) {
            for (std::size_t k = 0; k < all_.size(); ++k, ++done_) {
                if (!out_.results[k].has_figures() || times_[k].total.front() > longest_repeated_s)
                    continue;
                progress_.update(done_ / count_, fmt::format("{}, once more", all_[k].name));
                times_[k].add(runs_.again(all_[k].scene));
                check_stop();
            }
            keep();
        }
    }

    void summarise() {
        for (std::size_t k = 0; k < out_.results.size(); ++k) {
            if (!out_.results[k].has_figures()) continue;
            ChoiceResult& r = out_.results[k];
            const auto [min, max] =
                std::minmax_element(times_[k].total.begin(), times_[k].total.end());
            r.runs = times_[k].total.size();
            r.spread_s = (*max - *min) / 2;
            r.total_s = distribution(times_[k].total).median;
            r.setup_s = distribution(times_[k].setup).median;
            r.step_s = distribution(times_[k].step).median;
        }
    }

    /// A signal while a scene runs ends that run with Interrupted, see run_program.
    void check_stop() const {
        if (signals_.token().stop_requested()) throw Interrupted{SIGINT};
    }

    void keep() {
        if (!options_.keep) return;
        summarise();
        options_.keep(out_);
    }

    const StopSignals signals_;
    const Choices& choices_;
    const std::vector<SceneChoice> all_;
    const SamplePoints& points_;
    SceneRuns runs_;
    const WorkPrecisionOptions& options_;
    ProgressLine& progress_;
    const SampledRun* reference_ = nullptr;
    std::vector<Times> times_;
    double count_, done_ = 0;
    WorkPrecision out_;
};

}  // namespace

WorkPrecision measure_choices(const Scene& scene, const std::filesystem::path& folder,
                              const WorkPrecisionOptions& options) {
    ProgressLine progress("workprecision");
    MeshHierarchy hierarchy = load_mesh(scene, progress.callback());
    refuse_hexahedra(hierarchy, "tune, and bench workprecision");
    const Choices choices(scene, std::move(hierarchy), folder);
    std::vector<SceneChoice> all = choices.all();
    std::erase_if(all, [&](const SceneChoice& c) {
        return (c.varied + ": " + c.name).find(options.only) == std::string::npos;
    });
    if (all.empty()) fail("--only {}: no choice has that in its name", options.only);
    const SamplePoints points(
        choices.hierarchy().levels.front(),
        scene.probes ? read_points_csv(scene.probes->points) : std::vector<NamedPoint>{});
    return Measurement(choices, std::move(all), points, folder, options, progress).run();
}

}  // namespace livetet
