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

/// The rank that has row `row` of so many; the inverse of row_range.
constexpr std::size_t rank_of_row(std::size_t row, std::size_t rows, std::size_t ranks) {
    std::size_t rank = row * ranks / rows;
    while (row_range(rows, rank, ranks).end <= row) ++rank;
    return rank;
}

}  // namespace livetet
