#include "apps/simulation/rank_usage.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <fstream>
#include <string>

namespace livetet {

namespace {

/// Resident bytes of files mapped by this process: program and libraries, shared by the ranks of a
/// machine. 0 if the system does not tell.
double mapped_file_bytes() {
    std::ifstream status("/proc/self/status");
    for (std::string name; status >> name; status.ignore(1000, '\n'))
        if (double kib = 0; name == "RssFile:" && status >> kib) return 1024 * kib;
    return 0;
}

}  // namespace

RankUsage usage_of_ranks(MPI_Comm comm) {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    MPI_Comm machine = MPI_COMM_NULL;
    MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine);
    int here = 1;
    MPI_Comm_size(machine, &here);
    MPI_Comm_free(&machine);
    const double peak = 1024.0 * static_cast<double>(used.ru_maxrss);
    const double shared = std::min(mapped_file_bytes(), peak);
    double sums[3] = {peak - shared + shared / here, petsc_isend_ct + petsc_send_ct,
                      petsc_isend_len + petsc_send_len};
    double most[2] = {peak, petsc_allreduce_ct};
    MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, comm);
    MPI_Allreduce(MPI_IN_PLACE, most, 2, MPI_DOUBLE, MPI_MAX, comm);
    return {sums[0], most[0], sums[1], sums[2], most[1]};
}

}  // namespace livetet
