#pragma once

#include <cstdint>

namespace livetet {

/// How often the calling thread has asked the C library for memory so far: malloc, calloc, realloc
/// and their aligned kin, and with them operator new, PETSc's and MPI's. For benchmarks and tests
/// that show that a loop allocates nothing.
std::uint64_t allocations_of_this_thread();

}  // namespace livetet
