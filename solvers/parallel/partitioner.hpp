#pragma once

#include <petscsys.h>

#include <cstddef>
#include <cstdint>

namespace livetet {

enum class Partitioner { automatic, metis, ptscotch };

/// `automatic` is METIS for so many tets, which takes some 20 MB on the first rank, and PTScotch
/// for more, where PETSc has 32-bit indices. Of 768,000 tets both took 1 s on two ranks.
constexpr std::size_t max_tets_of_metis = 100'000;

/// What `automatic` means for a mesh of so many tets.
constexpr Partitioner resolved_partitioner(Partitioner partitioner, std::size_t tets) {
    if (partitioner != Partitioner::automatic) return partitioner;
    const bool fits = tets <= max_tets_of_metis || sizeof(PetscInt) > sizeof(std::int32_t);
    return fits ? Partitioner::metis : Partitioner::ptscotch;
}

}  // namespace livetet
