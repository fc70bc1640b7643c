#pragma once

#include <optional>
#include <span>
#include <vector>

#include "base/thread_team.hpp"
#include "solvers/assembly/level_assembler.hpp"

namespace livetet {

/// The operator of a level in single precision without a matrix,
///
///     A = s K(u) + m M + springs,
///
/// with K the tangent of the level's law, or Hooke's law turned by rotations where a positive
/// operator is asked for. Rows and columns of constrained components are zero. On several ranks
/// vectors hold the components of a rank's own nodes and those of its ghosts behind them, which
/// products fetch from their owners. To use it:
///
///     set_constrained();         // when constraints or springs change
///     update(at, s, m);          // when the body has moved
///     multiply(x, y);            // as often as wanted
class MatrixFreeOperator {
  public:
    /// Both must outlive this.
    MatrixFreeOperator(LevelAssembler& level, ThreadTeam& team);

    /// Takes up the level's constrained components, and what it knows of its mass and springs.
    void set_constrained();
    /// Takes up its springs at the next update.
    void renew_diagonal() { s_ = m_ = -1; }
    /// `at` must stay as it is until the next call.
    void update(const ElementRotations& at, double s, double m);
    /// Which K: of the law (Tangent::exact), or Hooke's. An update asks for the law's again.
    void take(Tangent tangent) { tangent_ = tangent; }
    Tangent tangent() const { return tangent_; }

    /// y = A x; x and y zero at constrained components.
    void multiply(std::span<const double> x, std::span<double> y);
    /// The same in single precision; x as in visit_positive.
    void multiply(std::span<float> x, std::span<float> y);

    /// visit(i, (A x)_i) for the components of this rank's own nodes, by pieces of the team, with
    /// Hooke's K; x: three numbers a local node and one behind, zero at constrained components.
    /// Collective, and so is the next.
    template <class Visit>
    void visit_positive(std::span<float> x, Visit&& visit) {
        add_products(Tangent::frozen_rotation, x);
        if (has_shift_)
            over_components([&](std::size_t i) { visit(i, force_[i] + shift_[i] * x[i]); });
        else
            over_components([&](std::size_t i) { visit(i, force_[i]); });
    }

    /// The same of Hooke's stiffness alone, s K x, for any x.
    template <class Visit>
    void visit_stiffness(std::span<float> x, Visit&& visit) {
        add_products(Tangent::frozen_rotation, x);
        over_components([&](std::size_t i) { visit(i, force_[i]); });
    }
    /// The share of s K in a component's diagonal.
    float stiffness_diagonal(std::size_t component) const {
        return static_cast<float>(s_) * stiffness_[component / 3];
    }

    /// work(i) for the components of this rank's own nodes, by pieces of the team.
    template <class Work>
    void over_components(Work&& work) const {
        team_.run_pieces(free_.size(), grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) work(i);
        });
    }

    /// Three divided by the trace of the diagonal block of each component's node, whatever the
    /// rotations; 0 where it is constrained.
    std::span<const float> inverse_diagonal() const { return inverse_diagonal_; }
    /// 0 where a component is constrained, else 1.
    std::span<const float> free() const { return free_; }
    std::size_t components() const { return free_.size(); }  ///< of this rank's own nodes
    /// Numbers in a vector: three a local node, and one behind.
    std::size_t vector_size() const { return force_.size(); }
    /// Collective.
    double sum_over_ranks(double of_this_rank) const;
    /// s, and the diagonal m M + springs of each component.
    double stiffness_factor() const { return s_; }
    std::span<const float> shift() const { return shift_; }

    /// What a product moves at least, bytes.
    double bytes_of_multiply() const;

  private:
    static constexpr std::size_t grain = 450;
    /// force_ = s K x.
    void add_products(Tangent tangent, std::span<float> x);

    LevelAssembler& level_;
    ThreadTeam& team_;
    std::optional<SharedRows> ghosts_;  ///< on several ranks
    const ElementRotations* at_ = nullptr;
    Tangent tangent_ = Tangent::exact;
    double s_ = -1, m_ = -1;        ///< below zero: the diagonal is to be made
    std::vector<float> stiffness_;  ///< a third of the trace of K's diagonal block, N/m, a node
    std::vector<float> x_;          ///< of multiply, from its first call on
    std::vector<float> force_;
    std::vector<float> shift_, inverse_diagonal_, free_;  ///< of each component
    bool has_shift_ = false;                              ///< else all of shift_ is zero
};

}  // namespace livetet
