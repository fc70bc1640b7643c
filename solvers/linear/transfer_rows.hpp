#pragma once

#include <optional>

#include "mesh/barycentric_map.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"
#include "solvers/parallel/shared_rows.hpp"

namespace livetet {

/// This rank's part of the interpolation between two levels: the rows of the fine nodes that it
/// owns. Their columns are the coarse nodes that they take values from, of this rank and of others.
class TransferRows {
  public:
    /// `fine_in_coarse` places the fine nodes that the rank owns in the whole coarse mesh, by its
    /// nodes' numbers. On one rank it must outlive this; on several a copy is kept. Collective.
    TransferRows(const PartitionedMesh& coarse, const BarycentricMap& fine_in_coarse);
    /// On several ranks, by the coarse share's local nodes. Collective.
    static TransferRows of_local(const PartitionedMesh& coarse, BarycentricMap fine_in_coarse);

    /// Row i is that of the fine share's node i; the nodes in it are columns.
    const BarycentricMap& map() const { return mine_ ? *mine_ : *whole_; }
    std::size_t columns() const { return columns_; }
    /// PETSc's number of the coarse node of a column.
    PetscInt number(std::size_t column) const {
        return numbers_.empty() ? static_cast<PetscInt>(column) : numbers_[column];
    }
    /// Values of the columns from those of each rank's own coarse nodes. Collective.
    template <class T>
    std::vector<T> to_columns(std::span<const T> of_owned) const {
        return shared_ ? shared_->from_owners(of_owned)
                       : std::vector<T>(of_owned.begin(), of_owned.end());
    }
    /// At each rank's own coarse nodes, the sum of what all ranks have in their columns: so many
    /// numbers each. Collective.
    std::vector<double> sum_to_owners(std::vector<double> of_columns, int components) const {
        return shared_ ? shared_->sum_to_owners(of_columns, components) : std::move(of_columns);
    }

  private:
    TransferRows() = default;
    const BarycentricMap* whole_ = nullptr;  ///< on one rank, where columns are the coarse nodes
    std::optional<BarycentricMap> mine_;     ///< on several
    std::optional<SharedRows> shared_;
    std::vector<PetscInt> numbers_;
    std::size_t columns_ = 0;
};

}  // namespace livetet
