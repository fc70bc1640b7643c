#include "apps/rank_usage.hpp"

#include <sys/resource.h>

namespace livetet {

RankUsage usage_of_ranks(MPI_Comm comm) {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    const double peak = 1024.0 * static_cast<double>(used.ru_maxrss);
    double sums[3] = {peak, petsc_isend_ct + petsc_send_ct, petsc_isend_len + petsc_send_len};
    double most[2] = {peak, petsc_allreduce_ct};
    MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, comm);
    MPI_Allreduce(MPI_IN_PLACE, most, 2, MPI_DOUBLE, MPI_MAX, comm);
    return {sums[0], most[0], sums[1], sums[2], most[1]};
}

}  // namespace livetet
