#pragma once

#include <span>
#include <vector>

#include "apps/phantom/truth_file.hpp"
#include "base/progress.hpp"
#include "image/image.hpp"
#include "mechanics/material.hpp"
#include "mesh/hierarchy.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// The organ's hierarchy for the truth: from the label map as a scene's would be, but with `tets`
/// on the finest level. Its nodes under the mask are in the set "fixed". Throws Error as the
/// meshing does.
MeshHierarchy mesh_for_truth(const LabelImage& labels, const LabelImage& fixed_mask, int tets,
                             const ProgressCallback& progress = {});

/// What is pressed, and by what.
struct TruthModel {
    ModelChoice strain = "corotated";
    double rim_share =
        1;  ///< of the depth, that the patch's rim goes: below 1 for a disc with a rounded rim
    double flat_radius =
        0;  ///< what lies within goes the whole depth, m; from there to the rim a smooth step
};

/// The targets' displacements at each of `truth.depths`: equilibrium of a scene's default material,
/// corotated or neo-Hookean, on the hierarchy's P1 or P2 tets, the set "fixed" held, the surface
/// patch about `truth.sensor_rest` moved along `truth.press_direction` from one depth to the next.
/// Fills truth.targets. Needs a PetscSession. Throws Error where the body does not come to rest.
void solve_truth(const MeshHierarchy& hierarchy, std::span<const NamedPoint> targets, Truth& truth,
                 const ProgressCallback& progress = {}, const TruthModel& model = {});

}  // namespace livetet
