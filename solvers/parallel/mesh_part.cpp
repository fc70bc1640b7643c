#include "solvers/parallel/mesh_part.hpp"

#include <algorithm>

#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

void MeshPart::sum(std::span<double> values) const {
    if (share_) sum_over_ranks(share_->comm, values);
}

std::size_t MeshPart::count(std::span<const std::int32_t> nodes) const {
    const auto own = std::ranges::count_if(nodes, [&](std::int32_t n) { return n < owned(); });
    return static_cast<std::size_t>(sum(static_cast<double>(own)));
}

}  // namespace livetet
