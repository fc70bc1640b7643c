#include "solvers/linear/saddle_point_solver.hpp"

#include "solvers/linear/unknown_parts.hpp"

namespace livetet {

namespace {

/// Two Chebyshev steps on S, scaled by its diagonal. The KSP around `pc` would apply the exact
/// Schur complement, so the steps are those of a PCKSP, which takes S.
void configure_schur_inverse(PC pc) {
    constexpr double largest = 2.5, smallest = 0.5;  // see PressureCoupling::minus_schur
    constexpr int steps = 2;
    LIVETET_PETSC(PCSetType(pc, PCKSP));
    KSP ksp = nullptr;
    LIVETET_PETSC(PCKSPGetKSP(pc, &ksp));
    LIVETET_PETSC(KSPSetType(ksp, KSPCHEBYSHEV));
    LIVETET_PETSC(KSPChebyshevSetEigenvalues(ksp, largest, smallest));
    LIVETET_PETSC(KSPSetNormType(ksp, KSP_NORM_NONE));
    LIVETET_PETSC(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, steps));
    PC of_steps = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp, &of_steps));
    LIVETET_PETSC(PCSetType(of_steps, PCJACOBI));
}

}  // namespace

SaddlePointSolver::SaddlePointSolver(std::unique_ptr<DisplacementSolver> inner)
    : LinearSolver(inner->tet_count()), inner_(std::move(inner)) {
    {
        const HeapMeter meter(&costs_.pressures);
        coupling_ = std::make_unique<PressureCoupling>(fine());
    }
    const HeapMeter meter(&costs_.preconditioner);
    MPI_Comm comm = fine().share().comm;
    LIVETET_PETSC(MatCreateTranspose(coupling_->b(), b_transposed_.out()));
    Mat blocks[4] = {fine().matrix(), b_transposed_.get(), coupling_->b(), coupling_->minus_c()};
    LIVETET_PETSC(MatCreateNest(comm, 2, nullptr, 2, nullptr, blocks, matrix_.out()));
    IS fields[2] = {nullptr, nullptr};
    LIVETET_PETSC(MatNestGetISs(matrix_.get(), fields, nullptr));
    fields_ = {fields[0], fields[1]};
    LIVETET_PETSC(MatCreateVecs(matrix_.get(), x_.out(), b_.out()));
    make_krylov(comm);
}

void SaddlePointSolver::make_krylov(MPI_Comm comm) {
    read_user_tolerances();
    LIVETET_PETSC(KSPCreate(comm, krylov_.out()));
    KSP ksp = krylov_.get();
    LIVETET_PETSC(KSPSetType(ksp, KSPFGMRES));
    LIVETET_PETSC(KSPGMRESSetRestart(ksp, 60));
    LIVETET_PETSC(KSPSetOperators(ksp, matrix_.get(), matrix_.get()));
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp, &pc));
    LIVETET_PETSC(PCSetType(pc, PCFIELDSPLIT));
    LIVETET_PETSC(PCFieldSplitSetIS(pc, "displacement", fields_.displacement));
    LIVETET_PETSC(PCFieldSplitSetIS(pc, "pressure", fields_.pressure));
    LIVETET_PETSC(PCFieldSplitSetType(pc, PC_COMPOSITE_SCHUR));
    LIVETET_PETSC(PCFieldSplitSetSchurFactType(pc, PC_FIELDSPLIT_SCHUR_FACT_UPPER));
    LIVETET_PETSC(
        PCFieldSplitSetSchurPre(pc, PC_FIELDSPLIT_SCHUR_PRE_USER, coupling_->minus_schur()));
    take_options(ksp);
}

void SaddlePointSolver::connect_inner() {
    is_connected_ = true;
    PC pc = nullptr, of_part = nullptr;
    PCType type = nullptr;
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PCGetType(pc, &type));
    if (std::string_view(type) != PCFIELDSPLIT) return;  // the user's options chose another
    LIVETET_PETSC(KSPSetUp(krylov_.get()));
    PetscInt count = 0;
    KSP* parts = nullptr;
    LIVETET_PETSC(PCFieldSplitSchurGetSubKSP(pc, &count, &parts));
    LIVETET_PETSC(KSPSetType(parts[0], KSPPREONLY));
    LIVETET_PETSC(KSPGetPC(inner_->inner_krylov(), &of_part));
    LIVETET_PETSC(KSPSetPC(parts[0], of_part));
    LIVETET_PETSC(KSPSetType(parts[1], KSPPREONLY));
    LIVETET_PETSC(KSPGetPC(parts[1], &of_part));
    configure_schur_inverse(of_part);
    for (PetscInt i = 0; i < 2; ++i) take_options(parts[i]);
    LIVETET_PETSC(PetscFree(parts));
}

void SaddlePointSolver::set_constrained(std::span<const std::uint8_t> components) {
    inner_->set_constrained(components);
    coupling_->set_constrained();
    invalidate();
}

void SaddlePointSolver::set_springs(std::span<const double> stiffness) {
    inner_->set_springs(stiffness);
    invalidate();
}

RenewalExtent SaddlePointSolver::renew(const Configuration& at, const OperatorTerms& terms,
                                       RenewalExtent /*wanted*/) {
    inner_->renew_operators(at, terms);
    coupling_->assemble(at);
    LIVETET_PETSC(MatAssemblyBegin(matrix_.get(), MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(matrix_.get(), MAT_FINAL_ASSEMBLY));
    if (!is_connected_) connect_inner();
    return RenewalExtent::whole;
}

LinearReport SaddlePointSolver::solve(Vec b_u, Vec b_p, Vec x_u, Vec x_p,
                                      const LinearControls& controls,
                                      std::span<const Vec> /*guesses*/) {
    (void)set_tolerances(controls);
    {
        const UnknownParts b(*this, b_.get());
        LIVETET_PETSC(VecCopy(b_u, b.u));
        LIVETET_PETSC(VecCopy(b_p, b.p));
        LIVETET_PETSC(VecScale(b.p, -1));  // B du - C dp = -g
    }
    LIVETET_PETSC(VecSet(x_.get(), 0));
    LIVETET_PETSC(KSPSolve(krylov_.get(), b_.get(), x_.get()));
    {
        const UnknownParts x(*this, x_.get());
        LIVETET_PETSC(VecCopy(x.u, x_u));
        LIVETET_PETSC(VecCopy(x.p, x_p));
        LIVETET_PETSC(VecScale(x_p, coupling_->scale()));
    }
    LinearReport report;
    finish_report(krylov_.get(), report);
    return report;
}

SolverCosts SaddlePointSolver::costs() const {
    SolverCosts all = inner_->costs();
    all.rotations += costs_.rotations;
    all.matrix += costs_.matrix;
    all.pressures += costs_.pressures;
    all.preconditioner += costs_.preconditioner;
    return all;
}

std::string SaddlePointSolver::name() const {
    KSPType krylov = nullptr;
    LIVETET_PETSC(KSPGetType(krylov_.get(), &krylov));
    return fmt::format("{} + {}", krylov ? krylov : "?", inner_->preconditioner_name());
}

}  // namespace livetet
