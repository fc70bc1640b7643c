#pragma once

#include <petscsys.h>

namespace livetet::test {

/// Number of ranks that the tests run on.
inline int rank_count() {
    int ranks = 1;
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    return ranks;
}

}  // namespace livetet::test
