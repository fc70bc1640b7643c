#pragma once

#include <span>

#include "base/petsc.hpp"
#include "solvers/parallel/team_vector.hpp"

namespace livetet {

namespace detail {

/// What PETSc calls: (self.*work)(x, y) on local arrays, self from the shell's context.
template <class Self, auto work, auto get_context, class Shell>
PetscErrorCode apply_shell(Shell shell, Vec x, Vec y) noexcept {
    return in_callback([&] {
        void* context = nullptr;
        LIVETET_PETSC(get_context(shell, &context));
        const ReadArray from(x);
        WriteArray to(y);
        (static_cast<Self*>(context)->*work)(from.span(), to.span());
    });
}

}  // namespace detail

/// A square matrix of n local rows whose product is (self.*work)(x, y), with spans of x, which is
/// const, and of y. `self` must outlive it.
template <auto work, class Self>
PetscHandle<Mat> make_shell_matrix(MPI_Comm comm, PetscInt n, Self& self) {
    PetscHandle<Mat> A;
    LIVETET_PETSC(MatCreateShell(comm, n, n, PETSC_DETERMINE, PETSC_DETERMINE, &self, A.out()));
    PetscErrorCode (*multiply)(Mat, Vec, Vec) =
        detail::apply_shell<Self, work, MatShellGetContext, Mat>;
    LIVETET_PETSC(
        MatShellSetOperation(A.get(), MATOP_MULT, reinterpret_cast<void (*)()>(multiply)));
    return A;
}

/// Has the vectors that PETSc makes for `shell`, whose context is a Self, run on Self's team. Only
/// on one rank.
template <class Self>
void run_vectors_on_team(Mat shell) {
    PetscErrorCode (*create)(Mat, Vec*, Vec*) = [](Mat A, Vec* right, Vec* left) noexcept {
        return in_callback([&] {
            void* self = nullptr;
            PetscInt n = 0;
            LIVETET_PETSC(MatShellGetContext(A, &self));
            LIVETET_PETSC(MatGetLocalSize(A, &n, nullptr));
            for (Vec* v : {right, left}) {
                if (!v) continue;
                LIVETET_PETSC(VecCreateMPI(PetscObjectComm(reinterpret_cast<PetscObject>(A)), n,
                                           PETSC_DETERMINE, v));
                run_on_team(*v, static_cast<Self*>(self)->team());
            }
        });
    };
    LIVETET_PETSC(
        MatShellSetOperation(shell, MATOP_CREATE_VECS, reinterpret_cast<void (*)()>(create)));
}

/// Makes `pc` apply (self.*work)(r, z) in the same way.
template <auto work, class Self>
void make_shell_preconditioner(PC pc, Self& self, const char* name) {
    LIVETET_PETSC(PCSetType(pc, PCSHELL));
    LIVETET_PETSC(PCShellSetName(pc, name));
    LIVETET_PETSC(PCShellSetContext(pc, &self));
    LIVETET_PETSC(PCShellSetApply(pc, detail::apply_shell<Self, work, PCShellGetContext, PC>));
}

}  // namespace livetet
