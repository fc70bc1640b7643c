#pragma once

#include <petscsys.h>

#include <numeric>
#include <vector>

#include "mesh/hierarchy_rows.hpp"

namespace livetet::test {

/// Number of ranks that the tests run on.
inline int rank_count() {
    int ranks = 1;
    MPI_Comm_size(PETSC_COMM_WORLD, &ranks);
    return ranks;
}

/// Number of this rank.
inline int rank() {
    int number = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &number);
    return number;
}

/// This rank's rows of a mesh that all ranks hold.
inline TetMesh rows_of(const TetMesh& whole) {
    return livetet::rows_of(whole, static_cast<std::size_t>(rank()),
                            static_cast<std::size_t>(rank_count()));
}

/// This rank's rows of a table that all ranks hold.
template <class T>
std::vector<T> table_rows(const std::vector<T>& table) {
    return rows_of_table(std::span(table), static_cast<std::size_t>(rank()),
                         static_cast<std::size_t>(rank_count()));
}

inline MeshSize size_of(const TetMesh& whole) { return {whole.nodes.size(), whole.tets.size()}; }

/// 0 to count - 1.
inline std::vector<std::int32_t> numbers_to(std::size_t count) {
    std::vector<std::int32_t> numbers(count);
    std::iota(numbers.begin(), numbers.end(), 0);
    return numbers;
}

}  // namespace livetet::test
