#pragma once

#include <cstddef>

namespace livetet {

/// The rows `first` to `end` - 1 of a table.
struct RowRange {
    std::size_t first = 0, end = 0;
    std::size_t size() const { return end - first; }
};

/// The rows that rank `rank` of `ranks` reads and writes, of a table of `rows`: consecutive ones,
/// about as many on each rank.
constexpr RowRange row_range(std::size_t rows, std::size_t rank, std::size_t ranks) {
    return {rows * rank / ranks, rows * (rank + 1) / ranks};
}

}  // namespace livetet
