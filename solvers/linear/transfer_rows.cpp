#include "solvers/linear/transfer_rows.hpp"

#include <algorithm>

#include "base/sort_and_unique.hpp"

namespace livetet {

namespace {

/// The numbers in the whole coarse mesh of the columns, rising, in place of which `rows` then has
/// the columns.
std::vector<std::int32_t> make_columns(BarycentricMap& rows) {
    std::vector<std::int32_t> nodes;
    for (const auto& row : rows.nodes) nodes.insert(nodes.end(), row.begin(), row.end());
    sort_and_unique(nodes);
    for (auto& row : rows.nodes)
        for (std::int32_t& n : row)
            n = static_cast<std::int32_t>(std::ranges::lower_bound(nodes, n) - nodes.begin());
    return nodes;
}

}  // namespace

TransferRows::TransferRows(const PartitionedMesh& coarse, const BarycentricMap& fine_in_coarse)
    : whole_(coarse.ranks == 1 ? &fine_in_coarse : nullptr), columns_(coarse.total) {
    if (whole_) return;
    mine_ = fine_in_coarse;
    numbers_ = petsc_numbers(coarse, make_columns(*mine_));
    columns_ = numbers_.size();
    shared_.emplace(coarse.comm, static_cast<std::size_t>(coarse.owned), numbers_);
}

TransferRows TransferRows::of_local(const PartitionedMesh& coarse, BarycentricMap fine_in_coarse) {
    TransferRows rows;
    rows.mine_ = std::move(fine_in_coarse);
    rows.numbers_ = coarse.numbers;
    rows.columns_ = coarse.nodes.size();
    rows.shared_.emplace(coarse.comm, static_cast<std::size_t>(coarse.owned), rows.numbers_);
    return rows;
}

}  // namespace livetet
