#pragma once

#include "solvers/linear/coarse_constraints.hpp"
#include "solvers/linear/displacement_solver.hpp"
#include "solvers/linear/single_precision_multigrid.hpp"

namespace livetet {

/// Conjugate gradients in double precision around a multigrid cycle in single precision, matrix and
/// all, on a team of threads of one rank: what `track` solves with where it can.
class LiveSolver : public DisplacementSolver {
  public:
    /// Throws Error where it cannot take the mesh or the model (see why_not_live).
    LiveSolver(const DistributedHierarchy& mesh, const ElasticModel& model,
               const SolverOptions& options, ThreadTeam& team);

    SolverKind kind() const override { return SolverKind::live; }
    std::string preconditioner_name() const override;
    void set_constrained(std::span<const std::uint8_t> components) override;
    void set_springs(std::span<const double> stiffness) override;
    void find_mass() override;
    double bytes_of_update() const override { return multigrid_->bytes_of_update(); }
    double bytes_of_solve(double iterations) const override {
        return (iterations + max_guesses) * multigrid_->bytes_of_multiply() +
               iterations * multigrid_->bytes_of_cycle();
    }

  private:
    RenewalExtent renew(const Configuration& at, const OperatorTerms& terms,
                        RenewalExtent wanted) override;
    void configure(PC pc) override;
    Mat matrix() const override { return shell_.get(); }
    void make_shell(MPI_Comm comm);

    CoarseConstraints constraints_;
    std::unique_ptr<SinglePrecisionMultigrid> multigrid_;
    PetscHandle<Mat> shell_;
};

}  // namespace livetet
