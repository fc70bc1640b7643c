#include <fmt/format.h>

#include <random>

#include "apps/verification/meshes.hpp"
#include "apps/verification/problem.hpp"
#include "mechanics/materials/registry.hpp"

// Bodies that start flat, inverted or at random positions, fixed at one face: do they return to
// rest?

namespace livetet::verification {

namespace {

enum class Start { flat, everted, random };

std::vector<Vector3> start_of(const TetMesh& mesh, Start start) {
    std::mt19937 generator(7);
    std::vector<Vector3> u;
    for (const Vector3& x : mesh.nodes) {
        Vector3 to = x;
        if (start == Start::flat) to = Vector3(x.x(), x.y(), 0.5);
        if (start == Start::everted) to = Vector3(-x.x(), x.y(), x.z());
        if (start == Start::random)
            for (int c = 0; c < 3; ++c)
                to[c] = std::generate_canonical<double, 53>(generator) * (c == 0 ? 2 : 1);
        u.push_back(to - x);
    }
    return u;
}

/// Damped implicit Euler with long steps, each one Newton solve to equilibrium of the step: as a
/// user would let a body go.
Outcome recovery(const Discretisation& d, Start start) {
    constexpr const char* names[] = {"flat", "everted", "random"};
    Problem problem({box({2, 1, 1}, {6, 3, 3})}, {1000, 0.3, 1}, d,
                    {.scheme = TimeScheme::implicit_euler});
    problem.hold("x0", "xyz");
    problem.apply();
    problem.body().set_displacement(start_of(problem.mesh(), start));
    int newton_iterations = 0, steps = 0;
    double largest = 1;
    const bool claimed = d.strain->recovers_from_inversion(d.quadratic);
    for (; steps < (claimed ? 400 : 20) && largest > 1e-8; ++steps) {
        newton_iterations +=
            problem.body()
                .solve(0.2, {.max_newton = 20, .tolerance = 1e-8, .linear_tolerance = 1e-6})
                .newton_iterations;
        largest = 0;
        for (const Vector3& u : problem.body().displacement())
            largest = std::max(largest, u.norm());
    }
    return {.name = fmt::format("{} start, {}: distance from rest", names[static_cast<int>(start)],
                                d.name()),
            .source = "rest",
            .reference = 0,
            .unit = "m",
            .tolerance = claimed ? 1e-6 : 0,
            .runs = {{fmt::format("{} steps, {} Newton iterations", steps, newton_iterations), 0,
                      largest, largest, problem.seconds()}}};
}

/// `test`: of the elements that are claimed to return; `report`: of the others.
std::vector<Outcome> recoveries(Case::Role role) {
    std::vector<Outcome> outcomes;
    for (const ConstitutiveModel* model : registered_materials())
        for (const bool quadratic : {false, true})
            for (const Start start : {Start::flat, Start::everted, Start::random})
                if (model->recovers_from_inversion(quadratic) == (role == Case::Role::test))
                    outcomes.push_back(recovery({*model, quadratic}, start));
    return outcomes;
}

}  // namespace

std::vector<Case> recovery_cases() {
    return {{"recovery from inversion", [] { return recoveries(Case::Role::test); }},
            {"recovery from inversion, not claimed", [] { return recoveries(Case::Role::report); },
             Case::Role::report}};
}

}  // namespace livetet::verification
