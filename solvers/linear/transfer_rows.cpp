#include "solvers/linear/transfer_rows.hpp"

namespace livetet {

TransferRows::TransferRows(const PartitionedMesh& fine, const PartitionedMesh& coarse,
                           const BarycentricMap& fine_in_coarse)
    : whole_(fine.ranks == 1 ? &fine_in_coarse : nullptr), columns_(coarse.total) {
    if (whole_) return;
    const std::vector<PetscInt> number_of_node = node_numbers(coarse);
    std::vector<std::int32_t> column_of(coarse.total, -1);
    mine_.emplace();
    for (const std::int32_t n : std::span(fine.nodes).first(fine.owned)) {
        std::array<std::int32_t, 4> row = fine_in_coarse.nodes[n];
        for (std::int32_t& c : row) {
            if (column_of[c] < 0) {
                column_of[c] = static_cast<std::int32_t>(numbers_.size());
                numbers_.push_back(number_of_node[c]);
            }
            c = column_of[c];
        }
        mine_->nodes.push_back(row);
        mine_->weights.push_back(fine_in_coarse.weights[n]);
    }
    columns_ = numbers_.size();
    shared_.emplace(coarse.comm, static_cast<std::size_t>(coarse.owned), numbers_);
}

TransferRows::TransferRows(const PartitionedMesh& coarse, BarycentricMap own)
    : whole_(nullptr),
      mine_(std::move(own)),
      numbers_(coarse.numbers),
      columns_(coarse.nodes.size()) {
    shared_.emplace(coarse.comm, static_cast<std::size_t>(coarse.owned), numbers_);
}

}  // namespace livetet
