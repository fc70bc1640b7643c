#pragma once

#include "config/fields.hpp"
#include "solvers/parallel/partitioner.hpp"

namespace livetet {

/// Krylov method and preconditioner of the linear systems. `live` is the solver of `livetet track`,
/// made for frames; why_not_live() says what a body lacks for it. `automatic` never means it in a
/// DeformableBody.
enum class SolverKind { automatic, multigrid, live, boomeramg, gamg, direct, petsc };
/// How multigrid makes the operators of its coarse levels.
enum class CoarseOperator { automatic, galerkin, rediscretised };
/// What multigrid keeps of its finest level: a matrix, or only what it is made of where that can be
/// computed with (see MultigridSolver).
enum class FinestOperator { automatic, assembled };
/// Tangent of a Newton iteration.
enum class TangentChoice { automatic, frozen_rotation, exact };

/// What `automatic` means for a mesh of so many levels. On one level it stays `automatic`: an
/// AlgebraicSolver decides by its first matrix.
inline SolverKind resolved_kind(SolverKind kind, std::size_t levels) {
    return kind == SolverKind::automatic && levels > 1 ? SolverKind::multigrid : kind;
}

/// What `automatic` means where Young's moduli are so many times apart: beyond this a
/// re-discretised coarse mesh, which does not know which part of a tet is stiff, costs more
/// iterations than it saves in being renewed.
inline CoarseOperator resolved_coarse(CoarseOperator coarse, double contrast) {
    constexpr double max_contrast = 100;
    if (coarse == CoarseOperator::automatic)
        return contrast > max_contrast ? CoarseOperator::galerkin : CoarseOperator::rediscretised;
    return coarse;
}

/// How the linear systems of a step, and the step itself, are solved. Some fields are of a scene
/// only: a DeformableBody takes them from SolveControls and FrameControls.
struct SolverOptions {
    SolverKind kind = SolverKind::automatic;
    CoarseOperator coarse = CoarseOperator::automatic;
    FinestOperator finest = FinestOperator::automatic;
    int smoothing_steps = 0;
    int threads = 0;
    double relative_tolerance = 1e-3;  ///< of a scene: a body's is ...Controls::linear_tolerance
    int max_iterations = 200;
    double newton_tolerance = 1e-8;        ///< of a scene: a body's is SolveControls::tolerance
    int max_newton = 50;                   ///< of a scene: a body's is SolveControls::max_newton
    std::optional<double> time_limit_s{};  ///< of a scene: see SolveControls::is_time_up
    TangentChoice tangent = TangentChoice::automatic;
    Partitioner partitioner = Partitioner::automatic;  ///< of a scene: see partition_levels
    std::string petsc_options{};  ///< of a scene: see PetscSession::add_options
};

template <class Visitor>
void visit_fields(Visitor& v, SolverOptions& s) {
    v.choice(
        "kind", s.kind, "conjugate gradients preconditioned by ...",
        {{SolverKind::automatic, "automatic",
          "multigrid where the mesh has levels, replaced in the first solve where they do not fit "
          "the body (by a factorisation if affordable, Galerkin operators, or aggregation); else "
          "direct where an analysis of the first matrix says that it is as quick as gamg, and "
          "gamg elsewhere; `track`: live where it can"},
         {SolverKind::multigrid, "multigrid", "geometric multigrid over the mesh hierarchy (PCMG)"},
         {SolverKind::live, "live",
          "the same cycle in single precision on kernels of our own: one rank; what "
          "`track` takes where it can"},
         {SolverKind::boomeramg, "boomeramg", "hypre's algebraic multigrid"},
         {SolverKind::gamg, "gamg", "PETSc's smoothed aggregation with rigid-body modes"},
         {SolverKind::direct, "direct", "sparse L D L^T factorisation (MUMPS)"},
         {SolverKind::petsc, "petsc", "whatever petsc_options or the command line say"}});
    v.choice(
        "coarse", s.coarse, "multigrid's coarse operators",
        {{CoarseOperator::automatic, "automatic",
          "galerkin where Young's moduli are more than 100 times apart, else rediscretised until "
          "the first solve shows that these levels do not fit the body"},
         {CoarseOperator::rediscretised, "rediscretised",
          "assembled on each coarse mesh with its own rotations: cheap to renew"},
         {CoarseOperator::galerkin, "galerkin", "P^T A P: fewer iterations, expensive to renew"}});
    v.choice("finest", s.finest, "multigrid's operator on the finest level",
             {{FinestOperator::automatic, "automatic",
               "without a matrix where its elements are linear or corotated tets by displacements "
               "and coarse operators are rediscretised: less memory; else assembled"},
              {FinestOperator::assembled, "assembled", "a matrix"}});
    v.field("smoothing_steps", s.smoothing_steps, "",
            "Chebyshev steps before and after coarse corrections; 0: 1 live, 4 without a "
            "matrix, else 6",
            at_least<0, int>());
    v.field("threads", s.threads, "",
            "threads of the live solver; 0: one per core, at most 4 and at most one per 500 nodes. "
            "Other solvers use one thread per rank",
            at_least<0, int>());
    v.field("relative_tolerance", s.relative_tolerance, "",
            "of each linear solve: residual relative to the right-hand side. One that can end a "
            "step of `solve` aims at half of what newton_tolerance allows, between a tenth "
            "of this and 0.1",
            within({0, 1, Ends::excluded}));
    v.field("max_iterations", s.max_iterations, "", "of each linear solve", at_least<1, int>());
    v.field("newton_tolerance", s.newton_tolerance, "",
            "of `solve`: force out of balance relative to the forces at work",
            within({0, 1, Ends::excluded}));
    v.field("max_newton", s.max_newton, "",
            "Newton iterations that a step of `solve` may take; on grids in the mixed form the "
            "first 15 do not count",
            at_least<1, int>());
    v.field("time_limit_s", s.time_limit_s, "s",
            "of `solve`, and of each solve of a study: wall-clock time after which no Newton "
            "iteration begins, and the run ends with the last equilibrium; default: none",
            greater_than<0>());
    v.choice(
        "tangent", s.tangent, "which derivative of the forces a Newton iteration takes",
        {{TangentChoice::automatic, "automatic",
          "exact in `solve` and `study`, frozen rotations in `track`"},
         {TangentChoice::frozen_rotation, "frozen-rotation",
          "R K R^T with R frozen: cheap, always positive; the other models take their positive "
          "part"},
         {TangentChoice::frozen_rotation, "held-rotation", "the same: its name before 0.2"},
         {TangentChoice::exact, "exact",
          "with the rotation's derivative; its positive part wherever the whole is not positive"}});
    v.choice("partitioner", s.partitioner, "library that partitions the mesh",
             {{Partitioner::automatic, "automatic",
               "METIS for up to 100,000 tets of the file, else PTScotch"},
              {Partitioner::metis, "metis", "METIS, on one rank, which has all tets for that"},
              {Partitioner::ptscotch, "ptscotch",
               "PTScotch, on all ranks, of which none has all tets"}});
    v.field("petsc_options", s.petsc_options, "",
            "PETSc options; those on the command line take precedence");
}

}  // namespace livetet
