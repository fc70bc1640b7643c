#include "solvers/elastic_operator.hpp"

#include <algorithm>

namespace livetet {

namespace {

MatrixLayout layout_for(SolverKind kind, CoarseOperator coarse, bool coarsest) {
    const bool blocks = kind == SolverKind::multigrid && coarse == CoarseOperator::rediscretised && !coarsest;
    return blocks ? MatrixLayout::blocks : MatrixLayout::scalars;
}

void set_option(const char* name, const char* value) {
    PetscBool given = PETSC_FALSE;
    LIVETET_PETSC(PetscOptionsHasName(nullptr, nullptr, name, &given));
    if (!given) LIVETET_PETSC(PetscOptionsSetValue(nullptr, name, value));
}

/// What hypre needs to treat elasticity as a system whose near-nullspace are the rigid motions (Baker, Kolev, Yang
/// 2010).
void configure_boomeramg(PC pc) {
    LIVETET_PETSC(PCSetType(pc, PCHYPRE));
    LIVETET_PETSC(PCHYPRESetType(pc, "boomeramg"));
    set_option("-pc_hypre_boomeramg_strong_threshold", "0.5");
    set_option("-pc_hypre_boomeramg_nodal_coarsen", "4");
    set_option("-pc_hypre_boomeramg_nodal_coarsen_diag", "1");
    set_option("-pc_hypre_boomeramg_vec_interp_variant", "2");
    set_option("-pc_hypre_boomeramg_vec_interp_qmax", "4");
}

/// The largest eigenvalue of D^-1 A, D the 3x3 blocks of A's diagonal, from a few steps of conjugate gradients
/// (Lanczos).
double largest_eigenvalue(Mat A) {
    PetscHandle<KSP> ksp;
    PetscHandle<Vec> b, x;
    MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(A));
    LIVETET_PETSC(KSPCreate(comm, ksp.out()));
    LIVETET_PETSC(KSPSetOptionsPrefix(ksp.get(), "bounds_"));
    LIVETET_PETSC(KSPSetType(ksp.get(), KSPCG));
    LIVETET_PETSC(KSPSetComputeEigenvalues(ksp.get(), PETSC_TRUE));
    LIVETET_PETSC(KSPSetTolerances(ksp.get(), 1e-10, PETSC_DEFAULT, PETSC_DEFAULT, 12));
    LIVETET_PETSC(KSPSetOperators(ksp.get(), A, A));
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp.get(), &pc));
    LIVETET_PETSC(PCSetType(pc, PCPBJACOBI));
    LIVETET_PETSC(MatCreateVecs(A, x.out(), b.out()));
    {
        // A fixed rough vector, the same on any number of runs.
        WriteArray values(b.get());
        std::uint32_t state = 12345;
        for (double& v : values.span())
            v = static_cast<double>(state = state * 1664525u + 1013904223u) / 4294967296.0 - 0.5;
    }
    LIVETET_PETSC(KSPSolve(ksp.get(), b.get(), x.get()));
    PetscReal real[12], imaginary[12];
    PetscInt count = 0;
    LIVETET_PETSC(KSPComputeEigenvalues(ksp.get(), 12, real, imaginary, &count));
    return count > 0 ? *std::max_element(real, real + count) : 2.0;
}

/// Ones on the diagonal of constrained components, whose rows and columns P^T A P leaves empty.
void add_identity(Mat A, const MeshShare& share, std::span<const std::uint8_t> components) {
    for (std::int32_t i = 0; i < share.owned; ++i)
        for (PetscInt c = 0; c < 3; ++c)
            if (components[share.nodes[i]] >> c & 1)
                LIVETET_PETSC(MatSetValue(A, 3 * share.numbers[i] + c, 3 * share.numbers[i] + c, 1.0, INSERT_VALUES));
    LIVETET_PETSC(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
}

}  // namespace

ElasticOperator::ElasticOperator(MPI_Comm comm, const MeshHierarchy& hierarchy,
                                 std::span<const std::vector<std::int32_t>> parts, std::span<const Material> materials,
                                 StrainModel strain, const SolverOptions& options)
    : options_(options), kind_(resolved_kind(options.kind, hierarchy.levels.size())) {
    make_levels(comm, hierarchy, parts, materials, strain);
    make_krylov(comm);
    work_ = make_vector(fine().share());
}

ElasticOperator::~ElasticOperator() = default;

void ElasticOperator::make_levels(MPI_Comm comm, const MeshHierarchy& hierarchy,
                                  std::span<const std::vector<std::int32_t>> parts, std::span<const Material> materials,
                                  StrainModel strain) {
    const std::size_t count = kind_ == SolverKind::multigrid ? hierarchy.levels.size() : 1;
    for (std::size_t l = 0; l < count; ++l) {
        const MatrixLayout layout = layout_for(kind_, options_.coarse, l + 1 == count);
        levels_.push_back(std::make_unique<ElasticLevel>(
            hierarchy.levels[l],
            share_mesh(comm, hierarchy.levels[l], parts.empty() ? std::span<const std::int32_t>{} : parts[l]),
            materials, strain, layout));
        if (l == 0) continue;
        transfers_.push_back(
            std::make_unique<Transfer>(levels_[l - 1]->share(), levels_[l]->share(), hierarchy.transfers[l - 1]));
        displacements_.push_back(make_vector(levels_[l]->share()));
    }
}

void ElasticOperator::make_krylov(MPI_Comm comm) {
    LIVETET_PETSC(KSPCreate(comm, krylov_.out()));
    KSP ksp = krylov_.get();
    LIVETET_PETSC(KSPSetType(ksp, KSPCG));
    LIVETET_PETSC(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
    LIVETET_PETSC(KSPSetInitialGuessNonzero(ksp, PETSC_TRUE));
    LIVETET_PETSC(KSPSetOperators(ksp, fine().matrix(), fine().matrix()));
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp, &pc));
    switch (kind_) {
        case SolverKind::automatic:
        case SolverKind::multigrid:
            configure_multigrid(pc);
            break;
        case SolverKind::boomeramg:
            configure_boomeramg(pc);
            break;
        case SolverKind::gamg:
            LIVETET_PETSC(PCSetType(pc, PCGAMG));
            break;
        case SolverKind::direct:
            LIVETET_PETSC(PCSetType(pc, PCCHOLESKY));
            LIVETET_PETSC(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
            break;
        case SolverKind::petsc:
            break;
    }
    LIVETET_PETSC(KSPSetFromOptions(ksp));
}

void ElasticOperator::configure_multigrid(PC pc) {
    const int count = level_count();
    LIVETET_PETSC(PCSetType(pc, PCMG));
    LIVETET_PETSC(PCMGSetLevels(pc, count, nullptr));
    LIVETET_PETSC(PCMGSetGalerkin(pc, PC_MG_GALERKIN_NONE));
    for (int l = 0; l + 1 < count; ++l) {
        const int level = count - 1 - l;  // PCMG counts from the coarsest
        LIVETET_PETSC(PCMGSetInterpolation(pc, level, transfers_[l]->interpolation()));
        KSP smoother = nullptr;
        PC block_jacobi = nullptr;
        LIVETET_PETSC(PCMGGetSmoother(pc, level, &smoother));
        LIVETET_PETSC(KSPSetType(smoother, KSPCHEBYSHEV));
        LIVETET_PETSC(
            KSPSetTolerances(smoother, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, options_.smoothing_steps));
        LIVETET_PETSC(KSPGetPC(smoother, &block_jacobi));
        LIVETET_PETSC(PCSetType(block_jacobi, PCPBJACOBI));
    }
    KSP coarsest = nullptr;
    PC factor = nullptr;
    LIVETET_PETSC(PCMGGetCoarseSolve(pc, &coarsest));
    LIVETET_PETSC(KSPSetType(coarsest, KSPPREONLY));
    LIVETET_PETSC(KSPGetPC(coarsest, &factor));
    int ranks = 1;
    MPI_Comm_size(PetscObjectComm(reinterpret_cast<PetscObject>(pc)), &ranks);
    LIVETET_PETSC(PCSetType(factor, ranks > 1 ? PCREDUNDANT : PCLU));
}

void ElasticOperator::set_constrained(std::span<const std::uint8_t> components) {
    components_.assign(1, {components.begin(), components.end()});
    fine().set_constrained(components);
    for (std::size_t l = 0; l < transfers_.size(); ++l) {
        ElasticLevel &upper = *levels_[l], &lower = *levels_[l + 1];
        components_.push_back(
            coarse_components(transfers_[l]->map(), components_[l], lower.share().number_of_node.size()));
        lower.set_constrained(components_[l + 1]);
        transfers_[l]->set_constrained(upper.share(), lower.share(), components_[l], components_[l + 1]);
    }
    bounds_known_ = false;
}

void ElasticOperator::assemble(Vec u, double s, double m) {
    if (kind_ == SolverKind::multigrid && !bounds_known_) {
        // Mass only lowers the largest eigenvalue of D^-1 A: bounds of the stiffness alone hold for any time step.
        assemble_levels(u, s, 0);
        set_smoother_bounds();
    }
    assemble_levels(u, s, m);
}

void ElasticOperator::assemble_levels(Vec u, double s, double m) {
    fine().assemble(s, m);
    if (kind_ != SolverKind::multigrid) return;
    for (std::size_t l = 0; l < transfers_.size(); ++l) {
        if (options_.coarse == CoarseOperator::rediscretised) {
            Vec coarse = displacements_[l].get();
            transfers_[l]->restrict_displacement(l == 0 ? u : displacements_[l - 1].get(), coarse);
            update_ghosts(coarse);
            levels_[l + 1]->update_rotations(coarse);
            levels_[l + 1]->assemble(s, m);
        } else {
            const bool first = galerkin_.size() <= l;
            if (first) galerkin_.emplace_back();
            Mat A = l == 0 ? fine().matrix() : galerkin_[l - 1].get();
            Mat product = galerkin_[l].get();
            LIVETET_PETSC(
                MatPtAP(A, transfers_[l]->interpolation(), first ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX, 2, &product));
            if (first) galerkin_[l] = PetscHandle<Mat>::adopt(product);
            add_identity(product, levels_[l + 1]->share(), components_[l + 1]);
        }
    }
    set_level_operators();
}

void ElasticOperator::set_level_operators() {
    PC pc = nullptr;
    PetscBool multigrid = PETSC_FALSE;
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCMG, &multigrid));
    if (!multigrid) return;  // the user's options chose another preconditioner
    for (int l = 0; l < level_count(); ++l) {
        KSP smoother = nullptr;
        LIVETET_PETSC(PCMGGetSmoother(pc, level_count() - 1 - l, &smoother));
        Mat A = l > 0 && options_.coarse == CoarseOperator::galerkin ? galerkin_[l - 1].get() : levels_[l]->matrix();
        LIVETET_PETSC(KSPSetOperators(smoother, A, A));
    }
}

void ElasticOperator::set_smoother_bounds() {
    PC pc = nullptr;
    PetscBool multigrid = PETSC_FALSE;
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCMG, &multigrid));
    for (int l = 0; multigrid && l + 1 < level_count(); ++l) {
        KSP smoother = nullptr;
        Mat A = nullptr;
        LIVETET_PETSC(PCMGGetSmoother(pc, level_count() - 1 - l, &smoother));
        LIVETET_PETSC(KSPGetOperators(smoother, &A, nullptr));
        const double bound = 1.1 * largest_eigenvalue(A);
        LIVETET_PETSC(KSPChebyshevSetEigenvalues(smoother, bound, 0.1 * bound));
    }
    bounds_known_ = true;
}

LinearReport ElasticOperator::solve(Vec b, Vec x, double relative_tolerance) {
    KSP ksp = krylov_.get();
    LIVETET_PETSC(KSPSetTolerances(ksp, relative_tolerance, 1e-50, PETSC_DEFAULT, options_.max_iterations));
    // A guess that is worse than none is dropped: after a gap in time, where a body went says nothing of where it is.
    PetscReal size = 0, residual = 0;
    LIVETET_PETSC(MatMult(fine().matrix(), x, work_.get()));
    LIVETET_PETSC(VecAYPX(work_.get(), -1, b));
    LIVETET_PETSC(VecNorm(b, NORM_2, &size));
    LIVETET_PETSC(VecNorm(work_.get(), NORM_2, &residual));
    if (!(residual < size)) LIVETET_PETSC(VecSet(x, 0));
    LIVETET_PETSC(KSPSolve(ksp, b, x));
    LinearReport report;
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    PetscInt iterations = 0;
    LIVETET_PETSC(KSPGetConvergedReason(ksp, &reason));
    LIVETET_PETSC(KSPGetIterationNumber(ksp, &iterations));
    LIVETET_PETSC(KSPGetResidualNorm(ksp, &report.residual));
    LIVETET_PETSC(KSPGetConvergedReasonString(ksp, &report.reason));
    report.iterations = static_cast<int>(iterations);
    report.converged = reason > 0;
    return report;
}

std::string ElasticOperator::name() const {
    KSPType krylov = nullptr;
    PCType preconditioner = nullptr;
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetType(krylov_.get(), &krylov));
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PCGetType(pc, &preconditioner));
    std::string text = fmt::format("{} + {}", krylov ? krylov : "?", preconditioner ? preconditioner : "?");
    if (kind_ == SolverKind::multigrid)
        text += fmt::format(", {} levels, {}", level_count(),
                            options_.coarse == CoarseOperator::galerkin ? "galerkin" : "rediscretised");
    return text;
}

}  // namespace livetet
