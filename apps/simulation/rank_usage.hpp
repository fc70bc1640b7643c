#pragma once

#include "base/petsc.hpp"

namespace livetet {

/// What the ranks have used since the program began.
struct RankUsage {
    double peak_bytes = 0;  ///< memory, each rank's greatest, summed; what ranks of a machine map
                            ///< alike (libraries) once
    double peak_bytes_most = 0;  ///< of the rank that used most
    double messages = 0, message_bytes = 0,
           reductions = 0;  ///< sent by PETSc, all ranks; reductions of one rank
};

/// Collective; the same on every rank.
RankUsage usage_of_ranks(MPI_Comm comm);

}  // namespace livetet
