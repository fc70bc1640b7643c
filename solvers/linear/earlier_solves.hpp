#pragma once

#include <Eigen/Core>

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "base/petsc.hpp"
#include "base/thread_team.hpp"
#include "solvers/linear/single_system.hpp"

namespace livetet {

/// Where a linear solve starts in a sequence of them, as from frame to frame: a combination of the
/// last solutions x_i, newest first,
///
///     x_0 = a sum_i c_i x_i,   G c = w,   G_ij = t_i . y_j,   w_i = t_i . b.
///
/// y_j = A_j x_j is what the operator of its own solve made of x_j, so that c takes no product by
/// the present A, however many solutions there are. It is of use as far as A changes little from
/// solve to solve: one product by the present A tells how far to go along the combination, a, and
/// what is left, b - A x_0. From new to old, a solution is left out if newer ones nearly span it,
/// as nearly as A changes: of increments that are almost alike the newest is taken, not the mean of
/// all. With one A for all this is the projection of Fischer (1998, Projection techniques for
/// iterative solution of Ax = b with successive right-hand sides). PETSc's KSPGuess drops its
/// vectors when A changes.
class EarlierSolves {
  public:
    /// How many are kept.
    static constexpr int max_solutions = 6;

    /// energy: t_i = x_i, the least energy norm of the error; G is symmetric, and each entry is
    /// taken by the newer of its two operators. A must be positive. residual: t_i = y_i, the least
    /// |b - A x_0|; for any A, with twice the memory.
    enum class Nearness { energy, residual };
    /// `team` must outlive this.
    EarlierSolves(Nearness nearness, ThreadTeam& team) : nearness_(nearness), team_(team) {}

    void clear() {
        count_ = 0;
        change_ = 0;
        gram_.setIdentity();
    }
    /// Finds start() and rest() for A x = b. Returns whether they are of use; else a solve starts
    /// from zero. Allocates when it is called first. Collective, and so is keep.
    bool find_start(Mat A, Vec b);
    Vec start() const { return start_.get(); }
    Vec rest() const { return rest_.get(); }  ///< b - A start()
    /// The same in single precision on one rank, nearness of energy: `start` is sum_i c_i x_i and
    /// `rest` b - a A start. Returns a; 0 where they are of no use. Vectors as A has them.
    double find_start(SingleSystem& A, Vec b, std::span<float> start, std::span<float> rest);
    /// Keeps a solution and y = A x; forgets all where they are not finite. find_start was called
    /// before.
    void keep(Vec x, Vec y);

  private:
    using Gram = Eigen::Matrix<double, max_solutions, max_solutions>;
    using Numbers = Eigen::Vector<double, max_solutions>;  ///< one a solution, zero behind the last

    void make_room(Vec like);
    /// c; nothing where there is none.
    std::optional<Numbers> combination(Vec b) const;
    /// x = sum_i c_i x_i
    template <class Scalar>
    void combine(const Numbers& c, std::span<Scalar> x) const;
    /// a, from t . b and t . A x of the x with the shares c, t = x or A x; 0 where it is of no use.
    /// Notes how much A has changed.
    double length(const Numbers& c, double along_b, double along_image);
    std::span<const std::vector<float>> tests() const {
        const auto& t = nearness_ == Nearness::energy ? solutions_ : images_;
        return {t.data(), static_cast<std::size_t>(count_)};
    }
    /// t_i . v
    Numbers products_with(Vec v) const;
    /// c, by G = L D L^T.
    Numbers shares(const Numbers& work) const;

    Nearness nearness_;
    ThreadTeam& team_;
    int count_ = 0;
    bool has_room_ = false;
    std::array<std::vector<float>, max_solutions> solutions_, images_;  ///< newest first
    Gram gram_ = Gram::Identity();  ///< the identity behind the last
    /// |q / q_G - 1| of the last combination x: q = x . A x (energy) or |A x|^2, q_G by G.
    double change_ = 0;
    PetscHandle<Vec> start_, rest_;
};

}  // namespace livetet
