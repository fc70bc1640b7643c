#pragma once

#include <span>
#include <vector>

#include "solvers/linear/earlier_solves.hpp"
#include "solvers/linear/live_solver.hpp"

namespace livetet {

/// What live frames of the mixed form have in place of a SaddlePointSolver's blocks: products of
/// the whole operator, in one pass over the tets; the same preconditioner without PETSc's parts of
/// vectors, which would allocate in each frame; and a start from earlier solves.
class LiveSaddlePoint {
  public:
    /// Both must outlive this. `schur`: -S^-1 of pressures, owned by it.
    LiveSaddlePoint(LiveSolver& inner, PressureCoupling& coupling, PetscHandle<KSP> schur);

    /// [K B^T; B -C], of displacements and, behind them, scaled pressures.
    Mat matrix() const { return matrix_.get(); }
    ThreadTeam& team() const { return inner_.team(); }
    /// Its rows of displacements and of pressures.
    UnknownFields fields() const { return {displacement_rows_.get(), pressure_rows_.get()}; }
    /// Makes `pc` the block triangle of SaddlePointSolver.
    void configure(PC pc);

    EarlierSolves& earlier() { return earlier_; }
    /// Finds image(), A x.
    void find_image(Vec x) { LIVETET_PETSC(MatMult(matrix_.get(), x, image_.get())); }
    Vec image() const { return image_.get(); }

    /// Whether products are of a law whose tangent need not be positive.
    bool may_curve_down() const {
        const LevelAssembler& fine = inner_.fine();
        return inner_.takes_law() && !fine.has_hooke_batches() && !fine.is_linear();
    }
    /// Whether the energy's curvature along x, whose image() was found, is negative: then x may
    /// lead uphill. With pressures eliminated it is u K u + (B u) C^-1 (B u), at least
    /// u K u + (q B u)^2 / (q C q) for the pressures q of x (Cauchy and Schwarz).
    bool is_curved_down(std::span<const double> x);
    /// From now to the next renewal, K is Hooke's law turned by each tet, which is positive.
    void take_positive() { inner_.take_positive(); }

  private:
    void multiply(std::span<const double> x, std::span<double> y);
    void precondition(std::span<const double> r, std::span<double> z);
    /// cq_ = - C q.
    void multiply_minus_c(std::span<const double> q);

    LiveSolver& inner_;
    PressureCoupling& coupling_;
    PetscHandle<KSP> schur_;
    std::size_t displacements_;  ///< components; pressures stand behind
    PetscHandle<Mat> matrix_;
    PetscHandle<IS> displacement_rows_, pressure_rows_;
    PetscHandle<Vec> q_, cq_;  ///< pressures of x, and -C times them
    EarlierSolves earlier_;
    PetscHandle<Vec> image_;
    std::vector<double> force_;
};

}  // namespace livetet
