#include <fmt/format.h>

#include <cmath>

#include "apps/verification/meshes.hpp"
#include "apps/verification/problem.hpp"

// Nearly incompressible bodies, for which the displacement formulation locks.

namespace livetet::verification {

namespace {

constexpr double nus[] = {0.3, 0.49, 0.4999};

struct Form {
    Discretisation d;
    std::vector<int> counts;  ///< cells a side, coarse to fine
    double tolerance;
    double order;
};

/// By displacements (where that locks, told but not judged) and with pressures.
std::vector<Form> forms(double nu, std::vector<int> p1, std::vector<int> p2) {
    const double locks = nu < 0.4 ? 1 : 0;
    return {{{"linear", false}, p1, locks * 0.02, 0},
            {{"linear", true}, p2, locks * 0.015, locks * 2},
            {{"linear", false, Formulation::mixed}, p1, 0.02, 0},
            {{"linear", true, Formulation::mixed}, p2, 0.015, 2}};
}

template <class Mesh>
std::vector<TetMesh> levels(int n, Mesh&& mesh) {
    std::vector<TetMesh> all{mesh(n)};
    for (n /= 2; n >= 3; n /= 2) all.push_back(mesh(n));
    return all;
}

enum class Shell { sphere, cylinder };

/// u_r at the inner and the outer face of a thick sphere or tube, a = 1, b = 2, under an inner
/// pressure of 1e-3 E. Edges are straight, so the body itself is met to second order only, on P2
/// too.
std::vector<Outcome> pressurised(Shell shell, Case::Role role) {
    const bool sphere = shell == Shell::sphere;
    std::vector<Outcome> outcomes;
    const double E = 1000, p = 1;
    for (const double nu : nus)
        for (const Form& form : forms(nu, {8, 16, 24}, {6, 12})) {
            if (role != (form.tolerance > 0 ? Case::Role::test : Case::Role::report)) continue;
            const Isotropic m{E, nu, 1};
            const RadialState inner =
                sphere ? thick_sphere(m, 1, 2, p, 1) : thick_cylinder(m, 1, 2, p, 1);
            const RadialState outer =
                sphere ? thick_sphere(m, 1, 2, p, 2) : thick_cylinder(m, 1, 2, p, 2);
            Outcome at_inner{.name = fmt::format("thick {}, nu = {}, {}: u_r(a)",
                                                 sphere ? "sphere" : "cylinder", nu, form.d.name()),
                             .source = "Lame",
                             .reference = inner.u,
                             .unit = "m",
                             .tolerance = form.tolerance,
                             .runs = {},
                             .expected_order = form.order};
            Outcome at_outer = at_inner;
            at_outer.name.replace(at_outer.name.size() - 2, 1, "b");
            at_outer.reference = outer.u;
            at_outer.expected_order = 0;
            for (const int n : form.counts) {
                Problem problem(levels(n,
                                       [&](int k) {
                                           return sphere
                                                      ? sphere_octant(1, 2, k, k)
                                                      : cylinder_quarter(1, 2, 0.25, k, k * 3 / 2,
                                                                         std::max(1, k / 6));
                                       }),
                                m, form.d);
                problem.hold("x0", "x");
                problem.hold("y0", "y");
                problem.hold("z0", "z");
                if (!sphere) problem.hold("z1", "z");
                // Pressure acts against the outward normal of the body.
                problem.traction("inner", [&](const Vector3&, const Vector3& normal) -> Vector3 {
                    return -p * normal;
                });
                problem.solve();
                const std::string size = nodes_text(problem.node_count());
                const double u_a = problem.displacement_at({1, 0, 0}).x(),
                             u_b = problem.displacement_at({2, 0, 0}).x();
                at_inner.runs.push_back(
                    {size, 1.0 / n, u_a, std::abs(u_a / inner.u - 1), problem.seconds()});
                at_outer.runs.push_back({size, 1.0 / n, u_b, std::abs(u_b / outer.u - 1), 0});
            }
            outcomes.push_back(std::move(at_inner));
            outcomes.push_back(std::move(at_outer));
        }
    return outcomes;
}

/// Iterations to 1e-8 of the linear solve, P2 on a P1 hierarchy: a block held at its foot and
/// sheared at its head.
std::vector<Outcome> iterations() {
    Outcome o{.name = "iterations to 1e-8, linear P2 mixed, at nu = 0.499 over those at 0.3",
              .source = "asked for: at most twice",
              .reference = 1,
              .unit = "1",
              .tolerance = 2,
              .runs = {}};
    double first = 0;
    for (const double nu : {0.3, 0.45, 0.49, 0.499, 0.4999}) {
        Problem problem(levels(12,
                               [](int n) {
                                   return box({1, 1, 1}, {n, n, n});
                               }),
                        {1, nu, 1}, {"linear", true, Formulation::mixed});
        problem.hold("z0", "xyz");
        problem.hold("z1", "xyz", {0.1, 0, -0.02});
        problem.apply();
        const StepReport report =
            problem.body().advance(0, {.newton_iterations = 1, .linear_tolerance = 1e-8});
        if (first == 0) first = report.iterations;
        const double ratio = report.iterations / first;
        if (nu < 0.4995)
            o.runs.push_back({fmt::format("nu {}: {}", nu, report.iterations), 0, ratio,
                              report.converged ? ratio : 1e9, problem.seconds()});
        else  // told, not judged
            o.runs.insert(o.runs.end() - 1, {fmt::format("nu {}: {}", nu, report.iterations), 0,
                                             ratio, ratio, problem.seconds()});
    }
    return {o};
}

}  // namespace

std::vector<Case> incompressible_cases() {
    const auto shell = [](const char* name, Shell s, Case::Role role) {
        return Case{name, [=] { return pressurised(s, role); }, role};
    };
    return {shell("thick sphere", Shell::sphere, Case::Role::test),
            shell("thick sphere, elements that lock", Shell::sphere, Case::Role::report),
            shell("thick cylinder", Shell::cylinder, Case::Role::test),
            shell("thick cylinder, elements that lock", Shell::cylinder, Case::Role::report),
            {"iterations near incompressibility", iterations}};
}

}  // namespace livetet::verification
