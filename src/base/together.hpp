#pragma once

#include <mpi.h>

#include <exception>
#include <limits>
#include <string>

#include "base/error.hpp"

namespace livetet {

/// Runs `work`, without messages, on every rank of `comm`. If it throws on any, all throw the error
/// of the lowest such rank: the ranks that go on would wait for the others in the next call that
/// they make together. MPI_COMM_SELF need not have MPI initialised. Collective.
template <class Work>
void together(MPI_Comm comm, Work&& work) {
    if (comm == MPI_COMM_SELF) {
        work();
        return;
    }
    constexpr int none = std::numeric_limits<int>::max();
    int rank = 0, failed = none;
    MPI_Comm_rank(comm, &rank);
    std::exception_ptr own;
    std::string problem;
    try {
        work();
    } catch (const std::exception& e) {
        own = std::current_exception();
        problem = e.what();
        failed = rank;
    }
    MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MIN, comm);
    if (failed == none) return;
    auto size = static_cast<int>(problem.size());
    MPI_Bcast(&size, 1, MPI_INT, failed, comm);
    problem.resize(static_cast<std::size_t>(size));
    MPI_Bcast(problem.data(), size, MPI_CHAR, failed, comm);
    if (rank == failed) std::rethrow_exception(own);  // keeps its type: it may not be the user's
    throw Error(problem);
}

}  // namespace livetet
