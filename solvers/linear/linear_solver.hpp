#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/deadline.hpp"
#include "base/thread_team.hpp"
#include "solvers/assembly/level_assembler.hpp"
#include "solvers/assembly/phase_timer.hpp"
#include "solvers/assembly/pressure_coupling.hpp"
#include "solvers/linear/distributed_hierarchy.hpp"
#include "solvers/linear/solver_options.hpp"

namespace livetet {

/// When a linear solve ends: at |b - A x| <= relative_tolerance |b|; after `max_iterations`; or,
/// after its first iteration, where 1.5 times the last iteration's time would pass the deadline.
struct LinearControls {
    double relative_tolerance = 1e-3;
    int max_iterations = 200;
    std::optional<Deadline> deadline{};
    /// With pressures: a residual, N, that is small enough whatever the relative tolerance; at most
    /// half of the right-hand side counts.
    double enough = 0;
};

/// Where a linear solve starts: from zero, or from a combination of the solves that were kept.
enum class LinearStart { zero, earlier_solves };

/// Result of a linear solve.
struct [[nodiscard]] LinearReport {
    int iterations = 0;
    double residual = 0;     ///< norm of the true residual, N
    bool converged = false;  ///< the tolerance was met
    bool cut_short = false;  ///< the deadline or the iterations allowed came first; x is usable
    double error = 0;        ///< of x, m, RMS over the nodes, estimated; live solver only
    const char* reason = "";
};

/// Time, memory and count of the parts of a linear solver on this rank. Where several levels are
/// renewed at once, `matrix` has the time of all.
struct SolverCosts {
    PhaseCost elements, rotations, matrix, coarse_levels, mass, pressures, preconditioner;
};

/// What a body is made of, as far as its linear solver is concerned. Bodies copy the materials.
struct ElasticModel {
    std::span<const Material> materials;
    ModelChoice strain = "corotated";  ///< of the materials that name no model
    Formulation formulation = Formulation::automatic;
    /// Whether patches move from frame to frame on a mesh that is graded at them.
    bool has_graded_patches = false;
};

/// A formulation that is not `automatic`, and why it is taken.
struct ChosenFormulation {
    Formulation formulation;
    std::string reason;
};
/// `automatic` means mixed from a Poisson's ratio of 0.49 on: below, locking costs less than
/// pressures do. It means mixed, too, for models whose tangent is not bounded with graded patches:
/// there a frame moves a patch by much of an edge at its rim, tets invert, and displacements alone
/// do not end that.
ChosenFormulation choose_formulation(const ElasticModel& model);
inline Formulation resolved_formulation(const ElasticModel& model) {
    return choose_formulation(model).formulation;
}

/// Rows of a matrix in the mixed form; null in the displacement form.
struct UnknownFields {
    IS displacement = nullptr, pressure = nullptr;
};

/// The tangent operator A of a body on its finest mesh (see OperatorTerms), and a preconditioned
/// Krylov solver for it. One class for each way to solve: MultigridSolver, AlgebraicSolver,
/// LiveSolver, and SaddlePointSolver, which has one of them inside. To use it:
///
///     solver.set_constrained(...);                            // these three when they change
///     solver.set_springs(...);
///     solver.find_mass();
///     solver.update_rotations(u, rotations);
///     solver.assemble({u, p, &rotations}, terms);
///     solver.solve(b, ...);                                   // as often as wanted
class LinearSolver {
  public:
    virtual ~LinearSolver() = default;
    LinearSolver(const LinearSolver&) = delete;
    LinearSolver& operator=(const LinearSolver&) = delete;

    virtual LevelAssembler& fine() = 0;
    const LevelAssembler& fine() const { return const_cast<LinearSolver*>(this)->fine(); }
    virtual SolverKind kind() const = 0;
    /// For reports: "cg + multigrid, 3 levels, rediscretised".
    virtual std::string name() const = 0;
    virtual int level_count() const = 0;
    /// Number of tets of the whole finest mesh.
    std::size_t tet_count() const { return tet_count_; }

    /// Constrained components (bits 0 to 2) of this rank's own nodes of the finest mesh, which come
    /// first. Collective, and so is the next.
    virtual void set_constrained(std::span<const std::uint8_t> components) = 0;
    /// Springs to ground, N/m, of the same nodes; empty on all ranks: none.
    virtual void set_springs(std::span<const double> stiffness) = 0;
    /// Lumped mass on all levels that need it; without it `assemble` takes m = 0.
    virtual void find_mass() = 0;

    /// Takes the finest level's rotations from `u` (ghosts up to date).
    void update_rotations(Vec u, ElementRotations& rotations);

    /// Assembles A on all levels that need it, K at `at`; coarse levels at its restriction, with
    /// K_d taken to be K. For small strain, operator and preconditioner are reused until factors,
    /// constraints or springs change; else `at` must stay as it is while the operator is used.
    void assemble(const Configuration& at, const OperatorTerms& terms) {
        (void)assemble(at, terms, RenewalExtent::whole);
    }
    /// The same; if `wanted` is half, LiveSolver may renew one half of the finest level now and the
    /// other half next time. Returns what was renewed.
    RenewalExtent assemble(const Configuration& at, const OperatorTerms& terms,
                           RenewalExtent wanted);

    /// What the preconditioner computes from the operators before it can be applied; nothing where
    /// it has done so already.
    void set_up_preconditioner();

    /// Solves A x = b. Displacement form: earlier solves are combined by energy; b_p and x_p are
    /// null. Mixed form: b_p is the constraint's residual as PressureCoupling::residual gives it,
    /// x_p in Pa; live solves combine earlier ones by residual, others start from zero.
    virtual LinearReport solve(Vec b, Vec b_p, Vec x, Vec x_p, const LinearControls& controls,
                               LinearStart start = LinearStart::zero) = 0;
    /// Keeps the last solve, which had LinearStart::earlier_solves and whose x (the displacements')
    /// is as it left it: its solution was taken. Collective.
    virtual void keep_solve(Vec x) = 0;
    /// Drops what was kept, to be called where the state jumps; new constraints and springs do.
    virtual void forget_solves() = 0;

    /// X = A^-1 B for the columns of dense matrices, up to rounding, if the preconditioner is a
    /// factorisation of A: all columns go through its triangles at once, which takes a fraction of
    /// the time of one after the other. Else returns false and leaves X as it is. Displacement
    /// form.
    virtual bool apply_factorisation(Mat /*B*/, Mat /*X*/) { return false; }

    /// After `krylov()` was run from outside, on A x = b: if its preconditioner was too poor and
    /// the solver has another, goes on from x with that, and keeps it. Returns the iterations that
    /// this took. `solve` does so by itself.
    virtual int go_on(Vec /*b*/, Vec /*x*/) { return 0; }

    /// The outermost Krylov solver, for SNES, set to stop as `controls` say (without a deadline).
    KSP krylov(const LinearControls& controls);
    /// A, as the Krylov solver applies it: of displacements, or in the mixed form of each rank's
    /// displacements and then its scaled pressures (see PressureCoupling::scale, UnknownParts).
    virtual Mat matrix() const = 0;
    virtual UnknownFields fields() const { return {}; }

    bool is_mixed() const { return coupling() != nullptr; }
    /// Null in the displacement form.
    virtual PressureCoupling* coupling() const { return nullptr; }

    virtual SolverCosts costs() const { return costs_; }

    /// Bytes that renewing the operators, and a solve of so many iterations from earlier ones, move
    /// at least; 0 from solvers that do not count them.
    virtual double bytes_of_update() const { return 0; }
    virtual double bytes_of_solve(double /*iterations*/) const { return 0; }

  protected:
    explicit LinearSolver(std::size_t tet_count) : tet_count_(tet_count) {}

    /// Renews the operators; see assemble.
    virtual RenewalExtent renew(const Configuration& at, const OperatorTerms& terms,
                                RenewalExtent wanted) = 0;
    virtual KSP outer_krylov() const = 0;
    /// The Krylov solver whose preconditioner has something to set up.
    virtual KSP preconditioned_krylov() const { return outer_krylov(); }
    /// Constraints or springs are new: forgets earlier solves, and small strain's operator.
    void invalidate() {
        kept_.reset();
        forget_solves();
    }
    /// The preconditioner has something to set up: it is another one.
    void renew_preconditioner() { is_new_ = true; }
    /// Reads the user's PETSc options that say when the outermost Krylov solver stops: they take
    /// precedence over what a solve asks for.
    void read_user_tolerances();
    /// Sets tolerance and iterations; returns them as they count.
    LinearControls set_tolerances(const LinearControls& controls);
    static void finish_report(KSP ksp, LinearReport& report);
    static void finish_report(KSPConvergedReason reason, LinearReport& report);

    SolverCosts costs_;
    double user_residual_ = 1e-50;  ///< N

  private:
    std::size_t tet_count_;
    /// Factors of K and M in a small-strain operator that is kept.
    std::optional<std::pair<double, double>> kept_;
    bool is_new_ = false;  ///< assembled since the preconditioner was set up last
    std::optional<double> user_tolerance_;
    std::optional<int> user_iterations_;
};

/// The solver that `options` name for this mesh and model. Collective. `team` serves LiveSolver and
/// must outlive it. Throws Error where the kind cannot solve this model on this mesh.
std::unique_ptr<LinearSolver> make_linear_solver(DistributedHierarchy mesh,
                                                 const ElasticModel& model,
                                                 const SolverOptions& options,
                                                 ThreadTeam& team = ThreadTeam::alone());

}  // namespace livetet
