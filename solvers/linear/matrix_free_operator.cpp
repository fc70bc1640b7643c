#include "solvers/linear/matrix_free_operator.hpp"

#include <algorithm>

#include "mechanics/hex_kernels.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

namespace {

/// A third of the trace of each node's diagonal block of Hooke's law,
///     sum_q w_q (lambda + 4 mu) / 3 |grad N_i|^2,
/// which rotations do not change.
template <int nodes>
std::vector<float> diagonal_stiffness(const LevelAssembler& level) {
    using Shape = ElementShape<nodes>;
    const auto owned = static_cast<std::size_t>(level.share().owned);
    std::vector<float> diagonal(owned, 0.0F);
    for (std::size_t e = 0; e < level.share().tets.size(); ++e) {
        const TetElement element = level.operator_element(e);
        const double modulus = (element.lambda + 4 * element.mu) / 3;
        for (int point = 0; point < Shape::points; ++point) {
            const auto g = Shape::gradients(element, point);
            for (int i = 0; i < nodes; ++i)
                if (const auto n = static_cast<std::size_t>(level.share().node(e, i)); n < owned)
                    diagonal[n] += static_cast<float>(element.volume / Shape::points * modulus *
                                                      g.col(i).squaredNorm());
        }
    }
    return diagonal;
}

}  // namespace

MatrixFreeOperator::MatrixFreeOperator(LevelAssembler& level, ThreadTeam& team)
    : level_(level),
      team_(team),
      stiffness_(level.with_batch_shape(
          [&](auto count) { return diagonal_stiffness<decltype(count)::value>(level); })),
      force_(3 * level.share().nodes.size() + 1, 0.0F),
      shift_(3 * stiffness_.size(), 0.0F),
      inverse_diagonal_(shift_.size(), 0.0F),
      free_(shift_.size(), 1.0F) {
    const PartitionedMesh& share = level.share();
    if (share.ranks > 1)
        ghosts_.emplace(share.comm, static_cast<std::size_t>(share.owned),
                        std::span(share.numbers).subspan(share.owned));
}

double MatrixFreeOperator::sum_over_ranks(double of_this_rank) const {
    if (ghosts_) livetet::sum_over_ranks(level_.share().comm, {&of_this_rank, 1});
    return of_this_rank;
}

void MatrixFreeOperator::set_constrained() {
    const auto components = level_.constrained();
    for (std::size_t i = 0; i < free_.size(); ++i)
        free_[i] = components[i / 3] >> (i % 3) & 1 ? 0.0F : 1.0F;
    renew_diagonal();
}

void MatrixFreeOperator::update(const ElementRotations& at, double s, double m) {
    at_ = &at;
    tangent_ = Tangent::exact;
    if (s == s_ && m == m_) return;
    s_ = s;
    m_ = m;
    const auto mass = level_.node_mass(), springs = level_.springs();
    has_shift_ = m != 0 || !springs.empty();
    over_components([&](std::size_t i) {
        const std::size_t n = i / 3;
        shift_[i] =
            static_cast<float>((m != 0 ? m * mass[n] : 0) + (springs.empty() ? 0 : springs[n]));
        inverse_diagonal_[i] =
            free_[i] != 0 ? 1 / (static_cast<float>(s) * stiffness_[n] + shift_[i]) : 0.0F;
    });
}

void MatrixFreeOperator::add_products(Tangent tangent, std::span<float> x) {
    if (ghosts_)
        ghosts_->from_owners(std::span<const float>(x.first(free_.size())),
                             x.subspan(free_.size(), x.size() - 1 - free_.size()), 3);
    team_.run_pieces(force_.size(), grain, [&](std::size_t begin, std::size_t end) {
        std::fill(force_.begin() + static_cast<std::ptrdiff_t>(begin),
                  force_.begin() + static_cast<std::ptrdiff_t>(end), 0.0F);
    });
    level_.add_single_products(static_cast<float>(s_), tangent, *at_, x, force_);
}

void MatrixFreeOperator::multiply(std::span<const double> x, std::span<double> y) {
    x_.resize(force_.size(), 0.0F);
    over_components([&](std::size_t i) { x_[i] = static_cast<float>(x[i]); });
    add_products(tangent_, x_);
    over_components([&](std::size_t i) { y[i] = free_[i] * (force_[i] + shift_[i] * x_[i]); });
}

void MatrixFreeOperator::multiply(std::span<float> x, std::span<float> y) {
    add_products(tangent_, x);
    if (has_shift_)
        over_components([&](std::size_t i) { y[i] = free_[i] * (force_[i] + shift_[i] * x[i]); });
    else
        over_components([&](std::size_t i) { y[i] = free_[i] * force_[i]; });
}

double MatrixFreeOperator::bytes_of_multiply() const {
    const SinglePrecisionBatches& single = *level_.single();
    const auto batches = static_cast<double>(single.batch_count());
    const double tets = std::visit([](const auto& b) { return sizeof(b[0]); }, single.batches);
    // Each number of x, the displacement, forces (zeroed, added to, read), y.
    return batches * tets + static_cast<double>(free_.size()) * (4 + 4 + 12 + 4);
}

}  // namespace livetet
