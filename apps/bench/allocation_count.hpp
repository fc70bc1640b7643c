#pragma once

#include <cstdint>

namespace livetet {

/// Number of allocations by the calling thread so far: malloc, calloc, realloc and their aligned
/// variants, and through them operator new, PETSc and MPI. For benchmarks and tests that show that
/// a loop allocates nothing.
std::uint64_t allocations_of_this_thread();

}  // namespace livetet
