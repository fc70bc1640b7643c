#include "solvers/linear/matrix_preconditioner.hpp"

#include <petscksp.h>
#include <unistd.h>

namespace livetet {

void configure_factorisation(PC pc) {
    LIVETET_PETSC(PCSetType(pc, PCCHOLESKY));
    LIVETET_PETSC(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
}

FactorisationEstimate estimate_factorisation(Mat A) {
    PetscHandle<Mat> factor;
    MatFactorInfo info;
    LIVETET_PETSC(MatFactorInfoInitialize(&info));
    LIVETET_PETSC(MatGetFactor(A, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, factor.out()));
    LIVETET_PETSC(MatCholeskyFactorSymbolic(factor.get(), A, nullptr, &info));
    PetscReal operations = 0;
    PetscInt megabytes = 0;
    LIVETET_PETSC(MatMumpsGetRinfog(factor.get(), 1, &operations));
    LIVETET_PETSC(MatMumpsGetInfog(factor.get(), 17, &megabytes));
    return {operations, 1e6 * static_cast<double>(megabytes)};
}

bool is_affordable(Mat A, const FactorisationEstimate& estimate, FactorisationLimit limit) {
    const double max_operations = static_cast<double>(limit);  // for each nonzero
    constexpr double max_memory = 0.5;                         // of the machine's
    MatInfo info;
    LIVETET_PETSC(MatGetInfo(A, MAT_GLOBAL_SUM, &info));
    double memory =
        static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
    MPI_Allreduce(MPI_IN_PLACE, &memory, 1, MPI_DOUBLE, MPI_MIN,
                  PetscObjectComm(reinterpret_cast<PetscObject>(A)));
    return estimate.operations <= max_operations * info.nz_used &&
           estimate.bytes <= max_memory * memory;
}

MatrixPreconditioner::MatrixPreconditioner(PC place, MatrixMethod method, const std::string& prefix)
    : method_(method) {
    LIVETET_PETSC(PCCreate(PetscObjectComm(reinterpret_cast<PetscObject>(place)), pc_.out()));
    PC pc = pc_.get();
    LIVETET_PETSC(PCSetOptionsPrefix(pc, prefix.c_str()));
    if (method == MatrixMethod::factorisation) {
        configure_factorisation(pc);
    } else {
        // On bodies of many thin branches: weak couplings are left out of the aggregates.
        PetscReal threshold = 0.02;
        LIVETET_PETSC(PCSetType(pc, PCGAMG));
        LIVETET_PETSC(PCGAMGSetThreshold(pc, &threshold, 1));
        LIVETET_PETSC(PCGAMGSetReuseInterpolation(pc, PETSC_TRUE));
    }
    LIVETET_PETSC(PCSetFromOptions(pc));
    const auto set_up = [](PC shell) noexcept -> PetscErrorCode {
        return in_callback([&] {
            void* self = nullptr;
            LIVETET_PETSC(PCShellGetContext(shell, &self));
            static_cast<MatrixPreconditioner*>(self)->set_up(shell);
        });
    };
    const auto apply = [](PC shell, Vec r, Vec z) noexcept -> PetscErrorCode {
        return in_callback([&] {
            void* self = nullptr;
            LIVETET_PETSC(PCShellGetContext(shell, &self));
            LIVETET_PETSC(PCApply(static_cast<MatrixPreconditioner*>(self)->pc_.get(), r, z));
        });
    };
    LIVETET_PETSC(PCSetType(place, PCNONE));  // one that is a shell already has been set up
    LIVETET_PETSC(PCSetType(place, PCSHELL));
    LIVETET_PETSC(PCShellSetName(place, name_of(method).c_str()));
    LIVETET_PETSC(PCShellSetContext(place, this));
    LIVETET_PETSC(PCShellSetSetUp(place, set_up));
    LIVETET_PETSC(PCShellSetApply(place, apply));
}

void MatrixPreconditioner::set_matrix(Mat A) { LIVETET_PETSC(PCSetOperators(pc_.get(), A, A)); }

void MatrixPreconditioner::set_up(PC place) {
    constexpr int smoothing_steps = 6;
    PC pc = pc_.get();
    LIVETET_PETSC(PCSetUp(pc));
    PCFailedReason failure = PC_NOERROR;
    LIVETET_PETSC(PCGetFailedReason(pc, &failure));
    LIVETET_PETSC(PCSetFailedReason(place, failure));
    if (method_ != MatrixMethod::aggregation || has_cycle_) return;
    has_cycle_ = true;
    LIVETET_PETSC(PCMGSetCycleType(pc, PC_MG_CYCLE_W));
    PetscInt levels = 0;
    LIVETET_PETSC(PCMGGetLevels(pc, &levels));
    for (PetscInt l = 1; l < levels; ++l) {
        KSP smoother = nullptr;
        LIVETET_PETSC(PCMGGetSmoother(pc, l, &smoother));
        LIVETET_PETSC(KSPSetTolerances(smoother, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT,
                                       smoothing_steps));
    }
}

std::string name_of(MatrixMethod method) {
    return method == MatrixMethod::factorisation ? "cholesky (MUMPS)" : "gamg";
}

}  // namespace livetet
