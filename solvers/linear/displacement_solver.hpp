#pragma once

#include "solvers/linear/earlier_solves.hpp"
#include "solvers/linear/linear_solver.hpp"
#include "solvers/linear/stopping_test.hpp"

namespace livetet {

/// Conjugate gradients for the displacements alone: all that the ways to precondition them share.
/// In the mixed form it is one application of the preconditioner instead, inside of
/// SaddlePointSolver.
class DisplacementSolver : public LinearSolver {
  public:
    /// What the solver is for.
    enum class Role {
        solver,          ///< of the displacement form
        preconditioner,  ///< of K in a SaddlePointSolver; PETSc's options with prefix displacement_
    };
    ~DisplacementSolver() override;

    LinearReport solve(Vec b, Vec b_p, Vec x, Vec x_p, const LinearControls& controls,
                       LinearStart start) override;
    void keep_solve(Vec x) override { earlier_.keep(x, image_.get()); }
    void forget_solves() override { earlier_.clear(); }
    bool apply_factorisation(Mat B, Mat X) override;
    int go_on(Vec b, Vec x) override;
    LevelAssembler& fine() override { return *levels_.front(); }
    int level_count() const override { return static_cast<int>(levels_.size()); }
    std::string name() const override;
    void find_mass() override {
        timed_mass([&] { fine().find_mass(); });
    }

    /// For SaddlePointSolver, role `preconditioner`: renews the operators; how it preconditions;
    /// the Krylov solver whose preconditioner that is; K.
    RenewalExtent renew_operators(const Configuration& at, const OperatorTerms& terms,
                                  RenewalExtent wanted) {
        return renew(at, terms, wanted);
    }
    Mat inner_matrix() const { return matrix(); }
    virtual std::string preconditioner_name() const;
    KSP inner_krylov() const { return krylov_.get(); }

  protected:
    DisplacementSolver(const DistributedHierarchy& mesh, Role role, ThreadTeam& team);

    /// Adds the next coarser level (the finest first), which is taken out of `mesh`. In the mixed
    /// form the finest has pressures and coarse levels hold no volumetric stiffness: lambda = 0,
    /// the same mu.
    void add_level(DistributedHierarchy& mesh, const ElasticModel& model, LevelStorage storage);
    /// To be called at the end of a derived class's construction: makes the Krylov solver, has
    /// `configure` choose the preconditioner, and takes PETSc's options.
    void make_krylov(MPI_Comm comm, ErrorEstimate estimate);
    virtual void configure(PC pc) = 0;
    /// Called before each solve. `has_start`: its right-hand side is the residual that a start from
    /// earlier solves leaves.
    virtual void begin_solve(bool /*has_start*/) {}
    /// Takes another preconditioner, or a positive operator for one that is not, after a solve that
    /// ended for this reason, if there is one that may do better. Returns whether it did.
    virtual bool change_preconditioner(KSPConvergedReason /*reason*/) { return false; }
    /// Whether solves end early where the preconditioner is too poor (role `solver`).
    void watch_convergence(bool watched) {
        if (stopping_) stopping_->watch(watched);
    }
    /// See StoppingTest::watch_curvature (role `solver`).
    void watch_curvature(bool* negative) { stopping_->watch_curvature(negative); }
    /// Whether the preconditioner is of PETSc's type `type`: the user's options may have chosen
    /// another.
    bool preconditions_by(PCType type) const;

    Mat matrix() const override { return levels_.front()->matrix(); }
    KSP outer_krylov() const override { return krylov_.get(); }
    Role role() const { return role_; }
    /// PETSc's prefix of options for what is below krylov_.
    std::string prefix() const { return role_ == Role::solver ? "" : "fieldsplit_displacement_"; }

    template <class Work>
    void timed_mass(Work&& work) {
        const HeapMeter meter(&costs_.mass);
        work();
    }

    ThreadTeam& team_;
    std::vector<std::unique_ptr<LevelAssembler>> levels_;  ///< finest first
    PetscHandle<KSP> krylov_;
    std::unique_ptr<StoppingTest> stopping_;  ///< null in the role `preconditioner`
    EarlierSolves earlier_;
    PetscHandle<Vec> image_;  ///< A x of the last solve that started from earlier ones

  private:
    /// image_ = A x after a solve of A x = b. `is_whole_solve`: the Krylov solver's last run, which
    /// has its residual, was of the present operator.
    void find_image(Vec b, Vec x, bool is_whole_solve);

    Role role_;
};

/// Applies PETSc's options. Throws Error for an unknown solver or preconditioner type.
void take_options(KSP ksp);

}  // namespace livetet
