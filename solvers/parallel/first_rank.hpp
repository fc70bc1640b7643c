#pragma once

#include <mpi.h>

#include <functional>
#include <string>

namespace livetet {

/// Returns the text of the first rank of a communicator, PETSC_COMM_WORLD where none is given, on
/// every rank. Collective.
std::string same_on_all(MPI_Comm comm, std::string text);
std::string same_on_all(std::string text);

/// Runs `work` on the first rank of a communicator, PETSC_COMM_WORLD where none is given. If it
/// throws, all ranks throw: the others would wait for ever. Collective.
void on_first_rank(MPI_Comm comm, const std::function<void()>& work);
void on_first_rank(const std::function<void()>& work);

}  // namespace livetet
