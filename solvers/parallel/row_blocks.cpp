#include "solvers/parallel/row_blocks.hpp"

namespace livetet {

RowRange row_range(MPI_Comm comm, std::size_t rows) {
    int rank = 0, ranks = 1;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &ranks);
    return row_range(rows, static_cast<std::size_t>(rank), static_cast<std::size_t>(ranks));
}

RowBlocks::RowBlocks(MPI_Comm comm, std::size_t rows, std::span<const std::int32_t> mine)
    : block_(row_range(comm, rows)),
      shared_(comm, block_.size(), std::vector<PetscInt>(mine.begin(), mine.end())) {}

}  // namespace livetet
