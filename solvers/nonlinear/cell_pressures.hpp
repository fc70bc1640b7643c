#pragma once

#include "solvers/nonlinear/force_balance.hpp"

namespace livetet {

/// Newton's method on the mixed form of a grid of hexahedra, each cell of which eliminates its
/// pressure (LevelAssembler::has_mean_dilation). With r(u, p) the residual at given pressures,
/// K = -dr/du at held p, theta_e the mean over a cell, B = V d theta / du and
///
///     g_e = V_e (theta_e(u) - p_e / lambda_e),
///
/// Newton's equations are K(u, p) du + B^T dp = r and B du - (V / lambda) dp = -g. The second gives
///
///     p + dp = lambda (theta(u) + d theta : du),
///     (K(u, p) + B^T (lambda / V) B) du = r(u, lambda theta(u)).
///
/// So the right-hand side is that of eliminated pressures, but K is taken at the pressures p + a dp
/// that the last step predicted, a being its length. Pressures lambda theta(u) differ from those by
/// terms of order lambda du^2; near a Poisson's ratio of 1/2 they allow only short steps. Magisano,
/// Leonetti and Garcea (2017), Computer Methods in Applied Mechanics and Engineering 313, do the
/// same with the stresses of quadrature points.
///
/// In an iteration, with `pressures` in use:
///
///     {
///         const AtCellPressures at(balance, pressures.get());
///         balance.assemble(...);
///     }
///     ... solve for du ...
///     const auto before = pressures.aim(du);  // the state is where du starts
///     ... the state is at u + a du ...
///     const auto after = pressures.at(a);     // as often as wanted
///     pressures.take(a);
class CellPressures {
  public:
    /// Newton iterations in which they converge, or do not serve: presses take five to nine.
    static constexpr int max_iterations = 15;

    /// `balance` must outlive this. Uses none before begin().
    explicit CellPressures(ForceBalance& balance) : balance_(balance) {}

    /// Begins at the state as it is: p = lambda theta(u). Nothing for bodies that eliminate none,
    /// or whose forces are linear.
    void begin();
    /// Pressures are eliminated from here on.
    void end() { is_used_ = false; }
    /// The pressures, Pa; null: eliminated.
    Vec get() const { return is_used_ ? p_.get() : nullptr; }
    bool are_used() const { return is_used_; }

    /// p = lambda (theta(u) + d theta : du), u the state.
    void step(Vec du);

    /// On the line of (du, dp).
    struct Place {
        double norm = 0;   ///< |r|, N, without g
        double slope = 0;  ///< r . du + g . dp, J: of the monotone operator (see NewtonSolver)
    };
    /// Finds dp of du, at the state where both start. Returns what is there.
    Place aim(Vec du);
    /// At the state, which is at this length of du, and p + length dp. Renews the residual and the
    /// scale of the balance.
    Place at(double length);
    /// p += length dp.
    void take(double length);

  private:
    ForceBalance& balance_;
    bool is_used_ = false;
    Vec du_ = nullptr;  ///< of aim()
    PetscHandle<Vec> p_, dp_, trial_, eliminated_;
};

}  // namespace livetet
