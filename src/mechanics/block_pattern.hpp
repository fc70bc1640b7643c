#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/lists.hpp"

namespace livetet {

/// Sparsity pattern of a matrix of nodal blocks: a row for each of the first `owned` nodes, in it a
/// block for each node that it shares a tet with. The blocks stand in two arrays, row after row and
/// by rising column: those of owned columns in part 0, the others in part 1, as PETSc keeps a
/// matrix that is spread over ranks.
class BlockPattern {
  public:
    /// `node(e, i)`: node i of tet e, of `per_tet`; below `nodes`.
    template <class NodeOf>
    BlockPattern(std::size_t tets, int per_tet, std::size_t nodes, std::int32_t owned,
                 NodeOf&& node);

    /// Of four-node tets, all nodes owned: part 1 is empty.
    BlockPattern(std::span<const std::array<std::int32_t, 4>> tets, std::size_t nodes)
        : BlockPattern(tets.size(), 4, nodes, static_cast<std::int32_t>(nodes),
                       [&](std::size_t e, int i) { return tets[e][i]; }) {}

    std::int32_t owned() const { return owned_; }
    int part_of(std::int32_t column) const { return column >= owned_; }
    /// The columns of each row in a part, in part 1 less `owned`.
    const Lists& rows(int part) const { return rows_[part]; }
    /// Blocks in a part.
    std::size_t size(int part) const { return rows_[part].items.size(); }

    /// Where the block of an owned row stands in the part of its column. Precondition: it is there.
    std::int32_t place(std::int32_t row, std::int32_t column) const {
        const int part = part_of(column);
        const auto columns = rows_[part][row];
        return rows_[part].start[row] +
               static_cast<std::int32_t>(
                   std::lower_bound(columns.begin(), columns.end(), column - part * owned_) -
                   columns.begin());
    }
    /// The same of nodes i and j of tet e, which are `row` and `column`, without a search.
    std::int32_t place(std::size_t e, int i, int j, std::int32_t row, std::int32_t column) const {
        const std::uint8_t offset = offset_in_row_[(e * per_tet_ + i) * per_tet_ + j];
        return offset < offset_overflow ? rows_[part_of(column)].start[row] + offset
                                        : place(row, column);
    }

    /// Memory of its lists, bytes.
    double bytes() const {
        return static_cast<double>(offset_in_row_.capacity() +
                                   sizeof(std::int32_t) *
                                       (rows_[0].start.capacity() + rows_[0].items.capacity() +
                                        rows_[1].start.capacity() + rows_[1].items.capacity()));
    }

  private:
    static constexpr std::uint8_t offset_overflow = 255;

    std::int32_t owned_;
    std::size_t per_tet_;
    Lists rows_[2];
    /// Of each tet's blocks, row by row: offset in the row, in blocks; 255: search the row. One
    /// byte instead of four saves a twelfth of the level's memory.
    std::vector<std::uint8_t> offset_in_row_;
};

template <class NodeOf>
BlockPattern::BlockPattern(std::size_t tets, int per_tet, std::size_t nodes, std::int32_t owned,
                           NodeOf&& node)
    : owned_(owned), per_tet_(static_cast<std::size_t>(per_tet)) {
    // 1. the tets at each owned node, then row by row the nodes of those
    const Lists at_node = make_lists(owned, [&](auto&& add) {
        for (std::size_t e = 0; e < tets; ++e)
            for (int i = 0; i < per_tet; ++i)
                if (const std::int32_t row = node(e, i); row < owned)
                    add(row, static_cast<std::int32_t>(e));
    });
    std::vector<std::int32_t> row, seen_in(nodes, -1);
    for (Lists& part : rows_) part.start.assign(1, 0);
    for (std::int32_t i = 0; i < owned; ++i) {
        row.clear();
        for (const std::int32_t e : at_node[i])
            for (int j = 0; j < per_tet; ++j)
                if (const std::int32_t n = node(e, j); std::exchange(seen_in[n], i) != i)
                    row.push_back(n);
        std::sort(row.begin(), row.end());
        for (const std::int32_t j : row) rows_[part_of(j)].items.push_back(j - part_of(j) * owned);
        for (Lists& part : rows_)
            part.start.push_back(static_cast<std::int32_t>(part.items.size()));
    }
    for (Lists& part : rows_) part.items.shrink_to_fit();
    // 2. where each tet's blocks stand in them
    offset_in_row_.reserve(tets * per_tet_ * per_tet_);
    for (std::size_t e = 0; e < tets; ++e)
        for (int i = 0; i < per_tet; ++i)
            for (int j = 0; j < per_tet; ++j) {
                const std::int32_t r = node(e, i), c = node(e, j);
                const std::int32_t offset =
                    r < owned ? place(r, c) - rows_[part_of(c)].start[r] : 0;
                offset_in_row_.push_back(
                    static_cast<std::uint8_t>(std::min<std::int32_t>(offset, offset_overflow)));
            }
}

}  // namespace livetet
