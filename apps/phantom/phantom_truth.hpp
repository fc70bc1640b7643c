#pragma once

#include <optional>
#include <span>
#include <vector>

#include "apps/phantom/truth_file.hpp"
#include "base/progress.hpp"
#include "image/image.hpp"
#include "mechanics/material.hpp"
#include "mesh/hierarchy.hpp"
#include "meshing/options.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// Meshes the organ for the truth: from the label map like a scene's mesh, with `tets` on the
/// finest level, and shorter edges in the sphere `finer` if one is given. Nodes under the mask are
/// the set "fixed". Throws Error if meshing fails.
MeshHierarchy mesh_for_truth(const LabelImage& labels, const LabelImage& fixed_mask, int tets,
                             const ProgressCallback& progress = {},
                             const std::optional<FineSphere>& finer = {});

/// Model of the pressed body and of the press.
struct TruthModel {
    ModelChoice strain = "corotated";
    double rim_share =
        1;  ///< share of the depth at the patch's rim: below 1 for a disc with a rounded rim
    double flat_radius =
        0;  ///< radius that moves by the whole depth, m; from there to the rim a smooth step
    double poisson = Material{}.poisson;
};

/// Tissue pressed by a disc with a rounded rim: neo-Hookean; the inner 60 % of the radius move by
/// the whole depth, the rim by 65 % of it. (With a sharp rim the phantom does not come to rest
/// beyond 27 mm.)
TruthModel rounded_press(double patch_radius, double poisson = Material{}.poisson);

/// Radius, m, of the flat disc that presses as a rigid presser of so rounded a rim does: on a
/// half-space, of the same force (I. N. Sneddon, The relation between load and penetration in the
/// axisymmetric Boussinesq problem for a punch of arbitrary profile, 1965). With w(r) the share of
/// the depth and a the outer radius,
///     a_flat = integral from 0 to a of w(r) r / sqrt(a^2 - r^2) dr.
double flat_radius_of(const TruthModel& model, double outer_radius);

/// Computes the targets' displacements at each of `truth.depths`: the equilibrium of a scene's
/// default material but for the model's values, on P1 or P2 tets, with the set "fixed" at rest and
/// the surface patch about `truth.sensor_rest` moved along `truth.press_direction` from one depth
/// to the next. Fills truth.targets; returns the displacement of the mesh's nodes at the last
/// depth, m. Needs a PetscSession. Throws Error if the body does not come to rest.
std::vector<Vector3> solve_truth(const MeshHierarchy& hierarchy,
                                 std::span<const NamedPoint> targets, Truth& truth,
                                 const ProgressCallback& progress = {},
                                 const TruthModel& model = {});

}  // namespace livetet
