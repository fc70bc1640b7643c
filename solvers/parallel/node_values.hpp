#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "base/sort_and_unique.hpp"
#include "mesh/tet_mesh.hpp"
#include "solvers/parallel/shared_rows.hpp"

namespace livetet {

/// The values that the nodes of some tets have, fetched from the ranks in whose rows the nodes are
/// (see HierarchyRows). T: see SharedRows.
template <class T>
class NodeValues {
  public:
    /// `of_rows`: of the nodes of this rank's rows. Collective.
    NodeValues(MPI_Comm comm, const std::vector<T>& of_rows, std::span<const Tet> tets) {
        for (const Tet& t : tets) nodes_.insert(nodes_.end(), t.begin(), t.end());
        sort_and_unique(nodes_);
        values_ = SharedRows(comm, of_rows.size(), nodes_).from_owners(std::span(of_rows));
    }
    /// `node`: one of the tets'.
    const T& operator[](std::int32_t node) const {
        return values_[static_cast<std::size_t>(std::ranges::lower_bound(nodes_, node) -
                                                nodes_.begin())];
    }

  private:
    std::vector<PetscInt> nodes_;  ///< rising
    std::vector<T> values_;
};

}  // namespace livetet
