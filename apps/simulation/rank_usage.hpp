#pragma once

#include "base/petsc.hpp"

namespace livetet {

/// Resources used by the ranks since the program began.
struct RankUsage {
    double peak_bytes =
        0;  ///< sum of the ranks' peak memory; libraries shared on a machine are counted once
    double max_peak_bytes = 0;  ///< of the rank with the highest peak
    double messages = 0, message_bytes = 0,
           reductions = 0;  ///< sent by PETSc on all ranks; reductions of one rank
};

/// Collective; the same on every rank.
RankUsage usage_of_ranks(MPI_Comm comm);

}  // namespace livetet
