#include <fmt/format.h>

#include <cmath>

#include "apps/verification/meshes.hpp"
#include "apps/verification/problem.hpp"

// Deep presses of a fine body of ten-node tets: a slab of an organ's size, its underside fixed, a
// disc of its upper face pressed by more than its radius.

namespace livetet::verification {

namespace {

const Vector3 slab_size(0.130, 0.104, 0.066);
constexpr double disc_radius_m = 0.012;

/// 102,816 tets, and two coarser levels.
std::vector<TetMesh> slab() {
    return {box(slab_size, {34, 28, 18}), box(slab_size, {17, 14, 9}), box(slab_size, {9, 7, 5})};
}

bool is_in_disc(const Vector3& x) {
    const Vector3 centre(slab_size.x() / 2, slab_size.y() / 2, slab_size.z());
    return (x - centre).norm() < disc_radius_m;
}

StepReport press(Problem& problem, double depth_m) {
    problem.prescribe(is_in_disc, [&](const Vector3&) { return Vector3(0, 0, -depth_m); });
    problem.apply();
    return problem.body().solve(0, {.max_newton = 50, .tolerance = 1e-8, .linear_tolerance = 1e-3});
}

/// Of the pressed disc, along the press.
double disc_force_N(Problem& problem) {
    const std::vector<Vector3> reactions = problem.body().reactions();
    double force = 0;
    for (std::size_t n = 0; n < reactions.size(); ++n)
        if (is_in_disc(problem.mesh().nodes[n])) force -= reactions[n].z();
    return force;
}

/// Newton iterations of one step from rest. Neo-Hookean: also the disc's force against the
/// derivative of the energy by the depth, from three presses.
std::vector<Outcome> deep_press(const ModelChoice& model, double depth_m) {
    constexpr double step_m = 1e-4;
    Problem problem(slab(), {5000, 0.45, 1000}, {model, true});
    problem.hold("z0", "xyz");
    const std::string size = nodes_text(problem.node_count());
    const StepReport report = press(problem, depth_m);
    const std::string name = fmt::format("slab of 102,816 tets, {} P2, pressed by {:.0f} mm",
                                         std::string(model.name()), 1e3 * depth_m);
    std::vector<Outcome> outcomes{
        {.name = name + ": Newton iterations",
         .source = "asked for: at most 40",
         .reference = 40,
         .unit = "1",
         .tolerance = 1,
         .runs = {{size, 0, 1. * report.newton_iterations,
                   report.converged ? report.newton_iterations / 40. : 1e9, problem.seconds()}}}};
    if (model != ModelChoice("neohookean")) return outcomes;
    const double before_J = problem.body().strain_energy();
    bool converge = press(problem, depth_m + step_m).converged;
    const double force_N = disc_force_N(problem);
    converge = press(problem, depth_m + 2 * step_m).converged && converge;
    const double derivative_N = (problem.body().strain_energy() - before_J) / (2 * step_m);
    outcomes.push_back(
        {.name = name + ": force",
         .source = "derivative of its energy",
         .reference = derivative_N,
         .unit = "N",
         .tolerance = 1e-4,
         .runs = {{size, 0, force_N, converge ? std::abs(force_N / derivative_N - 1) : 1e9,
                   problem.seconds()}}});
    return outcomes;
}

}  // namespace

std::vector<Case> press_cases() {
    return {{"deep press of a fine body, neohookean",
             [] { return deep_press("neohookean", 0.015); }, Case::Role::report},
            {"deep press of a fine body, corotated", [] { return deep_press("corotated", 0.010); },
             Case::Role::report}};
}

}  // namespace livetet::verification
