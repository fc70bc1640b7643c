#include "apps/phantom_truth.hpp"

#include <algorithm>

#include "base/error.hpp"
#include "mesh/node_selection.hpp"
#include "mesh/surface_patch.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"
#include "solvers/deformable_body.hpp"

namespace livetet {

namespace {

/// Brings the patch from one depth to the next. Newton's method can go round in circles where elements at the patch's
/// rim are flattened: then it goes back and comes again in smaller steps. Returns the force left out of balance,
/// relative to the forces at work.
double press(DeformableBody& body, std::span<const std::int32_t> patch, std::span<const std::int32_t> fixed,
             const Truth& truth, std::size_t k) {
    constexpr StepEffort effort{.linearisations = 30, .tolerance = 1e-4, .linear_tolerance = 1e-3};
    // Measured: a body left at 5e-3 differs at the targets by what one mesh differs from the next.
    constexpr double acceptable = 1e-2;
    const double from = k > 0 ? truth.depths[k - 1] : 0, to = truth.depths[k];
    Constraints constraints(body.displacement().size());
    double imbalance = 0;
    for (int steps = 1; steps <= 2; ++steps) {
        for (int i = steps == 1 ? 1 : 0; i <= steps; ++i) {
            constraints.prescribe(patch, (from + (to - from) * i / steps) * truth.press_direction);
            constraints.prescribe(fixed, Vector3::Zero());
            body.set_constraints(constraints);
            imbalance = body.step(0, effort).imbalance;
        }
        if (imbalance <= (steps == 1 ? effort.tolerance : acceptable)) return imbalance;
    }
    fail("phantom: the truth at {:.1f} mm did not converge: force out of balance {:.1e}, expected {:.0e}", 1e3 * to,
         imbalance, acceptable);
}

}  // namespace

MeshHierarchy mesh_for_truth(const LabelImage& labels, const LabelImage& fixed_mask, int tets,
                             const ProgressCallback& progress) {
    MeshingOptions options;
    options.target_tets = tets;
    options.target_tolerance = 0.3;  // finer than the scene's is all that matters
    options.levels = 4;
    if (progress) progress(0, "surface of the labels");
    MeshHierarchy hierarchy =
        std::move(build_hierarchy(surface_of_labels(labels, options).surface, options, progress).hierarchy);
    TetMesh& finest = hierarchy.levels.front();
    finest.node_sets["fixed"] = nodes_in_mask(finest, fixed_mask);
    return hierarchy;
}

void solve_truth(const MeshHierarchy& hierarchy, std::span<const NamedPoint> targets, Truth& truth,
                 const ProgressCallback& progress) {
    const TetMesh& mesh = hierarchy.levels.front();
    const Material material;
    DeformableBody body(PETSC_COMM_SELF, hierarchy, {}, std::span(&material, 1), StrainModel::corotated, {}, {});
    const SurfacePatch patch = surface_patch(mesh, truth.sensor_rest, truth.patch_radius);
    const auto fixed = mesh.node_sets.find("fixed");
    if (fixed == mesh.node_sets.end() || fixed->second.empty()) fail("phantom: the truth's mesh has no fixed nodes");

    std::vector<Vector3> places;
    truth.targets.clear();
    for (const NamedPoint& t : targets) {
        places.push_back(t.position);
        truth.targets.push_back({t.name, t.position, {}});
    }
    const BarycentricMap map = map_into(mesh, places);
    double worst = 0;
    for (std::size_t k = 0; k < truth.depths.size(); ++k) {
        if (progress)
            progress(static_cast<double>(k) / truth.depths.size(),
                     fmt::format("{} tets, press {:.0f} mm", mesh.tets.size(), 1e3 * truth.depths[k]));
        const double imbalance = press(body, patch.nodes, fixed->second, truth, k);
        worst = std::max(worst, imbalance);
        const std::vector<Vector3> u = body.displacement();
        for (std::size_t i = 0; i < places.size(); ++i) truth.targets[i].displacement.push_back(interpolate(map, i, u));
    }
    truth.provenance = fmt::format(
        "static corotated equilibrium, E = {} Pa, nu = {}, {} tets, {} nodes, {} of them held, {} pressed, "
        "force out of balance at most {:.1e}",
        material.young_Pa, material.poisson, mesh.tets.size(), mesh.nodes.size(), fixed->second.size(),
        patch.nodes.size(), worst);
    if (progress) progress(1, "done");
}

}  // namespace livetet
