#include "apps/phantom/phantom_truth.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "base/error.hpp"
#include "image/mask_selection.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/surface_patch.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"
#include "solvers/nonlinear/deformable_body.hpp"
#include "tracking/smooth_step.hpp"

namespace livetet {

namespace {

/// Norm of the elastic forces at the free nodes relative to that at the constrained nodes: zero in
/// equilibrium.
double force_out_of_balance(DeformableBody& body, const Constraints& constraints) {
    double free = 0, constrained = 0;
    const std::vector<Vector3> force = body.elastic_force();
    for (std::size_t n = 0; n < force.size(); ++n)
        (constraints.components[n] ? constrained : free) += force[n].squaredNorm();
    return std::sqrt(free / constrained);
}

/// How the press is increased from one depth to the next.
struct PressEffort {
    int steps;
    std::function<StepReport(DeformableBody&body, double dt)> moving, resting;
};

/// At 15 mm about 25 elements at the patch's rim are inverted, and Newton's method on the static
/// equations stops with 1e-4 to 2e-2 out of balance after 30 Newton iterations, depending on the
/// mesh. With the inertia of implicit Euler it reaches 1e-4, in about half the time; on three
/// meshes where the static solve ended near 1e-4 the targets agreed within a micrometre. A
/// neo-Hookean body needs a line search as well.
PressEffort effort_for(const ConstitutiveModel& model) {
    const auto newton = [](int iterations) {
        return [=](DeformableBody& body, double dt) {
            return body.solve(
                dt, {.max_newton = iterations, .tolerance = 1e-5, .linear_tolerance = 1e-2});
        };
    };
    const auto frame = [](int iterations) {
        return [=](DeformableBody& body, double dt) {
            return body.advance(dt, {.newton_iterations = iterations, .linear_tolerance = 1e-2});
        };
    };
    if (model.kinematics() == Kinematics::finite_strain) return {5, newton(10), newton(5)};
    return {3, frame(2), frame(1)};
}

/// Share of the depth by which a presser moves a point at `distance` from its axis.
double share_of_depth(const TruthModel& model, double outer_radius, double distance) {
    const double way =
        smooth_step((distance - model.flat_radius) / (outer_radius - model.flat_radius));
    return 1 - (1 - model.rim_share) * way;
}

struct PressedNode {
    std::int32_t node;
    double share;  ///< share of the depth
};

std::vector<PressedNode> pressed_nodes(const TetMesh& mesh, const Truth& truth,
                                       const TruthModel& model) {
    std::vector<PressedNode> pressed;
    const auto patch = surface_patch(mesh, truth.sensor_rest, truth.patch_radius).nodes;
    for (const std::int32_t n : patch) {
        const double distance = (mesh.nodes[n] - truth.sensor_rest).norm();
        pressed.push_back({n, share_of_depth(model, truth.patch_radius, distance)});
    }
    return pressed;
}

/// Moves the patch from one depth to the next and lets the body come to rest. Returns the remaining
/// force out of balance.
double press(DeformableBody& body, std::span<const PressedNode> pressed,
             std::span<const std::int32_t> fixed, const Truth& truth, std::size_t k,
             const PressEffort& effort) {
    constexpr int max_steps_at_rest = 120;
    constexpr double moving_s = 0.05, resting_s = 0.1, tolerance = 1e-4;
    const double from = k > 0 ? truth.depths[k - 1] : 0, to = truth.depths[k];
    Constraints constraints(body.displacement().size());
    for (int i = 1; i <= effort.steps; ++i) {
        const double depth = from + (to - from) * i / effort.steps;
        for (const PressedNode& p : pressed)
            constraints.prescribe(std::span(&p.node, 1), p.share * depth * truth.press_direction);
        constraints.prescribe(fixed, Vector3::Zero());
        body.set_constraints(constraints);
        (void)effort.moving(body, moving_s);
    }
    double imbalance = 1;
    for (int i = 0; i < max_steps_at_rest; ++i) {
        (void)effort.resting(body, resting_s);
        imbalance = force_out_of_balance(body, constraints);

        if (imbalance <= tolerance) return imbalance;
    }
    fail(
        "phantom: the truth at {:.1f} mm did not come to rest: force out of balance {:.1e}, "
        "expected {:.0e}",
        1e3 * to, imbalance, tolerance);
}

}  // namespace

TruthModel rounded_press(double patch_radius, double poisson) {
    return {"neohookean", 0.65, 0.6 * patch_radius, poisson};
}

double flat_radius_of(const TruthModel& model, double outer_radius) {
    constexpr int pieces = 1000;  // of the angle t with r = a sin t
    double sum = 0;
    for (int k = 0; k < pieces; ++k) {
        const double angle = (k + 0.5) / pieces * std::numbers::pi / 2;
        sum +=
            share_of_depth(model, outer_radius, outer_radius * std::sin(angle)) * std::sin(angle);
    }
    return outer_radius * sum * std::numbers::pi / 2 / pieces;
}

MeshHierarchy mesh_for_truth(const LabelImage& labels, const LabelImage& fixed_mask, int tets,
                             const ProgressCallback& progress,
                             const std::optional<FineSphere>& finer) {
    MeshingOptions options;
    if (finer) options.finer.push_back(*finer);
    options.target_tets = tets;
    options.target_tolerance = 0.3;  // only needs to be finer than the scene's
    options.levels = 4;
    if (progress) progress(0, "surface of the labels");
    MeshHierarchy hierarchy = std::move(
        build_hierarchy(surface_of_labels(labels, options).surface, options, progress).hierarchy);
    TetMesh& finest = hierarchy.levels.front();
    finest.node_sets["fixed"] = nodes_in_mask(finest, fixed_mask);
    return hierarchy;
}

std::vector<Vector3> solve_truth(const MeshHierarchy& hierarchy,
                                 std::span<const NamedPoint> targets, Truth& truth,
                                 const ProgressCallback& progress, const TruthModel& model) {
    const TetMesh& mesh = hierarchy.levels.front();
    Material material;
    material.poisson = model.poisson;
    DeformableBody body({PETSC_COMM_SELF, hierarchy}, {std::span(&material, 1), model.strain},
                        {.scheme = TimeScheme::implicit_euler}, {});
    const auto pressed = pressed_nodes(mesh, truth, model);
    const auto fixed = mesh.node_sets.find("fixed");
    if (fixed == mesh.node_sets.end() || fixed->second.empty())
        fail("phantom: the truth's mesh has no fixed nodes");

    truth.targets.clear();
    for (const NamedPoint& t : targets) truth.targets.push_back({t.name, t.position, {}});
    const PointSampler sampler(mesh, positions_of(targets));
    double worst = 0;
    for (std::size_t k = 0; k < truth.depths.size(); ++k) {
        if (progress)
            progress(
                static_cast<double>(k) / truth.depths.size(),
                fmt::format("{} tets, press {:.0f} mm", mesh.tets.size(), 1e3 * truth.depths[k]));
        const double imbalance =
            press(body, pressed, fixed->second, truth, k, effort_for(*model.strain));
        worst = std::max(worst, imbalance);
        const std::vector<Vector3> u = sampler.sample(body.displacement());
        for (std::size_t i = 0; i < u.size(); ++i) truth.targets[i].displacement.push_back(u[i]);
    }
    truth.provenance = fmt::format(
        "{} equilibrium, E = {} Pa, nu = {}, {} {} tets, {} nodes, {} of them held, {} pressed, "
        "force out of balance at most {:.1e}",
        model.strain->names().title, material.young_Pa, material.poisson, mesh.tets.size(),
        mesh.edge_nodes.empty() ? "P1" : "P2", mesh.nodes.size(), fixed->second.size(),
        pressed.size(), worst);
    if (progress) progress(1, "done");
    return body.displacement();
}

}  // namespace livetet
