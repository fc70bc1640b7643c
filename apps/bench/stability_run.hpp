#pragma once

#include <string>

#include "apps/bench/stability_cases.hpp"

namespace livetet {

/// As `solve` steps a scene, each step to its tolerance; or as `track` does, in frames with a
/// deadline, of one or two Newton iterations (`newton_iterations_of_frame`), with tets of four or
/// ten nodes. `plain`: the same frames by a solver in double precision, as the counterpart of the
/// live solver's. `hexahedra`: as `solve` on a grid, by displacements (Q1); `hexahedra_mixed`: in
/// the mixed form (Q1-P0); `track_hexahedra`, `track_hexahedra_mixed`: as `track` on a grid;
/// `plain_...`: their counterparts.
enum class SteppedAs {
    solve,
    track,
    track_p2,
    plain,
    plain_p2,
    hexahedra,
    hexahedra_mixed,
    track_hexahedra,
    track_hexahedra_mixed,
    plain_hexahedra,
    plain_hexahedra_mixed
};

/// Of hexahedra in the mixed form.
inline bool has_cell_pressures(SteppedAs way) {
    return way == SteppedAs::hexahedra_mixed || way == SteppedAs::track_hexahedra_mixed ||
           way == SteppedAs::plain_hexahedra_mixed;
}

inline bool is_of_hexahedra(SteppedAs way) {
    return has_cell_pressures(way) || way == SteppedAs::hexahedra ||
           way == SteppedAs::track_hexahedra || way == SteppedAs::plain_hexahedra;
}
inline bool makes_frames(SteppedAs way) {
    return way != SteppedAs::solve && way != SteppedAs::hexahedra &&
           way != SteppedAs::hexahedra_mixed;
}
inline bool is_plain(SteppedAs way) {
    return way == SteppedAs::plain || way == SteppedAs::plain_p2 ||
           way == SteppedAs::plain_hexahedra || way == SteppedAs::plain_hexahedra_mixed;
}
inline bool has_ten_nodes(SteppedAs way) {
    return way == SteppedAs::track_p2 || way == SteppedAs::plain_p2;
}

struct StabilityColumn {
    SteppedAs way;
    ModelChoice strain;
    TimeScheme scheme;
};

enum class Verdict { pass, fail, refused, left_out };

/// What became of one case in one column.
struct StabilityCell {
    Verdict verdict = Verdict::pass;
    std::string reason;  ///< one line where it did not pass
    std::string solver;  ///< name of its linear solver; empty where there was none
    int steps = 0, newton_iterations = 0;
    double energy_growth =
        0;            ///< the greatest energy after the driving, to the greatest until then
    double left = 0;  ///< of the greatest displacement (of a body that can turn: energy) when it
                      ///< should have come to rest
    double late = 0;  ///< share of the frames that took longer than their budget
    double seconds = 0;
};

/// Length of the noise cases and time budget of a frame.
struct StabilityLimits {
    int noise_frames = 1000000;  ///< of `track`; a thousandth of them as `solve` steps
    double budget_s = 0.01;      ///< of a frame of `track`
};

/// Runs a case on its mesh, of tets or hexahedra as the column is, and judges it. In order, and by
/// the first that does not hold:
/// - left out: the column would take hours (StabilityCase::is_fine), or its mesh cannot be what the
///   case is about: hexahedra are all alike;
/// - refused: the scene is refused as `solve` or `track` would;
/// - finite: no step is given up, no node is farther than 1.5 m from its place at rest;
/// - solved (`solve`): every step meets its tolerance, in parts where `solve` takes it in parts,
///   and is not tried on after a minute (ten on ten-node tets);
/// - energy (strain and kinetic): once the patch stands still it grows by no more than a hundredth
///   with Euler's scheme and at equilibrium, and not to more than twice its greatest until then
///   with Newmark's and generalized-alpha, which promise that for linear bodies only. `track`,
///   which does not solve its steps, has fifteen frames to settle and is judged by the latter;
/// - rest: let go, and given eight periods in time, no more than 2 % of the greatest displacement
///   is left (static: 0.1 %);
/// - deadline (`track`): no more than one frame in fifty, and one, took longer than its budget; a
///   cell that fails this alone is tried three times, for what else the machine does makes frames
///   late too.
StabilityCell run_stability(const StabilityCase& c, const StabilityColumn& column,
                            const MeshHierarchy& hierarchy, const StabilityLimits& limits);

}  // namespace livetet
