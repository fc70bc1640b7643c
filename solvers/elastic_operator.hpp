#pragma once

#include <memory>
#include <span>
#include <vector>

#include "mesh/hierarchy.hpp"
#include "solvers/elastic_level.hpp"
#include "solvers/options.hpp"
#include "solvers/transfer.hpp"

namespace livetet {

/// What a linear solve came to.
struct [[nodiscard]] LinearReport {
    int iterations = 0;
    double residual = 0;  ///< N, true residual's norm
    bool converged = false;
    const char* reason = "";
};

/// The tangent operator s K + m M of a body on its finest mesh, and the preconditioned Krylov solver for it: geometric
/// multigrid over the hierarchy (PCMG), BoomerAMG, GAMG, a factorisation, or what PETSc's options say.
class ElasticOperator {
  public:
    /// Collective. The hierarchy must outlive the operator. `parts[l]`: the tets' parts of level l (see share_mesh).
    ElasticOperator(MPI_Comm comm, const MeshHierarchy& hierarchy, std::span<const std::vector<std::int32_t>> parts,
                    std::span<const Material> materials, StrainModel strain, const SolverOptions& options);
    ~ElasticOperator();

    ElasticLevel& fine() { return *levels_.front(); }
    const ElasticLevel& fine() const { return *levels_.front(); }
    SolverKind kind() const { return kind_; }
    /// What solves: "cg + multigrid, 3 levels, rediscretised".
    std::string name() const;
    int level_count() const { return static_cast<int>(levels_.size()); }

    /// For every node of the whole finest mesh.
    void set_constrained(std::span<const std::uint8_t> components);

    /// Takes rotations from `u` (ghosts up to date) on the finest level.
    void update_rotations(Vec u) { fine().update_rotations(u); }

    /// Assembles s K + m M on all levels that need it, coarse rotations from `u`.
    void assemble(Vec u, double s, double m);

    /// A x = b, from the x given (or from zero, where that is nearer); stops at |b - A x| <= relative_tolerance |b|.
    LinearReport solve(Vec b, Vec x, double relative_tolerance);

    KSP krylov() const { return krylov_.get(); }

  private:
    void make_levels(MPI_Comm comm, const MeshHierarchy& hierarchy, std::span<const std::vector<std::int32_t>> parts,
                     std::span<const Material> materials, StrainModel strain);
    void make_krylov(MPI_Comm comm);
    void configure_multigrid(PC pc);
    void assemble_levels(Vec u, double s, double m);
    void set_level_operators();
    void set_smoother_bounds();

    SolverOptions options_;
    SolverKind kind_;
    std::vector<std::unique_ptr<ElasticLevel>> levels_;  ///< finest first
    std::vector<std::unique_ptr<Transfer>> transfers_;
    std::vector<PetscHandle<Vec>> displacements_;        ///< of coarse levels, for their rotations
    std::vector<PetscHandle<Mat>> galerkin_;             ///< coarse operators P^T A P
    std::vector<std::vector<std::uint8_t>> components_;  ///< constrained, by level
    PetscHandle<KSP> krylov_;
    PetscHandle<Vec> work_;
    bool bounds_known_ = false;
};

}  // namespace livetet
