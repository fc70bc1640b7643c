#pragma once

#include <memory>
#include <span>
#include <vector>

#include "mesh/hierarchy.hpp"
#include "solvers/elastic_level.hpp"
#include "solvers/float_multigrid.hpp"
#include "solvers/options.hpp"
#include "solvers/pressure_coupling.hpp"
#include "solvers/transfer.hpp"

namespace livetet {

/// What a linear solve came to.
struct [[nodiscard]] LinearReport {
    int iterations = 0;
    double residual = 0;  ///< N, true residual's norm
    bool converged = false;
    const char* reason = "";
};

/// What a body is made of, as far as its operators go.
struct ElasticModel {
    std::span<const Material> materials;
    StrainModel strain = StrainModel::corotated;
    Formulation formulation = Formulation::automatic;
};

/// `automatic` is mixed from a Poisson's ratio of 0.49 on: below, locking costs less than pressures do.
Formulation resolved_formulation(const ElasticModel& model);

/// The tangent operator s K + m M of a body on its finest mesh, and the preconditioned Krylov solver for it: geometric
/// multigrid over the hierarchy (PCMG), BoomerAMG, GAMG, a factorisation, or what PETSc's options say.
///
/// In the mixed form the system is [K B^T; B -C] (see PressureCoupling), solved by FGMRES with a block-triangular
/// preconditioner: one cycle of the above for K, which then holds no volumetric stiffness and stays as easy as a
/// Poisson's ratio of zero, and the lumped pressure mass for the Schur complement. The iterations stay bounded up to
/// nu = 1/2 (Elman, Silvester and Wathen 2014, chapter 4).
class ElasticOperator {
  public:
    /// Collective. The hierarchy must outlive the operator. `parts[l]`: the tets' parts of level l (see share_mesh).
    ElasticOperator(MPI_Comm comm, const MeshHierarchy& hierarchy, std::span<const std::vector<std::int32_t>> parts,
                    const ElasticModel& model, const SolverOptions& options);
    ~ElasticOperator();

    ElasticLevel& fine() { return *levels_.front(); }
    const ElasticLevel& fine() const { return *levels_.front(); }
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

    /// Takes rotations from `u` (ghosts up to date) on the finest level.
    void update_rotations(Vec u) { fine().update_rotations(u); }

    /// Assembles s K + m M on all levels that need it; K at `at`, coarse levels at its mean there.
    void assemble(const ElasticState& at, double s, double m, Tangent tangent);

    bool is_mixed() const { return coupling_ != nullptr; }
    PressureCoupling& coupling() { return *coupling_; }
    const PressureCoupling& coupling() const { return *coupling_; }

    /// A x = b, from the x given (or from zero, where that is nearer); stops at |b - A x| <= relative_tolerance |b|.
    /// Mixed form: b_p the constraint's residual as PressureCoupling::residual gives it, x_p in Pa; else both null.
    LinearReport solve(Vec b, Vec b_p, Vec x, Vec x_p, double relative_tolerance);

  private:
    void make_levels(MPI_Comm comm, const MeshHierarchy& hierarchy, std::span<const std::vector<std::int32_t>> parts,
                     const ElasticModel& model);
    void make_krylov(MPI_Comm comm);
    void make_saddle_krylov(MPI_Comm comm);
    void make_live(const MeshHierarchy& hierarchy, const ElasticModel& model);
    void configure_multigrid(PC pc);
    void assemble_levels(const ElasticState& at, double s, double m, Tangent tangent);
    void apply_saddle_preconditioner(Vec r, Vec y);
    void set_level_operators();
    void set_smoother_bounds();

    SolverOptions options_;
    SolverKind kind_;
    std::vector<std::unique_ptr<ElasticLevel>> levels_;  ///< finest first
    std::vector<std::unique_ptr<Transfer>> transfers_;
    std::vector<PetscHandle<Vec>> displacements_;        ///< of coarse levels, for their rotations
    std::vector<PetscHandle<Mat>> galerkin_;             ///< coarse operators P^T A P
    std::vector<std::vector<std::uint8_t>> components_;  ///< constrained, by level
    std::unique_ptr<FloatMultigrid> live_;
    PetscHandle<Mat> live_matrix_;
    PetscHandle<KSP> krylov_;  ///< for K: by itself, or within the preconditioner of saddle_
    PetscHandle<Vec> work_;
    std::unique_ptr<PressureCoupling> coupling_;  ///< mixed form only, as what follows
    PetscHandle<Mat> b_transposed_, saddle_matrix_;
    PetscHandle<KSP> saddle_;
    PetscHandle<Vec> saddle_work_;
    std::size_t tet_count_;
    bool bounds_known_ = false;
};

}  // namespace livetet
