#include "solvers/parallel/first_rank.hpp"

#include <cstdint>

#include "base/petsc.hpp"
#include "base/together.hpp"

namespace livetet {

std::string same_on_all(MPI_Comm comm, std::string text) {
    auto size = static_cast<std::int64_t>(text.size());
    MPI_Bcast(&size, 1, MPI_INT64_T, 0, comm);
    text.resize(static_cast<std::size_t>(size));
    MPI_Bcast(text.data(), static_cast<int>(size), MPI_CHAR, 0, comm);
    return text;
}

std::string same_on_all(std::string text) { return same_on_all(PETSC_COMM_WORLD, std::move(text)); }

void on_first_rank(const std::function<void()>& work) { on_first_rank(PETSC_COMM_WORLD, work); }

void on_first_rank(MPI_Comm comm, const std::function<void()>& work) {
    int rank = 0;
    MPI_Comm_rank(comm, &rank);
    together(comm, [&] {
        if (rank == 0) work();
    });
}

}  // namespace livetet
