#pragma once

#include "solvers/assembly/matrix_free_coupling.hpp"
#include "solvers/linear/coarse_constraints.hpp"
#include "solvers/linear/conjugate_gradients.hpp"
#include "solvers/linear/displacement_solver.hpp"
#include "solvers/linear/grid_cycle.hpp"
#include "solvers/linear/matrix_free_operator.hpp"
#include "solvers/linear/quadratic_cycle.hpp"
#include "solvers/linear/single_precision_multigrid.hpp"

namespace livetet {

/// Conjugate gradients around a multigrid cycle in single precision, matrix and all, on a team of
/// threads of one rank: what `track` solves with where it can. The iteration is our own
/// (ConjugateGradients), unless PETSc's options ask for another: then PETSc iterates, in double
/// precision.
///
/// For tets of four nodes and Hooke's law, the finest operator is the multigrid's. For other laws
/// it is the law's tangent, without a matrix, and the multigrid is that of Hooke's law turned by
/// the rotation of each tet; where the tangent is not positive, solves go on with Hooke's law in
/// its place. Tets of ten nodes have a QuadraticCycle around that of the same tets with four, and
/// a grid of hexahedra a GridCycle; neither has a matrix on its finest level.
///
/// In the mixed form (role `preconditioner`) it is the cycle alone, and multiply_mixed the product
/// of the whole operator; SaddlePointSolver has the rest.
class LiveSolver : public DisplacementSolver, private SingleSystem {
  public:
    /// Throws Error where it cannot take the mesh or the model (see why_not_live).
    LiveSolver(DistributedHierarchy mesh, const ElasticModel& model, const SolverOptions& options,
               Role role, ThreadTeam& team);

    LinearReport solve(Vec b, Vec b_p, Vec x, Vec x_p, const LinearControls& controls,
                       LinearStart start) override;
    SolverKind kind() const override { return SolverKind::live; }
    std::string preconditioner_name() const override;
    void set_constrained(std::span<const std::uint8_t> components) override;
    void set_springs(std::span<const double> stiffness) override;
    void find_mass() override;
    double bytes_of_update() const override { return cycle_->bytes_of_update(); }
    double bytes_of_solve(double iterations) const override;

    /// The frame's operator and its preconditioner, on the displacements' components.
    void multiply(std::span<const double> x, std::span<double> y);
    void cycle(std::span<const double> r, std::span<double> z) { cycle_->cycle(r, z); }
    void begin_solve(bool has_start) override { cycle_->begin_solve(has_start); }
    void apply(std::span<float> x, std::span<float> y) override;
    void precondition(std::span<const float> r, std::span<float> z) override {
        cycle_->cycle(r, z);
    }
    /// {y, g} = [K B^T; B 0] {x, q}, K with mass and springs; see MatrixFreeCoupling.
    void multiply_mixed(MatrixFreeCoupling& coupling, std::span<const double> x,
                        std::span<const double> q, std::span<double> y, std::span<double> g);

    /// Products take Hooke's K until the next renewal.
    void take_positive() {
        if (fine_) fine_->take(Tangent::frozen_rotation);
    }
    ThreadTeam& team() const { return team_; }
    bool takes_law() const { return fine_ && fine_->tangent() == Tangent::exact; }

  private:
    RenewalExtent renew(const Configuration& at, const OperatorTerms& terms,
                        RenewalExtent wanted) override;
    void configure(PC pc) override;
    bool change_preconditioner(KSPConvergedReason reason) override;
    Mat matrix() const override { return shell_.get(); }
    void add_levels(DistributedHierarchy& mesh, const ElasticModel& model);
    void make_cycle(const MeshHierarchy& hierarchy, int smoothing_steps);
    /// Whether PETSc's options leave the iteration and the preconditioner to this class. Those that
    /// do not change it are heeded by both: tolerances, monitors, -ksp_view.
    bool iterates_itself() const;

    GridHierarchy grid_;  ///< empty unless the body is a grid
    std::optional<CoarseConstraints> constraints_;
    std::unique_ptr<MatrixFreeOperator> fine_;  ///< null: the matrix of `assembled_`
    std::unique_ptr<LiveCycle> cycle_;
    /// The cycle where its finest level is the body's and has a matrix, that of Hooke's law.
    SinglePrecisionMultigrid* assembled_ = nullptr;
    PetscHandle<Mat> shell_;
    std::unique_ptr<ConjugateGradients> gradients_;  ///< null: PETSc iterates
    bool is_viewed_ = false;                         ///< -ksp_view
    std::vector<double> positive_;                   ///< mixed form: Hooke's products
    bool is_curved_down_ = false;  ///< a product of the law's tangent showed negative curvature
};

}  // namespace livetet
