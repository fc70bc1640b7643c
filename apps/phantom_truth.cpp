#include "apps/phantom_truth.hpp"

#include "base/error.hpp"
#include "mesh/node_selection.hpp"
#include "mesh/surface_patch.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"
#include "solvers/deformable_body.hpp"

namespace livetet {

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
    const StepEffort effort{.linearisations = 60, .tolerance = 1e-4, .linear_tolerance = 1e-3};
    for (std::size_t k = 0; k < truth.depths.size(); ++k) {
        if (progress)
            progress(static_cast<double>(k) / truth.depths.size(),
                     fmt::format("{} tets, press {:.0f} mm", mesh.tets.size(), 1e3 * truth.depths[k]));
        Constraints constraints(mesh.nodes.size());
        constraints.prescribe(patch.nodes, truth.depths[k] * truth.press_direction);
        constraints.prescribe(fixed->second, Vector3::Zero());
        body.set_constraints(constraints);
        const StepReport report = body.step(0, effort);
        if (!report.converged)
            fail("phantom: the truth at {:.1f} mm did not converge: force out of balance {:.1e}, expected {:.0e}",
                 1e3 * truth.depths[k], report.imbalance, effort.tolerance);
        const std::vector<Vector3> u = body.displacement();
        for (std::size_t i = 0; i < places.size(); ++i) truth.targets[i].displacement.push_back(interpolate(map, i, u));
    }
    truth.provenance =
        fmt::format("static corotated equilibrium, E = {} Pa, nu = {}, {} tets, {} nodes, {} of them held, {} pressed",
                    material.young_Pa, material.poisson, mesh.tets.size(), mesh.nodes.size(), fixed->second.size(),
                    patch.nodes.size());
    if (progress) progress(1, "done");
}

}  // namespace livetet
