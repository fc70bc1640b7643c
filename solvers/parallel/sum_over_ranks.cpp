#include "solvers/parallel/sum_over_ranks.hpp"

#include <algorithm>

namespace livetet {

void sum_over_ranks(MPI_Comm comm, std::span<double> values) {
    constexpr std::size_t piece = 1 << 17;
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    if (ranks == 1) return;
    while (!values.empty()) {
        const std::size_t count = std::min(piece, values.size());
        MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(count), MPI_DOUBLE, MPI_SUM,
                      comm);
        values = values.subspan(count);
    }
}

}  // namespace livetet
