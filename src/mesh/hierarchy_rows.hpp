#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/row_range.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// What one of several ranks holds of a hierarchy before it is partitioned: its consecutive rows
/// (see row_range) of each table. Of each level those are some nodes, some tets with their regions,
/// and some members of each set; of each transfer the rows of its nodes. Numbers in them are those
/// of the whole mesh. All ranks have all levels, transfers and names of sets.
struct HierarchyRows {
    MeshHierarchy rows;
    std::vector<MeshSize> sizes;  ///< of the whole levels
};

/// A rank's items of a table.
template <class T>
std::vector<T> rows_of_table(std::span<const T> table, std::size_t rank, std::size_t ranks) {
    const RowRange range = row_range(table.size(), rank, ranks);
    const auto rows = table.subspan(range.first, range.size());
    return {rows.begin(), rows.end()};
}

/// A rank's rows of a mesh of tets that it holds whole.
TetMesh rows_of(const TetMesh& whole, std::size_t rank, std::size_t ranks);

/// A rank's rows of a hierarchy of such meshes.
HierarchyRows rows_of(const MeshHierarchy& whole, std::size_t rank, std::size_t ranks);

}  // namespace livetet
