#include "apps/bench/stability_limits.hpp"

namespace livetet {

namespace {

/// Those of known_limit() that hold only of frames (of `track` and of their plain counterparts).
std::string known_limit_of_frames(const StabilityCase& c, const StabilityColumn& column,
                                  const StabilityCell& cell) {
    const bool swings = cell.reason.starts_with("rest:") || cell.reason.starts_with("energy:");
    const bool is_finite_strain = column.strain->kinematics() == Kinematics::finite_strain;
    const bool is_newmark = column.scheme == TimeScheme::newmark;
    const bool is_folding = c.motion == PatchMotion::turn || c.motion == PatchMotion::jump;
    if (is_folding && has_cell_pressures(column.way) &&
        column.strain->kinematics() == Kinematics::corotated)
        return "cells fold without an inverted middle, and frames with pressures leave some in "
               "another equilibrium, of a hundredth of the greatest energy";
    if (swings && has_cell_pressures(column.way) && is_newmark &&
        (c.start != StartState::rest || (is_finite_strain && c.step_s <= 1e-5)))
        return "with pressures, frames damp by shear alone, and Newmark's scheme does not damp "
               "swings of the volume that are faster than its steps; generalized_alpha does";
    if (!has_cell_pressures(column.way) && is_of_hexahedra(column.way) && c.poisson >= 0.4999 &&
        is_finite_strain && !column.strain->is_bounded())
        return "displacements alone, which track takes by itself only below 0.49: where a model's "
               "tangent is not bounded, its volumetric part, 5,000 times the other, leads frames "
               "astray";
    if (!column.strain->is_isotropic() && has_ten_nodes(column.way) &&
        c.motion == PatchMotion::through)
        return "fibres 2,000 times as stiff as what they lie in, whose tangent frames do not "
               "bound: pressed through the far wall ten-node tets fold over for good";
    return {};
}

}  // namespace

std::string known_limit(const StabilityCase& c, const StabilityColumn& column,
                        const StabilityCell& cell) {
    const bool tracked = makes_frames(column.way), moves = c.start != StartState::rest;
    const bool squeezed = c.motion == PatchMotion::jump || c.motion == PatchMotion::turn ||
                          c.motion == PatchMotion::through;
    const bool thin = (c.min_dihedral_deg > 0 && c.min_dihedral_deg <= 1) || c.edge_ratio >= 10;
    const bool pressed_by_euler =
        column.scheme == TimeScheme::implicit_euler && !tracked &&
        (c.young_Pa <= 1 || c.density_kg_per_m3 >= 1e6 || c.step_s <= 1e-5);
    const bool shocked = has_ten_nodes(column.way) && c.step_s <= 1e-5 &&
                         column.scheme != TimeScheme::static_equilibrium;
    if (!column.strain->resists_collapse() &&
        (moves || squeezed || thin || pressed_by_euler || shocked))
        return "its energy falls in compression (Green's: below 1/sqrt 3 of the length), "
               "which the press does to tets of the patch's size, and does not "
               "bring an inverted tet back; corotated and neohookean are for that";
    if (moves && column.strain->kinematics() != Kinematics::small_strain)
        return "a start flat, inverted or at random: 50 Newton iterations a step, or one a "
               "frame, do not always find the way home in the time of "
               "the trial; Euler's long steps do (bench verification, recovery)";
    if (!column.strain->is_isotropic() && c.young_Pa <= 1 &&
        (column.scheme == TimeScheme::newmark ||
         (tracked && column.scheme == TimeScheme::generalized_alpha)))
        return "fibres 2,000 times as stiff as what they lie in snap tight and slack: Newmark's "
               "steps damp nothing that they do not resolve, and one Newton iteration a frame of "
               "generalized_alpha leaves too much";
    if ((c.motion == PatchMotion::jump || c.motion == PatchMotion::through) && !tracked &&
        column.strain->kinematics() == Kinematics::corotated)
        return "a patch that jumps by the body's length or presses through its far wall inverts "
               "tets, "
               "and the nearest rotation switches: 50 Newton iterations are not always enough";
    if (c.edge_ratio >= 100 && !tracked && column.strain->kinematics() == Kinematics::corotated)
        return "tets a hundred times thinner than wide bend with what lies under them, and their "
               "rotations far more than that: 50 Newton iterations are not "
               "always enough";
    if ((c.motion == PatchMotion::turn || c.motion == PatchMotion::jump) &&
        column.strain->kinematics() == Kinematics::finite_strain)
        return "turned by up to 28 degrees a step, or moved by the body's length, tets fold over, "
               "which one Newton iteration a frame does not always undo, "
               "and a static solve may keep in another equilibrium";
    return tracked ? known_limit_of_frames(c, column, cell) : std::string();
}

}  // namespace livetet
