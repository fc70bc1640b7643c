#pragma once

#include <vector>

#include "apps/bench/accuracy_result.hpp"
#include "apps/bench/accuracy_truth.hpp"

namespace livetet {

/// Standard deviations that the population's scene states: of Poisson's ratio, and of the presser's
/// radius as a share of it (the default of `patch_spread_mm`).
constexpr double stated_poisson_spread = 0.02, stated_radius_share = 0.15;

/// A body as the scene's spreads allow it.
struct DrawnBody {
    TrueBody body;
    double mesh_share;  ///< tets of its meshes, as a share of those asked for: 0.8 to 1.25
};

/// More would reach a Poisson's ratio at which the truth's elements lock: 0.4965 of 50.
constexpr int most_drawn_bodies = 50;

/// `count` bodies, at most most_drawn_bodies, whose values are normal with the stated spreads about
/// what the model takes for true. Each value has one body in each of `count` equally likely parts
/// of its range, at the part's median; which parts meet in a body is shuffled, always alike (Latin
/// hypercube sampling: McKay, Beckman, Conover, A comparison of three methods for selecting values
/// of input variables, 1979).
std::vector<DrawnBody> draw_bodies(int count);

/// Runs of the population: of how many bodies, how often each, with up to how many sensors; tets as
/// `livetet bench accuracy` takes them.
struct PopulationSize {
    int bodies, seeds, sensors, tets, truth_tets;
};

/// How the statement does on drawn bodies: a 95 % radius must hold 95 % of the errors of all of
/// them together, for its spreads say how such bodies differ, not how one of them errs. A table for
/// each tracker. Every run has a seed of its own. A cell is the mean of its runs, of about as many
/// errors each: the targets that move enough differ a little from body to body.
std::vector<AccuracyTable> press_population(const PopulationSize& size,
                                            std::span<const TrackerKind> trackers,
                                            const std::vector<double>& depths,
                                            const ProgressCallback& progress);

}  // namespace livetet
