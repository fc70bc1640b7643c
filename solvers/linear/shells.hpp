#pragma once

#include <span>

#include "base/petsc.hpp"

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

/// Makes `pc` apply (self.*work)(r, z) in the same way.
template <auto work, class Self>
void make_shell_preconditioner(PC pc, Self& self, const char* name) {
    LIVETET_PETSC(PCSetType(pc, PCSHELL));
    LIVETET_PETSC(PCShellSetName(pc, name));
    LIVETET_PETSC(PCShellSetContext(pc, &self));
    LIVETET_PETSC(PCShellSetApply(pc, detail::apply_shell<Self, work, PCShellGetContext, PC>));
}

}  // namespace livetet
