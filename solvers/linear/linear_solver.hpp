#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/thread_team.hpp"
#include "mesh/hierarchy.hpp"
#include "solvers/assembly/level_assembler.hpp"
#include "solvers/assembly/phase_timer.hpp"
#include "solvers/assembly/pressure_coupling.hpp"
#include "solvers/linear/single_precision_multigrid.hpp"
#include "solvers/linear/solver_options.hpp"
#include "solvers/linear/transfer.hpp"

namespace livetet {

using Clock = std::chrono::steady_clock;

/// How far a linear solve goes: to |b - A x| <= relative_tolerance |b|, but not beyond
/// `max_iterations`, nor, after its first iteration, past the deadline (it stops where half as much
/// again as the last iteration took would end later).
struct LinearControls {
    double relative_tolerance = 1e-3;
    int max_iterations = 200;
    std::optional<Clock::time_point> deadline{};
};

/// What a linear solve came to.
struct [[nodiscard]] LinearReport {
    int iterations = 0;
    double residual = 0;     ///< N, true residual's norm
    bool converged = false;  ///< the tolerance was met
    bool cut_short =
        false;  ///< the deadline or the number of iterations came first; x is as far as it went
    double error = 0;  ///< of x, m, RMS over the nodes, estimated from the iterations' steps; live
                       ///< only, else 0
    const char* reason = "";
};

/// Of an operator's parts; where it renews several levels at once, `matrix` has the time of all.
struct SolverCosts {
    PhaseCost elements, rotations, matrix, coarse_levels, mass, pressures, preconditioner;
};

/// What a body is made of, as far as its operators go.
struct ElasticModel {
    std::span<const Material> materials;
    StrainModel strain = StrainModel::corotated;
    Formulation formulation = Formulation::automatic;
};

/// `automatic` is mixed from a Poisson's ratio of 0.49 on: below, locking costs less than pressures
/// do.
Formulation resolved_formulation(const ElasticModel& model);

/// The tangent operator s K + m M of a body on its finest mesh, and the preconditioned Krylov
/// solver for it: geometric multigrid over the hierarchy (PCMG), BoomerAMG, GAMG, a factorisation,
/// or what PETSc's options say.
///
/// In the mixed form the system is [K B^T; B -C] (see PressureCoupling), solved by FGMRES with a
/// block-triangular preconditioner: one cycle of the above for K, which then holds no volumetric
/// stiffness and stays as easy as a Poisson's ratio of zero, and the lumped pressure mass for the
/// Schur complement. The iterations stay bounded up to nu = 1/2 (Elman, Silvester and Wathen 2014,
/// chapter 4).
class LinearSolver {
  public:
    /// Collective. The hierarchy must outlive the operator. `parts[l]`: the tets' parts of level l
    /// (see distribute_mesh).
    LinearSolver(MPI_Comm comm, const MeshHierarchy& hierarchy,
                 std::span<const std::vector<std::int32_t>> parts, const ElasticModel& model,
                 const SolverOptions& options, ThreadTeam& team = ThreadTeam::alone());
    ~LinearSolver();

    LevelAssembler& fine() { return *levels_.front(); }
    const LevelAssembler& fine() const { return *levels_.front(); }
    SolverKind kind() const { return kind_; }
    /// What solves: "cg + multigrid, 3 levels, rediscretised".
    std::string name() const;
    int level_count() const { return static_cast<int>(levels_.size()); }
    /// Of the whole finest mesh.
    std::size_t tet_count() const { return tet_count_; }

    /// For every node of the whole finest mesh.
    void set_constrained(std::span<const std::uint8_t> components);

    /// Springs to ground, N/m, for every node of the whole finest mesh; empty: none.
    void set_springs(std::span<const double> stiffness);

    /// Lumped mass on all levels that need it; without it `assemble` takes m = 0.
    void find_mass();

    /// Takes rotations from `u` (ghosts up to date) on the finest level.
    void update_rotations(Vec u);

    /// Assembles s K + m M on all levels that need it; K at `at`, where the rotations were taken
    /// last, coarse levels at its mean there. `by_halves`: a live finest level may renew one half
    /// now and the other the next time; returns whether it did. Small strain's is the same at any
    /// `at`: kept while s, m, constraints and springs are, and with it what the preconditioner was
    /// computed to.
    bool assemble(const Configuration& at, double s, double m, Tangent tangent,
                  bool by_halves = false);

    /// What the preconditioner computes from the operators before it can be applied; nothing where
    /// it has done so already.
    void set_up_preconditioner();

    /// What the parts took on this rank so far, and how often.
    const SolverCosts& costs() const { return costs_; }

    bool is_mixed() const { return coupling_ != nullptr; }
    PressureCoupling& coupling() { return *coupling_; }
    const PressureCoupling& coupling() const { return *coupling_; }

    /// A x = b. Displacement form: from the combination of `guesses` (zero at constrained
    /// components; at most `max_guesses`, of no use to the mixed form) that is nearest to x in
    /// energy. Mixed form: b_p the constraint's residual as PressureCoupling::residual gives it,
    /// x_p in Pa; else both null.
    LinearReport solve(Vec b, Vec b_p, Vec x, Vec x_p, const LinearControls& effort,
                       std::span<const Vec> guesses = {});
    static constexpr int max_guesses = 2;

    /// Bytes that the live solver's operators, and a solve of so many iterations from two guesses,
    /// have to move at least; 0 for the others.
    double bytes_of_update() const { return live_ ? live_->bytes_of_update() : 0; }
    double bytes_of_solve(double iterations) const {
        return live_ ? (iterations + max_guesses) * live_->bytes_of_multiply() +
                           iterations * live_->bytes_of_cycle()
                     : 0;
    }

  private:
    void make_levels(MPI_Comm comm, const MeshHierarchy& hierarchy,
                     std::span<const std::vector<std::int32_t>> parts, const ElasticModel& model);
    /// What the options of the outermost KSP say about when it stops.
    void read_asked_tolerances();
    void make_krylov(MPI_Comm comm);
    void make_saddle_krylov(MPI_Comm comm);
    void make_live(const MeshHierarchy& hierarchy, const ElasticModel& model);
    /// Level l and those below it: a cycle whose coarse equation is solved by cycles_below cycles
    /// of the next level, accelerated by Chebyshev's polynomial, for a coarse mesh that is too soft
    /// or too stiff somewhere would have a plain W-cycle diverge. A fixed polynomial, so that
    /// conjugate gradients stay exact.
    void configure_multigrid(PC pc, std::size_t l);
    static constexpr int cycles_below = 2;
    /// Whether multigrid is what preconditions: the user's options may have chosen another.
    bool cycles() const;
    void assemble_levels(const Configuration& at, double s, double m, Tangent tangent);
    void apply_saddle_preconditioner(Vec r, Vec y);
    void set_level_operators();
    /// Chebyshev's intervals from the largest eigenvalues; false where one could not be had and
    /// stands at a usual value.
    bool set_bounds();
    Mat displacement_matrix() { return live_ ? live_matrix_.get() : fine().matrix(); }
    /// start_ = the best combination x of guesses, rest_ = b - A x. True where x is not zero.
    bool start_from(std::span<const Vec> guesses, Vec b);
    /// What PETSc asks after each iteration of the displacement form's solve.
    struct Stopping;

    SolverOptions options_;
    ThreadTeam& team_;
    SolverKind kind_;
    CoarseOperator coarse_;
    int smoothing_steps_;
    std::vector<std::unique_ptr<LevelAssembler>> levels_;  ///< finest first
    std::vector<std::unique_ptr<Transfer>> transfers_;
    std::vector<PetscHandle<Vec>> displacements_;        ///< of coarse levels, for their rotations
    std::vector<PetscHandle<Mat>> galerkin_;             ///< coarse operators P^T A P
    std::vector<CoarseBody> coarse_bodies_;              ///< by level from the second
    std::vector<std::vector<std::uint8_t>> components_;  ///< constrained, by level
    std::unique_ptr<SinglePrecisionMultigrid> live_;
    PetscHandle<Mat> live_matrix_;
    PetscHandle<KSP> krylov_;  ///< for K: by itself, or within the preconditioner of saddle_
    std::vector<KSP> smoothers_, coarse_solves_;  ///< of krylov_, from the finest level down
    std::unique_ptr<Stopping> stopping_;
    PetscHandle<Vec> rest_, start_;  ///< with guesses: what is left of b, and x, before Krylov
    PetscHandle<Vec> images_[max_guesses];        ///< A times the guesses
    std::unique_ptr<PressureCoupling> coupling_;  ///< mixed form only, as what follows
    PetscHandle<Mat> b_transposed_, saddle_matrix_;
    PetscHandle<KSP> saddle_;
    PetscHandle<Vec> saddle_work_;
    std::size_t tet_count_;
    bool bounds_known_ = false;
    std::optional<std::pair<double, double>>
        kept_;             ///< s and m of small strain's operator, where it still is that
    bool is_new_ = false;  ///< assembled since the preconditioner was set up last
    SolverCosts costs_;
    std::optional<double> asked_tolerance_;
    std::optional<int> asked_iterations_;
    double asked_residual_ = 1e-50;  ///< N
};

}  // namespace livetet
