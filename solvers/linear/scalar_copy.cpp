#include "solvers/linear/scalar_copy.hpp"

#include <petscmat.h>

namespace livetet {

Mat ScalarCopy::update(Mat A) {
    PetscBool scalars = PETSC_FALSE;
    LIVETET_PETSC(PetscObjectTypeCompareAny(reinterpret_cast<PetscObject>(A), &scalars, MATSEQAIJ,
                                            MATMPIAIJ, ""));
    if (scalars) return A;
    const bool first = !copy_;
    Mat copy = copy_.get();
    LIVETET_PETSC(MatConvert(A, MATAIJ, first ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX, &copy));
    if (first) {
        copy_ = PetscHandle<Mat>::adopt(copy);
        LIVETET_PETSC(MatSetBlockSize(copy, 3));
        LIVETET_PETSC(MatSetOption(copy, MAT_SYMMETRIC, PETSC_TRUE));
        LIVETET_PETSC(MatSetOption(copy, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
    }
    MatNullSpace near = nullptr;
    LIVETET_PETSC(MatGetNearNullSpace(A, &near));
    if (near) LIVETET_PETSC(MatSetNearNullSpace(copy, near));
    return copy;
}

}  // namespace livetet
