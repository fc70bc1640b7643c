#pragma once

#include "solvers/linear/displacement_solver.hpp"
#include "solvers/linear/stopping_test.hpp"

namespace livetet {

class LiveSaddlePoint;
class LiveSolver;

/// The mixed form's solver: FGMRES for [K B^T; B -C] (see PressureCoupling), preconditioned by the
/// block triangle
///     y_p = -S^-1 r_p,  y_u = K^-1 (r_u - B^T y_p),
/// PETSc's PCFIELDSPLIT with its upper Schur factor. S is a weighted pressure mass
/// (PressureCoupling::minus_schur), S^-1 two Chebyshev steps on it (of grids, whose S is
/// diagonal, 8/7 of it: S^-1 itself left up to five times the error in live frames), K^-1 one
/// application of the inner solver's preconditioner. K holds no volumetric stiffness, so that it is
/// as well conditioned as at a Poisson's ratio of zero. Iterations stay bounded up to nu = 1/2
/// (Elman, Silvester and Wathen 2014, chapter 4), but on grids, whose Q1-P0 is not stable, they
/// grow.
///
/// Around a LiveSolver no block but C is a matrix (see LiveSaddlePoint); solves start from earlier
/// increments and keep a deadline, and where the law's tangent has negative curvature along what
/// was found, Hooke's law takes its place.
class SaddlePointSolver : public LinearSolver {
  public:
    /// `inner`: of role `preconditioner`. `team` must outlive this.
    SaddlePointSolver(std::unique_ptr<DisplacementSolver> inner, ThreadTeam& team);
    SaddlePointSolver(std::unique_ptr<LiveSolver> inner, ThreadTeam& team);
    ~SaddlePointSolver() override;

    LevelAssembler& fine() override { return inner_->fine(); }
    SolverKind kind() const override { return inner_->kind(); }
    std::string name() const override;
    int level_count() const override { return inner_->level_count(); }
    void set_constrained(std::span<const std::uint8_t> components) override;
    void set_springs(std::span<const double> stiffness) override;
    void find_mass() override { inner_->find_mass(); }
    LinearReport solve(Vec b, Vec b_p, Vec x, Vec x_p, const LinearControls& controls,
                       LinearStart start) override;
    void keep_solve(Vec x) override;
    void forget_solves() override;
    Mat matrix() const override;
    UnknownFields fields() const override;
    PressureCoupling* coupling() const override { return coupling_.get(); }
    SolverCosts costs() const override;
    /// Of the displacements' part.
    double bytes_of_update() const override;
    double bytes_of_solve(double iterations) const override;

  private:
    /// `live`: `inner`, if it is one.
    SaddlePointSolver(LiveSolver* live, std::unique_ptr<DisplacementSolver> inner,
                      ThreadTeam& team);
    RenewalExtent renew(const Configuration& at, const OperatorTerms& terms,
                        RenewalExtent wanted) override;
    KSP outer_krylov() const override { return krylov_.get(); }
    KSP preconditioned_krylov() const override { return inner_->inner_krylov(); }
    /// The matrix and its fields, where they are PETSc's.
    void make_blocks();
    void make_krylov(MPI_Comm comm);
    /// Has PCFIELDSPLIT apply the inner solver's preconditioner. It can be told only once the
    /// matrix is assembled.
    void connect_inner();

    /// One run of the Krylov solver from x_ = 0; returns its iterations.
    int run(Vec b, const LinearControls& controls, double allowed);
    /// The same around a LiveSolver, of A x = b_. Where Hooke's law takes the place of a tangent,
    /// as many iterations again; returns the number of one run.
    int run_live(const LinearControls& asked, double allowed, LinearStart start);
    /// An estimate of the error of x_, m, RMS over the nodes: its length times the share of the
    /// right-hand side that is left.
    double error_of(double residual, double size);

    std::unique_ptr<DisplacementSolver> inner_;
    std::unique_ptr<PressureCoupling> coupling_;
    PetscHandle<Mat> b_transposed_, matrix_;
    UnknownFields fields_;  ///< owned by matrix_
    PetscHandle<KSP> krylov_;
    PetscHandle<Vec> b_, x_;
    bool is_connected_ = false;
    StoppingTest stopping_;
    std::unique_ptr<LiveSaddlePoint> live_;  ///< null: not around a LiveSolver
};

}  // namespace livetet
