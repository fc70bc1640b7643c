#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/bench/choices.hpp"
#include "apps/bench/sampled_run.hpp"
#include "base/run_program.hpp"

namespace livetet {

/// Measure of an error: at the worst node and time, or RMS over volume and times.
enum class ErrorMeasure { largest, l2 };

/// Cost and error of a choice.
struct ChoiceResult {
    SceneChoice choice;
    std::string failure{};  ///< why there are no figures
    double total_s = 0,
           spread_s = 0;             ///< median time of set-up and all steps; half its range
    double setup_s = 0, step_s = 0;  ///< medians; of set-up and of a step
    std::size_t runs = 0;            ///< number of runs; a single one has no spread
    double peak_bytes = 0;
    Difference error{};                                           ///< against the reference
    double mesh_m = 0, time_m = 0, algebraic_m = 0, model_m = 0;  ///< parts of the error, L2

    bool has_figures() const { return failure.empty(); }
    double error_m(ErrorMeasure measure) const {
        return measure == ErrorMeasure::largest ? error.largest_m : error.l2_m;
    }
};

struct WorkPrecision {
    std::vector<std::string> probes;
    double largest_m = 0, mean_m = 0;  ///< of the displacement of the reference: largest, L2
    double reference_s = 0;
    std::vector<ChoiceResult> results;
    std::optional<Interrupted> interrupted{};  ///< by the user: `results` are those until then

    /// The fastest choice with an error of at most `error_m` and steps of at most `step_s`; nullptr
    /// if there is none.
    const ChoiceResult* cheapest(ErrorMeasure measure, double error_m,
                                 std::optional<double> step_s = {}) const;
    /// The most accurate choice with steps of at most `step_s`; nullptr if there is none.
    const ChoiceResult* most_accurate(ErrorMeasure measure, double step_s) const;
};

struct WorkPrecisionOptions {
    int repeats = 3;
    std::string only{};         ///< choices with this in their name
    double time_limit_s = 600;  ///< of each solve of a choice; one that takes longer has failed
    /// Called after each choice and each round with the results until then.
    std::function<void(const WorkPrecision&)> keep{};
};

/// Runs every choice of a scene `repeats` times, in rounds (those slower than 5 s once), and the
/// references of their errors once. Meshes, scenes and logs go to `folder`. Shows progress. Ctrl-C
/// ends it with what is done. Throws Error if the reference fails, Interrupted before its end.
WorkPrecision measure_choices(const Scene& scene, const std::filesystem::path& folder,
                              const WorkPrecisionOptions& options);

}  // namespace livetet
