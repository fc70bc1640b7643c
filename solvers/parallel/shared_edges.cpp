#include "solvers/parallel/shared_edges.hpp"

#include <algorithm>
#include <utility>

#include "solvers/parallel/row_blocks.hpp"

namespace livetet {

namespace {

/// Sum over the ranks before this one. Collective.
std::int64_t sum_before(MPI_Comm comm, std::int64_t here) {
    std::int64_t end = 0;
    MPI_Scan(&here, &end, 1, MPI_INT64_T, MPI_SUM, comm);
    return end - here;
}

/// For each own node the sum of `counts` over all nodes with lower numbers in the whole mesh.
/// Collective.
std::vector<std::int64_t> sums_below(const PartitionedMesh& share, std::span<const double> counts) {
    const RowBlocks blocks(share.comm, share.total, std::span(share.nodes).first(share.owned));
    std::vector<double> sums = blocks.to_block(counts, 1);
    double here = 0;
    for (double& count : sums) here += std::exchange(count, here);
    const auto before =
        static_cast<double>(sum_before(share.comm, static_cast<std::int64_t>(here)));
    for (double& sum : sums) sum += before;
    const std::vector<double> of_own = blocks.from_block(sums, 1);
    return {of_own.begin(), of_own.end()};  // whole numbers below 2^53
}

}  // namespace

SharedEdges::SharedEdges(const PartitionedMesh& share) : numbers_(share.nodes) {
    const auto below = [&](std::int32_t a, std::int32_t b) { return numbers_[a] < numbers_[b]; };
    local_ = make_lists(share.nodes.size(), [&](auto&& add) {
        for (const Tet& t : share.tets)
            for (const auto& [i, j] : tet_edges)
                if (below(t[i], t[j]))
                    add(static_cast<std::size_t>(t[i]), t[j]);
                else
                    add(static_cast<std::size_t>(t[j]), t[i]);
    });
    sort_and_unique(local_, below);
    owned_ = local_.start[share.owned];
    find_nodes(share);
    find_places(share);
}

void SharedEdges::find_nodes(const PartitionedMesh& share) {
    const std::int64_t first = sum_before(share.comm, owned_);
    total_ = owned_;
    MPI_Allreduce(MPI_IN_PLACE, &total_, 1, MPI_INT64_T, MPI_SUM, share.comm);
    const std::int64_t nodes_end = sum_before(share.comm, share.owned) + share.owned;
    std::vector<double> counts;
    for (std::int32_t n = 0; n < share.owned; ++n)
        counts.push_back(local_.start[n + 1] - local_.start[n]);
    const std::vector<std::int64_t> edges_below = sums_below(share, counts);
    for (std::int32_t n = 0; n < share.owned; ++n)
        nodes_.push_back({edges_below[n], first + local_.start[n],
                          local_.start[n + 1] - local_.start[n], nodes_end, first});
    constexpr int numbers = sizeof(Node) / sizeof(std::int64_t);
    const std::vector<std::int64_t> of_ghosts =
        SharedRows(share.comm, static_cast<std::size_t>(share.owned),
                   std::span(share.numbers).subspan(share.owned))
            .from_owners(std::span(reinterpret_cast<const std::int64_t*>(nodes_.data()),
                                   numbers * nodes_.size()),
                         numbers);
    for (std::size_t i = 0; i < of_ghosts.size(); i += numbers)
        nodes_.push_back(
            {of_ghosts[i], of_ghosts[i + 1], of_ghosts[i + 2], of_ghosts[i + 3], of_ghosts[i + 4]});
}

void SharedEdges::find_places(const PartitionedMesh& share) {
    // A ghost has edges here that are not all of its own: their upper ends come from its rank.
    std::vector<PetscInt> used;
    for (std::size_t n = share.owned; n < share.nodes.size(); ++n)
        if (!local_[n].empty())
            for (std::int64_t k = 0; k < nodes_[n].count; ++k)
                used.push_back(static_cast<PetscInt>(nodes_[n].first_row + k));
    std::vector<std::int32_t> upper;
    for (std::int32_t k = 0; k < owned_; ++k) upper.push_back(numbers_[local_.items[k]]);
    const std::vector<std::int32_t> of_ghosts =
        SharedRows(share.comm, static_cast<std::size_t>(owned_), used)
            .from_owners(std::span<const std::int32_t>(upper));
    auto list = of_ghosts.begin();
    for (std::size_t n = 0; n < share.nodes.size(); ++n) {
        if (static_cast<std::int32_t>(n) < share.owned) {
            for (std::size_t j = 0; j < local_[n].size(); ++j)
                places_.push_back(static_cast<std::int32_t>(j));
            continue;
        }
        if (local_[n].empty()) continue;
        const auto end = list + nodes_[n].count;
        for (const std::int32_t m : local_[n])
            places_.push_back(
                static_cast<std::int32_t>(std::lower_bound(list, end, numbers_[m]) - list));
        list = end;
    }
}

std::int32_t SharedEdges::between(std::int32_t a, std::int32_t b) const {
    if (numbers_[b] < numbers_[a]) std::swap(a, b);
    const auto upper = local_[static_cast<std::size_t>(a)];
    const auto found = std::ranges::lower_bound(upper, numbers_[b], {},
                                                [&](std::int32_t n) { return numbers_[n]; });
    return local_.start[a] + static_cast<std::int32_t>(found - upper.begin());
}

}  // namespace livetet
