#include "solvers/linear/algebraic_solver.hpp"

#include <stdexcept>

#include "solvers/linear/matrix_preconditioner.hpp"

namespace livetet {

namespace {

/// Aggressive coarsening with short interpolation, each displacement component by itself: on
/// organs, boxes and a machine part up to ten times faster than the options for elasticity's
/// near-nullspace (Baker, Kolev, Yang 2010), whose interpolation fills the coarse operators.
void configure_boomeramg(PC pc) {
    LIVETET_PETSC(PCSetType(pc, PCHYPRE));
    LIVETET_PETSC(PCHYPRESetType(pc, "boomeramg"));
    const char* prefix = nullptr;  // "fieldsplit_displacement_" in the mixed form
    LIVETET_PETSC(PCGetOptionsPrefix(pc, &prefix));
    const auto set_option = [&](const std::string& name, const char* value) {
        const std::string option = fmt::format("-{}{}", prefix ? prefix : "", name);
        PetscBool given = PETSC_FALSE;
        LIVETET_PETSC(PetscOptionsHasName(nullptr, nullptr, option.c_str(), &given));
        if (!given) LIVETET_PETSC(PetscOptionsSetValue(nullptr, option.c_str(), value));
    };
    set_option("pc_hypre_boomeramg_strong_threshold", "0.5");
    set_option("pc_hypre_boomeramg_coarsen_type", "HMIS");
    set_option("pc_hypre_boomeramg_agg_nl", "1");
    set_option("pc_hypre_boomeramg_interp_type", "ext+i");
    set_option("pc_hypre_boomeramg_P_max", "4");
}

}  // namespace

AlgebraicSolver::AlgebraicSolver(DistributedHierarchy mesh, const ElasticModel& model,
                                 SolverKind kind, Role role)
    : DisplacementSolver(mesh, role, ThreadTeam::alone()),
      kind_(kind == SolverKind::automatic ? SolverKind::gamg : kind),
      is_chosen_(kind != SolverKind::automatic) {
    add_level(mesh, model, MatrixLayout::scalars);
    const HeapMeter meter(&costs_.preconditioner);
    make_krylov(mesh.comm, ErrorEstimate::none);
}

void AlgebraicSolver::configure(PC pc) {
    switch (kind_) {
        case SolverKind::boomeramg:
            return configure_boomeramg(pc);
        case SolverKind::gamg:
            LIVETET_PETSC(PCSetType(pc, PCGAMG));
            // A Newton iteration's operator differs little from the one before.
            LIVETET_PETSC(PCGAMGSetReuseInterpolation(pc, PETSC_TRUE));
            return;
        case SolverKind::direct:
            return configure_factorisation(pc);
        case SolverKind::petsc:  // the user's options choose
            return;
        default:
            throw std::logic_error("AlgebraicSolver: a kind of another class");
    }
}

void AlgebraicSolver::choose_factorisation() {
    is_chosen_ = true;
    PetscBool given = PETSC_FALSE;
    LIVETET_PETSC(PetscOptionsHasName(nullptr, prefix().c_str(), "-pc_type", &given));
    if (given || !is_affordable(matrix(), estimate_factorisation(matrix()),
                                FactorisationLimit::as_quick_as_aggregation))
        return;
    kind_ = SolverKind::direct;
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    configure(pc);
    LIVETET_PETSC(PCSetFromOptions(pc));
}

RenewalExtent AlgebraicSolver::renew(const Configuration& at, const OperatorTerms& terms,
                                     RenewalExtent /*wanted*/) {
    fine().assemble(at, terms);
    if (!is_chosen_) choose_factorisation();
    return RenewalExtent::whole;
}

void AlgebraicSolver::set_constrained(std::span<const std::uint8_t> components) {
    fine().set_constrained(components);
    invalidate();
}

void AlgebraicSolver::set_springs(std::span<const double> stiffness) {
    fine().set_springs(stiffness);
    invalidate();
}

}  // namespace livetet
