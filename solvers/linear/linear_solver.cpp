#include "solvers/linear/linear_solver.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "solvers/linear/algebraic_solver.hpp"
#include "solvers/linear/hex_solver.hpp"
#include "solvers/linear/live_solver.hpp"
#include "solvers/linear/multigrid_solver.hpp"
#include "solvers/linear/saddle_point_solver.hpp"

namespace livetet {

ChosenFormulation choose_formulation(const ElasticModel& model) {
    constexpr double locks_from = 0.49;
    if (model.formulation == Formulation::mixed) return {Formulation::mixed, "formulation: mixed"};
    if (model.formulation == Formulation::displacement)
        return {Formulation::displacement, "formulation: displacement"};
    const auto any = [&](auto&& is) {
        return std::any_of(model.materials.begin(), model.materials.end(), is);
    };
    const bool locks = any([](const Material& m) { return m.poisson >= locks_from; });
    const bool inverts = model.has_graded_patches && !is_bounded(model.materials, model.strain);
    if (!locks && !inverts)
        return {Formulation::displacement, fmt::format("no poisson >= {}", locks_from)};
    // lambda <= 0: no pressure can stand for it.
    if (any([](const Material& m) { return m.poisson <= 0; }))
        return {Formulation::displacement, "a poisson <= 0 has no pressure"};
    if (!locks)
        return {Formulation::mixed,
                "a model without bounded tangent on a mesh that is graded at patches"};
    return {Formulation::mixed, fmt::format("a poisson >= {}", locks_from)};
}

void LinearSolver::update_rotations(Vec u, ElementRotations& rotations) {
    if (!fine().reads_rotations()) return;
    static const PetscLogEvent event = log_event("LivetetRotations");
    const PhaseTimer timer(costs_.rotations, event);
    fine().update_rotations(u, rotations);
}

RenewalExtent LinearSolver::assemble(const Configuration& at, const OperatorTerms& terms,
                                     RenewalExtent wanted) {
    const bool is_linear = fine().is_linear();
    const std::pair factors(terms.whole_stiffness(), terms.mass);
    if (is_linear && kept_ == factors) return RenewalExtent::whole;
    static const PetscLogEvent event = log_event("LivetetAssembly");
    const PhaseTimer timer(costs_.matrix, event);
    kept_.reset();
    if (is_linear) kept_ = factors;
    is_new_ = true;
    return renew(at, terms, is_linear ? RenewalExtent::whole : wanted);
}

void LinearSolver::set_up_preconditioner() {
    if (!is_new_) return;
    is_new_ = false;
    static const PetscLogEvent event = log_event("LivetetSetUp");
    const PhaseTimer timer(costs_.preconditioner, event);
    const HeapMeter meter(costs_.preconditioner.times == 1 ? &costs_.preconditioner : nullptr);
    LIVETET_PETSC(KSPSetUp(preconditioned_krylov()));
}

void LinearSolver::read_user_tolerances() {
    const auto number = [](const char* name) {
        PetscReal value = 0;
        PetscBool given = PETSC_FALSE;
        LIVETET_PETSC(PetscOptionsGetReal(nullptr, nullptr, name, &value, &given));
        return given ? std::optional(value) : std::nullopt;
    };
    user_tolerance_ = number("-ksp_rtol");
    user_residual_ = number("-ksp_atol").value_or(user_residual_);
    if (const auto iterations = number("-ksp_max_it"))
        user_iterations_ = static_cast<int>(*iterations);
}

LinearControls LinearSolver::set_tolerances(const LinearControls& controls) {
    const LinearControls asked{user_tolerance_.value_or(controls.relative_tolerance),
                               user_iterations_.value_or(controls.max_iterations),
                               controls.deadline};
    LIVETET_PETSC(KSPSetTolerances(outer_krylov(), asked.relative_tolerance, user_residual_,
                                   PETSC_DEFAULT, asked.max_iterations));
    return asked;
}

KSP LinearSolver::krylov(const LinearControls& controls) {
    (void)set_tolerances(controls);
    return outer_krylov();
}

void LinearSolver::finish_report(KSP ksp, LinearReport& report) {
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    PetscInt iterations = 0;
    LIVETET_PETSC(KSPGetConvergedReason(ksp, &reason));
    LIVETET_PETSC(KSPGetIterationNumber(ksp, &iterations));
    LIVETET_PETSC(KSPGetResidualNorm(ksp, &report.residual));
    report.iterations = static_cast<int>(iterations);
    finish_report(reason, report);
}

void LinearSolver::finish_report(KSPConvergedReason reason, LinearReport& report) {
    report.reason = KSPConvergedReasons[reason];
    report.converged = reason > 0 && reason != KSP_CONVERGED_ITS;
    report.cut_short = reason == KSP_CONVERGED_ITS || reason == KSP_DIVERGED_ITS;
}

namespace {

std::unique_ptr<DisplacementSolver> make_displacement_solver(DistributedHierarchy mesh,
                                                             const ElasticModel& model,
                                                             const SolverOptions& options,
                                                             DisplacementSolver::Role role,
                                                             ThreadTeam& team) {
    const std::size_t levels = mesh.levels.size();
    switch (const SolverKind kind = resolved_kind(options.kind, levels)) {
        case SolverKind::multigrid:
            if (levels < 2)
                fail(
                    "solver.kind: found multigrid and a mesh of one level, expected a mesh of "
                    "several or another kind (automatic)");
            return std::make_unique<MultigridSolver>(std::move(mesh), model, options, role);
        case SolverKind::live:
            return std::make_unique<LiveSolver>(std::move(mesh), model, options, role, team);
        case SolverKind::boomeramg:
        case SolverKind::gamg:
        case SolverKind::direct:
        case SolverKind::petsc:
        case SolverKind::automatic:
            return std::make_unique<AlgebraicSolver>(std::move(mesh), model, kind, role);
    }
    throw std::logic_error("make_linear_solver: an unknown kind");
}

}  // namespace

std::unique_ptr<LinearSolver> make_linear_solver(DistributedHierarchy mesh,
                                                 const ElasticModel& model,
                                                 const SolverOptions& options, ThreadTeam& team) {
    using Role = DisplacementSolver::Role;
    const bool is_grid = !mesh.levels.front().share.hexahedra.empty();
    if (is_grid && options.coarse == CoarseOperator::galerkin)
        fail(
            "solver.coarse: found galerkin for a grid of hexahedra, expected automatic or "
            "rediscretised: its levels are nested");
    if (is_grid && options.kind != SolverKind::live)
        return std::make_unique<HexSolver>(std::move(mesh), model, options);
    const bool is_quadratic = !mesh.levels.front().share.quadratic_hexahedra.empty();
    if (is_quadratic && mesh.levels.size() > 1)
        fail("mesh hierarchy: found {} levels, the finest of hexahedra of 27 nodes, expected one",
             mesh.levels.size());
    if (is_quadratic && options.kind == SolverKind::live)
        fail(
            "solver.kind: found live and hexahedra of 27 nodes, expected another kind (automatic)");
    if (resolved_formulation(model) == Formulation::displacement)
        return make_displacement_solver(std::move(mesh), model, options, Role::solver, team);
    if (options.kind == SolverKind::live)
        return std::make_unique<SaddlePointSolver>(
            std::make_unique<LiveSolver>(std::move(mesh), model, options, Role::preconditioner,
                                         team),
            team);
    return std::make_unique<SaddlePointSolver>(
        make_displacement_solver(std::move(mesh), model, options, Role::preconditioner, team),
        team);
}

}  // namespace livetet
