#pragma once

#include <vector>

#include "solvers/parallel/partitioner.hpp"

namespace livetet::test {

/// Those that can be used: Debian's PTScotch has 32-bit indices.
inline std::vector<Partitioner> partitioners() {
    if (sizeof(PetscInt) > sizeof(std::int32_t)) return {Partitioner::metis};
    return {Partitioner::metis, Partitioner::ptscotch};
}

}  // namespace livetet::test
