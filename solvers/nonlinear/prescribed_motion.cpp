#include "solvers/nonlinear/prescribed_motion.hpp"

#include <cmath>
#include <limits>

namespace livetet {

PrescribedMotion::PrescribedMotion(const LevelAssembler& level)
    : level_(level), increment_(level.make_vector()) {}

void PrescribedMotion::find_nodes() {
    const std::int32_t owned = level_.share().owned;
    nodes_.clear();
    at_.assign(owned, -1);
    for (std::int32_t i = 0; i < owned; ++i) {
        if (!level_.constrained()[i]) continue;
        at_[i] = static_cast<std::int32_t>(nodes_.size());
        nodes_.push_back(i);
    }
    values_.assign(nodes_.size(), Vector3::Zero());
    LIVETET_PETSC(VecSet(increment_.get(), 0));
}

void PrescribedMotion::set_values(const Constraints& constraints) {
    for (std::size_t k = 0; k < nodes_.size(); ++k) values_[k] = constraints.values[nodes_[k]];
}

void PrescribedMotion::move(std::span<const std::int32_t> nodes, std::span<const Vector3> values) {
    for (std::size_t k = 0; k < nodes.size(); ++k)
        if (const std::int32_t i = nodes[k]; i < level_.share().owned && at_[i] >= 0)
            values_[at_[i]] = values[k];
}

void PrescribedMotion::find_increment(Vec u) {
    const auto constrained = level_.constrained();
    double largest = 0;
    {
        const ReadArray now(u);
        WriteArray to(increment_.get());
        for (std::size_t k = 0; k < nodes_.size(); ++k)
            for (int c = 0; c < 3; ++c) {
                const std::int32_t i = nodes_[k];
                if (constrained[i] >> c & 1) to[3 * i + c] = values_[k][c] - now[3 * i + c];
                // Infinity, unlike NaN, is the largest on every rank.
                if (const double d = std::abs(to[3 * i + c]); !(d <= largest))
                    largest = std::isnan(d) ? std::numeric_limits<double>::infinity() : d;
            }
    }
    if (const PartitionedMesh& mesh = level_.share(); mesh.ranks > 1)
        MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, mesh.comm);
    increment_size_ = largest;
}

void PrescribedMotion::add_increment(Vec u) const {
    const ReadArray from(increment_.get());
    WriteArray to(u);
    for (const std::int32_t i : nodes_)
        for (int c = 0; c < 3; ++c) to[3 * i + c] += from[3 * i + c];
}

}  // namespace livetet
