#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/bench/core_watch.hpp"
#include "apps/bench/workprecision_bench.hpp"
#include "apps/scene/scene.hpp"
#include "base/progress.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// A press of the organ by a sensor, as live choices are measured with.
struct LivePress {
    Vector3 place;      ///< of the surface, m
    Vector3 direction;  ///< inwards, of unit length
    double depth;       ///< m
    double radius;      ///< of the patch, m
};

/// The press of a scene's body: where the line from the centre of the fixed nodes through that of
/// all nodes leaves the body, by 15 mm, or by 15 % of that length if this is less. The patch is the
/// first sensor's. Throws Error if nothing of the body is fixed.
LivePress live_press(const Scene& scene, const TetMesh& finest);

/// Tets of a scene on one of its levels, and what their frames come to.
struct LiveCandidate {
    Elements elements;
    std::size_t level, tets, nodes;
    FrameTimes times{};
    double largest_m = 0, l2_m = 0;  ///< against the reference: worst node; RMS over volume, frames

    std::string name() const;
    double error_m(ErrorMeasure measure) const {
        return measure == ErrorMeasure::largest ? largest_m : l2_m;
    }
    /// Whether 99 % of the frames, or of those that had their cores, end in time.
    bool in_time(double seconds) const;
};

struct LiveChoices {
    LivePress press;
    double reference_s = 0;
    std::vector<LiveCandidate> measured{};
    std::vector<std::string> left_out{};  ///< those that cannot run live, and why

    /// The fastest with an error of at most `error_m`, in time; nullptr if there is none.
    const LiveCandidate* cheapest(ErrorMeasure measure, double error_m,
                                  std::optional<double> frame_s) const;
    /// The one of the least error that is in time; nullptr if there is none.
    const LiveCandidate* most_accurate(ErrorMeasure measure, std::optional<double> frame_s) const;
};

/// Part of the press at a time, s: from 0 to 1 and back, once a second.
double press_share(double t);

/// The levels of `hierarchy` from one on.
MeshHierarchy levels_from(const MeshHierarchy& hierarchy, std::size_t level);

/// Measures four-node tets on every level of a `track` scene, and ten-node tets on every level but
/// the finest, where the live solver can take them, with the scene's materials: frames as `track`
/// makes them, at equilibrium, sixty a second, with the time `budget_s` for each. Reference of the
/// errors: the same press of ten-node tets on the finest level, by Newton's method to 1e-6, in the
/// form that `solve` takes. Needs a PetscSession. Throws Error if the reference does not converge,
/// or if the scene has no track section.
LiveChoices measure_live_choices(const Scene& scene, const MeshHierarchy& hierarchy, int frames,
                                 std::optional<double> budget_s, ProgressLine& progress);

}  // namespace livetet
