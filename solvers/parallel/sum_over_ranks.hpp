#pragma once

#include <mpi.h>

#include <span>

namespace livetet {

/// Sums over the ranks, on every rank. In pieces: MPI needs room beside what it sums, and counts by
/// int. Collective.
void sum_over_ranks(MPI_Comm comm, std::span<double> values);

}  // namespace livetet
