#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/row_range.hpp"
#include "solvers/parallel/shared_rows.hpp"

namespace livetet {

/// The rows of this rank of `comm`; without a message.
RowRange row_range(MPI_Comm comm, std::size_t rows);

/// Moves values of a whole mesh's nodes or tets between the ranks that own them and the consecutive
/// blocks in which files are read and written (see row_range): no rank holds more than its part and
/// its block. Tables of nodes and tets are the same on any number of ranks.
class RowBlocks {
  public:
    /// `mine`: the numbers, 0 to rows - 1, of what this rank has. Collective.
    RowBlocks(MPI_Comm comm, std::size_t rows, std::span<const std::int32_t> mine);

    RowRange block() const { return block_; }
    /// `components` numbers for each row of this rank's block, from those of what each rank has, in
    /// the order of `mine`. Each row is one rank's alone. Collective.
    std::vector<double> to_block(std::span<const double> of_mine, int components) const {
        return shared_.to_owners(of_mine, components);
    }
    /// And back, of several types (see SharedRows), to all ranks that have a row. Collective.
    template <class T>
    std::vector<T> from_block(std::span<const T> of_block, int components) const {
        return shared_.from_owners(of_block, components);
    }
    std::vector<double> from_block(const std::vector<double>& of_block, int components) const {
        return from_block(std::span(of_block), components);
    }

  private:
    RowRange block_;
    SharedRows shared_;  ///< owned: the rows of the block; used: `mine`
};

}  // namespace livetet
