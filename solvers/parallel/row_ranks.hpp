#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "solvers/parallel/exchange.hpp"
#include "solvers/parallel/row_blocks.hpp"

namespace livetet {

/// Which rank has a row of a table that ranks share (see row_range).
class RowRanks {
  public:
    RowRanks(MPI_Comm comm, std::size_t rows)
        : comm_(comm), rows_(rows), here_(row_range(comm, rows)) {
        int ranks = 1;
        MPI_Comm_size(comm, &ranks);
        ranks_ = static_cast<std::size_t>(ranks);
    }

    std::int32_t operator()(std::int32_t row) const {
        return static_cast<std::int32_t>(rank_of_row(static_cast<std::size_t>(row), rows_, ranks_));
    }
    const RowRange& here() const { return here_; }  ///< this rank's
    /// Place of a row among this rank's.
    std::size_t place(std::int32_t row) const {
        return static_cast<std::size_t>(row) - here_.first;
    }

    /// Sends each item to the rank of row `row_of(item)`. Collective.
    template <class T, class RowOf>
    std::vector<T> send(const std::vector<T>& items, RowOf&& row_of) const {
        std::vector<std::int32_t> to;
        to.reserve(items.size());
        for (const T& item : items) to.push_back((*this)(std::invoke(row_of, item)));
        return exchange(comm_, to, items);
    }

  private:
    MPI_Comm comm_;
    std::size_t rows_, ranks_ = 1;
    RowRange here_;
};

/// Each rank's rows of a table that the first rank holds; it is empty on the others. Collective.
template <class T>
std::vector<T> deal_rows(MPI_Comm comm, const std::vector<T>& table) {
    const RowRanks rank_of(comm, table.size());
    std::vector<std::int32_t> to;
    to.reserve(table.size());
    for (std::size_t row = 0; row < table.size(); ++row)
        to.push_back(rank_of(static_cast<std::int32_t>(row)));
    return exchange(comm, to, table);
}

}  // namespace livetet
