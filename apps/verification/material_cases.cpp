#include <fmt/format.h>

#include <cmath>

#include "apps/verification/hyperelastic_forms.hpp"
#include "apps/verification/meshes.hpp"
#include "apps/verification/problem.hpp"
#include "mechanics/materials/holzapfel_gasser_ogden.hpp"
#include "mechanics/materials/mooney_rivlin.hpp"

// Mooney-Rivlin and Holzapfel-Gasser-Ogden in homogeneous states, which the elements hold exactly:
// by displacements at nu = 0.3 and with pressures at nu = 0.4999.

namespace livetet::verification {

namespace {

constexpr double c01_share = 0.3;  // c01 / (c10 + c01)

ModelChoice rubber() {
    MooneyRivlin model;
    model.c01_share = c01_share;
    return model;
}

ModelChoice tissue(const Fibres& f, const Vector3& direction) {
    HolzapfelGasserOgden model;
    model.k1_Pa = f.k1;
    model.k2 = f.k2;
    model.dispersion = f.dispersion;
    model.fibre_1 = direction;
    return model;
}

struct MaterialForm {
    Discretisation d;
    double nu;
    Isotropic material() const { return {1, nu, 1}; }
    std::string name() const { return fmt::format("{}, nu = {}", d.name(), nu); }
};

std::vector<MaterialForm> material_forms(const ModelChoice& model) {
    return {{{model, false}, 0.3},
            {{model, true}, 0.3},
            {{model, false, Formulation::mixed}, 0.4999},
            {{model, true, Formulation::mixed}, 0.4999}};
}

enum class Pull { uniaxial, equibiaxial };

/// A distorted cube with side 1 stretched along x, or x and y, its other sides free: P11 and the
/// stretch of the free sides.
FreeState pulled(const MaterialForm& form, Pull pull, double stretch, double& seconds) {
    Problem problem({box({1, 1, 1}, {2, 2, 2}, 0.1)}, form.material(), form.d);
    problem.hold("x0", "x");
    problem.hold("y0", "y");
    problem.hold("z0", "z");
    problem.hold("x1", "x", {stretch - 1, 0, 0});
    if (pull == Pull::equibiaxial) problem.hold("y1", "y", {0, stretch - 1, 0});
    problem.solve(8, 1e-12);
    double force = 0;  // over an area of 1
    const auto reactions = problem.body().reactions();
    for (const std::int32_t n : problem.mesh().node_sets.at("x1")) force += reactions[n].x();
    seconds = problem.seconds();
    return {force, 1 + problem.displacement_at({1, 1, 1}).z()};
}

void add_state(std::vector<Outcome>& outcomes, const std::string& name, const std::string& source,
               const MaterialForm& form, Pull pull, double stretch, const FreeState& expected,
               double tolerance) {
    double seconds = 0;
    const FreeState found = pulled(form, pull, stretch, seconds);
    const auto add = [&](const std::string& what, const std::string& unit, double value,
                         double reference) {
        outcomes.push_back({.name = name + ": " + what,
                            .source = source,
                            .reference = reference,
                            .unit = unit,
                            .tolerance = tolerance,
                            .runs = {{"27 corners", 0, value, std::abs(value / reference - 1),
                                      what == "P11" ? seconds : 0}}});
    };
    add("P11", "E", found.P11, expected.P11);
    add("free sides", "1", found.lateral, expected.lateral);
}

/// Stretches of Mooney-Rivlin: to its own principal stresses, and in the mixed form to the closed
/// forms of an incompressible one. These differ by a multiple of 1/2 - nu: at nu = 0.49999 by at
/// most 2e-4.
std::vector<Outcome> mooney_rivlin_stretches() {
    std::vector<Outcome> outcomes;
    for (const MaterialForm& form : material_forms(rubber()))
        for (const double stretch : {0.7, 1.5})
            for (const Pull pull : {Pull::uniaxial, Pull::equibiaxial}) {
                const Isotropic m = form.material();
                const bool one = pull == Pull::uniaxial;
                const auto name = [&](const MaterialForm& of) {
                    return fmt::format("{} stretch {}, {}", one ? "uniaxial" : "equibiaxial",
                                       stretch, of.name());
                };
                const PrincipalStress stress = mooney_rivlin(m, c01_share);
                add_state(outcomes, name(form), "principal stresses", form, pull, stretch,
                          one ? uniaxial(stress, stretch) : equibiaxial(stress, stretch), 1e-8);
                if (form.d.formulation != Formulation::mixed) continue;
                const double c01 = c01_share * m.mu() / 2, c10 = m.mu() / 2 - c01;
                const FreeState incompressible =
                    one ? FreeState{incompressible_uniaxial(c10, c01, stretch),
                                    1 / std::sqrt(stretch)}
                        : FreeState{incompressible_equibiaxial(c10, c01, stretch),
                                    1 / (stretch * stretch)};
                const MaterialForm nearly{form.d, 0.49999};
                add_state(outcomes, name(nearly) + ", incompressible", "Rivlin", nearly, pull,
                          stretch, incompressible, 3e-4);
            }
    return outcomes;
}

/// Simple shear of Mooney-Rivlin by the boundary: Cauchy's stress inside.
std::vector<Outcome> mooney_rivlin_shears() {
    std::vector<Outcome> outcomes;
    const double g = 0.5;
    for (const MaterialForm& form : material_forms(rubber())) {
        Problem problem({box({1, 1, 1}, {3, 3, 3}, 0.1)}, form.material(), form.d);
        problem.prescribe_surface([&](const Vector3& x) -> Vector3 { return {g * x.y(), 0, 0}; });
        problem.solve(2, 1e-12);
        const Matrix3d expected = mooney_rivlin_shear(form.material(), c01_share, g);
        double worst = 0, value = 0;
        for (const TetFields& f : problem.body().tet_fields()) {
            worst = std::max(worst, (f.cauchy_stress_Pa - expected).norm());
            value = f.cauchy_stress_Pa(2, 2);
        }
        outcomes.push_back(
            {.name = fmt::format("simple shear by {}, {}: Cauchy stress, s33", g, form.name()),
             .source = "Rivlin",
             .reference = expected(2, 2),
             .unit = "E",
             .tolerance = 1e-8,
             .runs = {{nodes_text(problem.node_count()), 0, value, worst / expected.norm(),
                       problem.seconds()}}});
    }
    return outcomes;
}

/// Stretches of Holzapfel-Gasser-Ogden along its fibres, which stiffen it; against them and across
/// them, where it is the neo-Hookean matrix alone; and along fibres that are dispersed.
std::vector<Outcome> fibre_stretches() {
    std::vector<Outcome> outcomes;
    const Vector3 x = Vector3::UnitX(), y = Vector3::UnitY();
    struct State {
        const char* name;
        double stretch;
        Vector3 fibre;
        Fibres fibres;
    };
    const Fibres aligned, dispersed{.dispersion = 0.1}, none{.k1 = 0};
    for (const State& s :
         {State{"along the fibres", 1.3, x, aligned}, State{"against the fibres", 0.8, x, aligned},
          State{"across the fibres", 1.3, y, aligned},
          State{"along dispersed fibres", 1.3, x, dispersed}})
        for (const MaterialForm& form : material_forms(tissue(s.fibres, s.fibre))) {
            const bool carries = s.stretch > 1 && s.fibre == x;
            const PrincipalStress stress =
                holzapfel_gasser_ogden(form.material(), carries ? s.fibres : none);
            add_state(outcomes,
                      fmt::format("uniaxial stretch {} {}, {}", s.stretch, s.name, form.name()),
                      "principal stresses", form, Pull::uniaxial, s.stretch,
                      uniaxial(stress, s.stretch), 1e-8);
        }
    return outcomes;
}

}  // namespace

std::vector<Case> material_cases() {
    return {{"Mooney-Rivlin: stretches", mooney_rivlin_stretches},
            {"Mooney-Rivlin: simple shear", mooney_rivlin_shears},
            {"Holzapfel-Gasser-Ogden: fibres", fibre_stretches}};
}

}  // namespace livetet::verification
