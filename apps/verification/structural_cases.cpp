#include <fmt/format.h>

#include <cmath>

#include "apps/verification/meshes.hpp"
#include "apps/verification/problem.hpp"
#include "apps/verification/reference_models.hpp"

// Published benchmarks, large rotation, and the order of convergence.

namespace livetet::verification {

namespace {

/// The unit cube of n^3 distorted bricks, and coarser levels of tets.
std::vector<TetMesh> order_levels(int n, const Discretisation& d) {
    std::vector<TetMesh> levels{box({1, 1, 1}, {n, n, n}, 0.1)};
    if (d.hexahedral) return {straight_hexahedra(std::move(levels.front()), {n, n, n})};
    if (n > 3) levels.push_back(box({1, 1, 1}, {n / 2, n / 2, n / 2}));
    if (n > 12) levels.push_back(box({1, 1, 1}, {n / 4, n / 4, n / 4}));
    return levels;
}

Outcome order_of(const Discretisation& d) {
    const bool mixed = d.formulation == Formulation::mixed;
    const Isotropic m{1, mixed ? 0.4999 : 0.3, 1};
    ManufacturedField field;
    if (mixed) field.waves.diagonal().setZero();  // div u = 0
    Outcome o{.name = fmt::format("manufactured field, nu = {}, {}: u in L2", m.nu, d.name()),
              .source = "exact",
              .reference = 0,
              .unit = "1",
              .tolerance = d.quadratic ? 1e-3 : 2e-2,
              .runs = {},
              .expected_order = d.quadratic ? 3.0 : 2.0};
    const std::vector<int> bricks = d.hexahedral  ? std::vector{2, 4, 8}
                                    : d.quadratic ? std::vector{3, 6, 12}
                                                  : std::vector{6, 12, 24};
    for (const int n : bricks) {
        Problem problem(order_levels(n, d), m, d);
        problem.prescribe_surface([&](const Vector3& x) { return field.displacement(x); });
        problem.body_force([&](const Vector3& x) { return field.linear_body_force(m, x); });
        problem.solve(1, 1e-10);
        const double error =
            problem.l2_error([&](const Vector3& x) { return field.displacement(x); });
        o.runs.push_back(
            {nodes_text(problem.node_count()), 1.0 / n, error, error, problem.seconds()});
    }
    return o;
}

/// A smooth field held by its body force: orders 2 (P1) and 3 (P2, Q2) of the displacement in L2.
/// Near incompressibility, of a field without divergence, with pressures.
std::vector<Outcome> order_study() {
    std::vector<Outcome> outcomes;
    for (const Formulation form : {Formulation::displacement, Formulation::mixed}) {
        for (const bool quadratic : {false, true})
            outcomes.push_back(order_of({"linear", quadratic, form}));
        outcomes.push_back(order_of({"linear", true, form, true}));
    }
    return outcomes;
}

/// P2 on bricks of six tets, and Q2 on hexahedra of eight bricks each.
Outcome le10(const Discretisation& d) {
    Outcome o{.name = fmt::format("NAFEMS LE10, {}: sigma_yy at D", d.name()),
              .source = "NAFEMS",
              .reference = -5.38,
              .unit = "MPa",
              .tolerance = d.hexahedral ? 0.005 : 0.02,
              .runs = {}};
    for (const int k : d.hexahedral ? std::vector{2, 4, 6} : std::vector{1, 2, 3}) {
        TetMesh bricks = le10_plate(4 * k, 6 * k, 2 * k);
        if (d.hexahedral) bricks = bent_hexahedra(std::move(bricks), {4 * k, 6 * k, 2 * k});
        Problem problem({std::move(bricks)}, {210e9, 0.3, 7800}, d);
        problem.hold("x0", "x");
        problem.hold("y0", "y");
        problem.hold("outer", "xy");
        problem.hold("outer_middle", "z");
        problem.traction("top",
                         [](const Vector3&, const Vector3& n) -> Vector3 { return -1e6 * n; });
        problem.solve();
        const double stress =
            problem.body().nodal_stress()[problem.node_at({2, 0, 0.3})](1, 1) / 1e6;
        o.runs.push_back({nodes_text(problem.node_count()), 1.0 / k, stress,
                          std::abs(stress / -5.38 - 1), problem.seconds()});
    }
    return o;
}

std::vector<Outcome> le10_cases() {
    return {le10({"linear", true}),
            le10({.strain = "linear", .quadratic = true, .hexahedral = true})};
}

/// A slender cantilever under a dead load across its end, K = P L^2 / E I = 2: half its length
/// down. Beam theory: a solid differs by its shear (E / G h^2 / L^2) and its clamp.
std::vector<Outcome> cantilever() {
    std::vector<Outcome> outcomes;
    const double L = 20, h = 1, K = 2, E = 1e5;
    const Isotropic m{E, 0, 1};
    const Tip expected = elastica(K, 0);
    const double P = K * E * std::pow(h, 4) / 12 / (L * L);
    for (const char* strain : {"corotated", "green", "neohookean"}) {
        Outcome o{.name = fmt::format("cantilever at large rotation, {} P2, K = {}: w(L)/L",
                                      Discretisation{strain}.name().substr(
                                          0, Discretisation{strain}.name().size() - 3),
                                      K),
                  .source = "elastica (Bisshopp, Drucker 1945)",
                  .reference = expected.w,
                  .unit = "1",
                  .tolerance = 0.01,
                  .runs = {}};
        for (const int n : {20, 40}) {
            Problem problem({box({L, h, h}, {n, 2, 2})}, m, {strain, true});
            problem.hold("x0", "xyz");
            problem.traction(
                "x1", [&](const Vector3&, const Vector3&) { return Vector3(0, 0, -P / (h * h)); });
            problem.solve(4, 1e-8);
            const double w = -problem.displacement_at({L, h / 2, h / 2}).z() / L;
            o.runs.push_back({nodes_text(problem.node_count()), 1.0 / n, w,
                              std::abs(w / expected.w - 1), problem.seconds()});
        }
        outcomes.push_back(std::move(o));
    }
    return outcomes;
}

/// Cook's membrane at finite strain, uz = 0: an independent ten-node code's values on 16 x 16 x 1
/// cells.
std::vector<Outcome> cook_finite() {
    struct Reference {
        const char* strain;
        double values[3];
    };
    constexpr Reference references[] = {{"green", {13.635, 12.861, -13.507}},
                                        {"corotated", {14.107, 13.254, -13.564}}};
    std::vector<Outcome> outcomes;
    const double nu = 0.3, mu = 0.4225;
    for (const Reference& r : references) {
        Problem problem({cooks_membrane(16, 1, 1)}, {2 * mu * (1 + nu), nu, 1}, {r.strain, true});
        problem.hold("left", "xyz");
        problem.prescribe([](const Vector3&) { return true; },
                          [](const Vector3&) { return Vector3(0, 0, 0); }, "z");
        problem.traction("right",
                         [](const Vector3&, const Vector3&) { return Vector3(0, 1.0 / 16, 0); });
        problem.solve(4, 1e-8);
        const Vector3 middle = problem.displacement_at({48, 52, 0}),
                      corner = problem.displacement_at({48, 60, 0});
        const double values[3] = {middle.y(), corner.y(), corner.x()};
        constexpr const char* names[] = {"u_y(48, 52)", "u_y(48, 60)", "u_x(48, 60)"};
        for (int i = 0; i < 3; ++i)
            outcomes.push_back(
                {.name = fmt::format("Cook's membrane, finite strain, {}: {}",
                                     Discretisation{r.strain, true}.name(), names[i]),
                 .source = "independent P2 code, n = 16",
                 .reference = r.values[i],
                 .unit = "mm",
                 .tolerance = 5e-3,
                 .runs = {{nodes_text(problem.node_count()), 0, values[i],
                           std::abs(values[i] / r.values[i] - 1), i ? 0 : problem.seconds()}}});
    }
    return outcomes;
}

/// Cook's membrane, small strain, uz = 0, E = 70, load 100: an independent P2 code's
/// sequence 31.68, 32.05, 32.19.
std::vector<Outcome> cook_linear() {
    Outcome o{.name = "Cook's membrane, linear P2, nu = 1/3: u_y(48, 60)",
              .source = "independent P2 code, n = 32",
              .reference = 32.19,
              .unit = "mm",
              .tolerance = 2e-3,
              .runs = {}};
    for (const int n : {8, 16, 32}) {
        Problem problem({cooks_membrane(n, 1, 1)}, {70, 1.0 / 3, 1}, {"linear", true});
        problem.hold("left", "xyz");
        problem.prescribe([](const Vector3&) { return true; },
                          [](const Vector3&) { return Vector3(0, 0, 0); }, "z");
        problem.traction("right",
                         [](const Vector3&, const Vector3&) { return Vector3(0, 100.0 / 16, 0); });
        problem.solve();
        const double u = problem.displacement_at({48, 60, 0}).y();
        o.runs.push_back({nodes_text(problem.node_count()), 1.0 / n, u, std::abs(u / 32.19 - 1),
                          problem.seconds()});
    }
    return {o};
}

}  // namespace

std::vector<Case> structural_cases() {
    return {{"order of convergence", order_study},
            {"NAFEMS LE10", le10_cases},
            {"Cook's membrane", cook_linear},
            {"Cook's membrane, finite strain", cook_finite},
            {"cantilever at large rotation", cantilever}};
}

}  // namespace livetet::verification
