#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/bench/choices.hpp"
#include "apps/bench/sampled_run.hpp"

namespace livetet {

/// Which error counts: that of the worst node and time, or the root of the mean square over the
/// volume and the times.
enum class ErrorMeasure { largest, l2 };

/// What one choice costs, and what its error is.
struct ChoiceResult {
    SceneChoice choice;
    std::string failure{};  ///< where there are no figures: why
    double total_s = 0,
           spread_s = 0;  ///< set-up and all steps, median; half the way from the least to the most
    double setup_s = 0, step_s = 0;  ///< medians; of each step
    std::size_t runs = 0;            ///< that these are medians of: one has no spread
    double peak_bytes = 0;
    Difference error{};                                           ///< against the reference
    double mesh_m = 0, time_m = 0, algebraic_m = 0, model_m = 0;  ///< its parts, L2

    bool has_figures() const { return failure.empty(); }
    double error_m(ErrorMeasure measure) const {
        return measure == ErrorMeasure::largest ? error.largest_m : error.l2_m;
    }
};

struct WorkPrecision {
    std::vector<std::string> probes;
    double largest_m = 0, mean_m = 0;  ///< of the reference's displacement: largest, L2
    double reference_s = 0;
    std::vector<ChoiceResult> results;

    /// The choice of the least time with no error above `error_m` and no step longer than `step_s`;
    /// nothing where none is.
    const ChoiceResult* cheapest(ErrorMeasure measure, double error_m,
                                 std::optional<double> step_s = {}) const;
    /// The one of the least error with no step longer than `step_s`.
    const ChoiceResult* most_accurate(ErrorMeasure measure, double step_s) const;
};

/// Runs every choice of a scene `repeats` times, each round through all of them (those that take
/// over 5 s once), and what their errors are measured against once. Meshes, scenes and logs go to
/// `folder`. Shows progress. Throws Error where the reference fails.
WorkPrecision measure_choices(const Scene& scene, const std::filesystem::path& folder, int repeats,
                              const std::string& only);

}  // namespace livetet
