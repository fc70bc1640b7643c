#include "solvers/linear/saddle_point_solver.hpp"

namespace livetet {

SaddlePointSolver::SaddlePointSolver(std::unique_ptr<DisplacementSolver> inner)
    : LinearSolver(inner->tet_count()), inner_(std::move(inner)) {
    {
        const HeapGrowth grown(&costs_.pressures);
        coupling_ = std::make_unique<PressureCoupling>(fine());
    }
    const HeapGrowth grown(&costs_.preconditioner);
    MPI_Comm comm = fine().share().comm;
    LIVETET_PETSC(MatCreateTranspose(coupling_->b(), b_transposed_.out()));
    Mat blocks[4] = {fine().matrix(), b_transposed_.get(), coupling_->b(), coupling_->minus_c()};
    LIVETET_PETSC(MatCreateNest(comm, 2, nullptr, 2, nullptr, blocks, matrix_.out()));
    work_ = make_vector(fine().share());
    make_krylov(comm);
}

void SaddlePointSolver::make_krylov(MPI_Comm comm) {
    read_asked_tolerances();
    LIVETET_PETSC(KSPCreate(comm, krylov_.out()));
    KSP ksp = krylov_.get();
    LIVETET_PETSC(KSPSetType(ksp, KSPFGMRES));
    LIVETET_PETSC(KSPGMRESSetRestart(ksp, 60));
    LIVETET_PETSC(KSPSetOperators(ksp, matrix_.get(), matrix_.get()));
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp, &pc));
    LIVETET_PETSC(PCSetType(pc, PCSHELL));
    LIVETET_PETSC(PCShellSetName(pc, "block triangular: displacements, pressure mass"));
    LIVETET_PETSC(PCShellSetContext(pc, this));
    const auto apply = [](PC shell, Vec r, Vec y) noexcept -> PetscErrorCode {
        return in_callback([&] {
            void* self = nullptr;
            LIVETET_PETSC(PCShellGetContext(shell, &self));
            static_cast<SaddlePointSolver*>(self)->precondition(r, y);
        });
    };
    LIVETET_PETSC(PCShellSetApply(pc, apply));
    take_options(ksp);
}

void SaddlePointSolver::precondition(Vec r, Vec y) {
    Vec r_u = nullptr, r_p = nullptr, y_u = nullptr, y_p = nullptr;
    LIVETET_PETSC(VecNestGetSubVec(r, 0, &r_u));
    LIVETET_PETSC(VecNestGetSubVec(r, 1, &r_p));
    LIVETET_PETSC(VecNestGetSubVec(y, 0, &y_u));
    LIVETET_PETSC(VecNestGetSubVec(y, 1, &y_p));
    coupling_->apply_schur_inverse(r_p, y_p);
    LIVETET_PETSC(VecScale(y_p, -1));
    LIVETET_PETSC(MatMultTranspose(coupling_->b(), y_p, work_.get()));
    LIVETET_PETSC(VecAYPX(work_.get(), -1, r_u));
    inner_->precondition(work_.get(), y_u);
}

void SaddlePointSolver::set_constrained(std::span<const std::uint8_t> components) {
    inner_->set_constrained(components);
    invalidate();
}

void SaddlePointSolver::set_springs(std::span<const double> stiffness) {
    inner_->set_springs(stiffness);
    invalidate();
}

bool SaddlePointSolver::renew(const Configuration& at, const OperatorTerms& terms,
                              bool /*by_halves*/) {
    inner_->renew_operators(at, terms);
    coupling_->assemble(at);
    LIVETET_PETSC(MatAssemblyBegin(matrix_.get(), MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(matrix_.get(), MAT_FINAL_ASSEMBLY));
    return false;
}

LinearReport SaddlePointSolver::solve(Vec b_u, Vec b_p, Vec x_u, Vec x_p,
                                      const LinearControls& controls,
                                      std::span<const Vec> /*guesses*/) {
    (void)set_tolerances(controls);
    MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(krylov_.get()));
    Vec b_parts[2] = {b_u, b_p}, x_parts[2] = {x_u, x_p};
    PetscHandle<Vec> b, x;
    LIVETET_PETSC(VecCreateNest(comm, 2, nullptr, b_parts, b.out()));
    LIVETET_PETSC(VecCreateNest(comm, 2, nullptr, x_parts, x.out()));
    LIVETET_PETSC(VecScale(b_p, -1));  // B du - C dp = -g
    LIVETET_PETSC(VecSet(x.get(), 0));
    LIVETET_PETSC(KSPSolve(krylov_.get(), b.get(), x.get()));
    LIVETET_PETSC(VecScale(x_p, coupling_->scale()));
    LIVETET_PETSC(VecScale(b_p, -1));  // as it was given
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
