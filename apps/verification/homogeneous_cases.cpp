#include <fmt/format.h>

#include <numbers>
#include <utility>

#include "apps/verification/meshes.hpp"
#include "apps/verification/problem.hpp"
#include "apps/verification/reference_models.hpp"
#include "base/error.hpp"
#include "mechanics/materials/registry.hpp"

// States of homogeneous strain, or of fields that the elements represent exactly: errors are
// rounding errors on any mesh.

namespace livetet::verification {

namespace {

/// The models that reference_models.hpp writes anew.
constexpr std::pair<const char*, ReferenceModel> models[] = {
    {"linear", ReferenceModel::linear},
    {"corotated", ReferenceModel::corotated},
    {"green", ReferenceModel::green},
    {"neohookean", ReferenceModel::neohookean}};

ReferenceModel reference_model(const ModelChoice& model) {
    for (const auto& [name, reference] : models)
        if (model.name() == name) return reference;
    fail("{}: found no reference for this model", model.name());
}

std::vector<Discretisation> all_displacement() {
    std::vector<Discretisation> all;
    for (const auto& [model, reference] : models)
        for (const bool quadratic : {false, true}) all.push_back({model, quadratic});
    for (const auto& [model, reference] : models)
        all.push_back({.strain = model, .quadratic = true, .hexahedral = true});
    return all;
}

/// The unit cube of about n^3 bricks, in hexahedra where these are asked for.
TetMesh cube(int n, double distortion, const Discretisation& d) {
    if (!d.hexahedral) return box({1, 1, 1}, {n, n, n}, distortion);
    n += n % 2;
    return bent_hexahedra(box({1, 1, 1}, {n, n, n}, distortion), {n, n, n});
}

/// A linear field on the boundary of a distorted block fills the inside (Irons and Razzaque 1972):
/// of any material, since its stress is the same everywhere.
std::vector<Outcome> patch_tests() {
    Matrix3d A;
    A << 0.05, 0.08, -0.03, -0.04, -0.03, 0.06, 0.02, -0.05, 0.04;
    std::vector<Discretisation> all;
    for (const Formulation formulation : {Formulation::displacement, Formulation::mixed})
        for (const ConstitutiveModel* model : registered_materials()) {
            for (const bool quadratic : {false, true})
                all.push_back({*model, quadratic, formulation});
            all.push_back({*model, true, formulation, true});
        }
    std::vector<Outcome> outcomes;
    for (const Discretisation& d : all) {
        const bool mixed = d.formulation == Formulation::mixed;
        Problem problem({cube(4, 0.15, d)}, {1, mixed ? 0.4999 : 0.3, 1}, d);
        const auto exact = [&](const Vector3& x) -> Vector3 { return A * x; };
        problem.prescribe_surface(exact);
        problem.solve(1, 1e-14);
        double worst = 0;
        for (std::size_t n = 0; n < problem.node_count(); ++n)
            worst = std::max(worst,
                             (problem.displacement()[n] - exact(problem.mesh().nodes[n])).norm());
        outcomes.push_back(
            {.name = fmt::format("patch test, {}, nu = {}: u", d.name(), mixed ? "0.4999" : "0.3"),
             .source = "exact",
             .reference = 0,
             .unit = "m",
             .tolerance = 1e-10,
             .runs = {
                 {nodes_text(problem.node_count()), 0, worst, worst / 0.1, problem.seconds()}}});
    }
    return outcomes;
}

/// A bar stretched with free sides.
std::vector<Outcome> uniaxial_cases() {
    std::vector<Outcome> outcomes;
    const Isotropic m{1, 0.3, 1};
    for (const Discretisation& d : all_displacement())
        for (const double stretch : {0.7, 1.5}) {
            const auto expected = uniaxial(reference_model(d.strain), m, stretch);
            Problem problem({cube(2, 0.1, d)}, m, d);
            problem.hold("x0", "x");
            problem.hold("y0", "y");
            problem.hold("z0", "z");
            problem.hold("x1", "x", {stretch - 1, 0, 0});
            problem.solve(4, 1e-12);
            double force = 0;
            const auto reactions = problem.body().reactions();
            for (const std::int32_t n : problem.mesh().node_sets.at("x1"))
                force += reactions[n].x();
            const double lateral = 1 + problem.displacement_at({1, 1, 1}).y();
            const std::string name = fmt::format("uniaxial, {}, stretch {}: ", d.name(), stretch);
            const std::string size = nodes_text(problem.node_count());
            outcomes.push_back({.name = name + "P11",
                                .source = "closed form",
                                .reference = expected->P11,
                                .unit = "E",
                                .tolerance = 1e-8,
                                .runs = {{size, 0, force, std::abs(force / expected->P11 - 1),
                                          problem.seconds()}}});
            outcomes.push_back(
                {.name = name + "lateral",
                 .source = "closed form",
                 .reference = expected->lateral,
                 .unit = "1",
                 .tolerance = 1e-8,
                 .runs = {{size, 0, lateral, std::abs(lateral / expected->lateral - 1), 0}}});
        }
    return outcomes;
}

/// Simple shear by the boundary: Cauchy's stress P F^T inside.
std::vector<Outcome> shear_cases() {
    std::vector<Outcome> outcomes;
    const Isotropic m{1, 0.3, 1};
    const double g = 0.5;
    for (const Discretisation& d : all_displacement()) {
        Problem problem({cube(3, 0.1, d)}, m, d);
        Matrix3d F = Matrix3d::Identity();
        F(0, 1) = g;
        problem.prescribe_surface([&](const Vector3& x) -> Vector3 { return F * x - x; });
        problem.solve(2, 1e-12);
        const Matrix3d P = simple_shear(reference_model(d.strain), m, g);
        const Matrix3d expected = d.is_linear() ? P : Matrix3d(P * F.transpose());
        double worst = 0, value = 0;
        for (const TetFields& f : problem.body().tet_fields()) {
            worst = std::max(worst, (f.cauchy_stress_Pa - expected).norm());
            value = f.cauchy_stress_Pa(0, 1);
        }
        outcomes.push_back(
            {.name = fmt::format("simple shear by {}, {}: Cauchy stress", g, d.name()),
             .source = "closed form",
             .reference = expected(0, 1),
             .unit = "E",
             .tolerance = 1e-8,
             .runs = {{nodes_text(problem.node_count()), 0, value, worst / expected.norm(),
                       problem.seconds()}}});
    }
    return outcomes;
}

/// Fields of pure bending and of torsion on the boundary: quadratic, so exact on P2, on Q2 whose
/// hexahedra are boxes, and of second order on P1. At a twist so small that all strain models
/// agree.
std::vector<Outcome> quadratic_fields() {
    std::vector<Outcome> outcomes;
    const Isotropic m{1, 0.3, 1};
    const double size = 1e-5;
    for (const bool is_torsion : {false, true})
        for (const Discretisation& d : all_displacement()) {
            const auto exact = [&](const Vector3& x) {
                const Vector3 y = x - Vector3(0.5, 0.5, 0.5);
                return is_torsion ? torsion(m, size, y) : pure_bending(m, size, y);
            };
            Outcome o{
                .name = fmt::format("{}, {}: u", is_torsion ? "torsion" : "pure bending", d.name()),
                .source = "closed form",
                .reference = 0,
                .unit = "m",
                .tolerance = 0,
                .runs = {}};
            for (const int n : d.quadratic ? std::vector{4} : std::vector{4, 8}) {
                const bool is_bent = d.quadratic && !d.hexahedral;
                Problem problem({cube(n, is_bent ? 0.15 : 0, d)}, m, d);
                problem.prescribe_surface([&](const Vector3& x) { return exact(x).u; });
                problem.solve(1, d.is_linear() ? 1e-12 : 1e-9);
                const double error = problem.l2_error([&](const Vector3& x) { return exact(x).u; });
                o.runs.push_back(
                    {nodes_text(problem.node_count()), 1.0 / n, error, error, problem.seconds()});
            }
            // The models differ from the linear one by terms of the strain's size.
            o.tolerance = d.quadratic ? (d.is_linear() ? 1e-10 : 10 * size) : 3e-2;
            o.expected_order = d.quadratic ? 0 : 2;
            outcomes.push_back(std::move(o));
        }
    return outcomes;
}

}  // namespace

std::vector<Case> homogeneous_cases() {
    return {{"patch tests", patch_tests},
            {"uniaxial stretch", uniaxial_cases},
            {"simple shear", shear_cases},
            {"bending and torsion fields", quadratic_fields}};
}

}  // namespace livetet::verification
