#include "solvers/linear/linear_solver.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace livetet {

namespace {

std::optional<MatrixLayout> layout_for(SolverKind kind, CoarseOperator coarse, bool coarsest) {
    if (kind == SolverKind::live) return std::nullopt;
    const bool blocks =
        kind == SolverKind::multigrid && coarse == CoarseOperator::rediscretised && !coarsest;
    return blocks ? MatrixLayout::blocks : MatrixLayout::scalars;
}

/// What hypre needs to treat elasticity as a system whose near-nullspace are the rigid motions
/// (Baker, Kolev, Yang 2010).
void configure_boomeramg(PC pc) {
    LIVETET_PETSC(PCSetType(pc, PCHYPRE));
    LIVETET_PETSC(PCHYPRESetType(pc, "boomeramg"));
    const char* prefix = nullptr;  // "displacement_" in the mixed form
    LIVETET_PETSC(PCGetOptionsPrefix(pc, &prefix));
    const auto set_option = [&](const std::string& name, const char* value) {
        const std::string option = fmt::format("-{}{}", prefix ? prefix : "", name);
        PetscBool given = PETSC_FALSE;
        LIVETET_PETSC(PetscOptionsHasName(nullptr, nullptr, option.c_str(), &given));
        if (!given) LIVETET_PETSC(PetscOptionsSetValue(nullptr, option.c_str(), value));
    };
    set_option("pc_hypre_boomeramg_strong_threshold", "0.5");
    set_option("pc_hypre_boomeramg_nodal_coarsen", "4");
    set_option("pc_hypre_boomeramg_nodal_coarsen_diag", "1");
    set_option("pc_hypre_boomeramg_vec_interp_variant", "2");
    set_option("pc_hypre_boomeramg_vec_interp_qmax", "4");
}

/// PETSc's options, which may name what there is none of.
void take_options(KSP ksp) {
    const PetscErrorCode failure = KSPSetFromOptions(ksp);
    if (failure != PETSC_ERR_ARG_UNKNOWN_TYPE) {
        LIVETET_PETSC(failure);
        return;
    }
    const char* prefix = nullptr;
    LIVETET_PETSC(KSPGetOptionsPrefix(ksp, &prefix));
    std::string found;
    for (const char* name : {"-ksp_type", "-pc_type"}) {
        char value[100] = "";
        PetscBool given = PETSC_FALSE;
        LIVETET_PETSC(PetscOptionsGetString(nullptr, prefix, name, value, sizeof value, &given));
        if (given) found += fmt::format(" -{}{} {}", prefix ? prefix : "", name + 1, value);
    }
    if (found.empty()) found = " a type that it does not have";
    fail("PETSc's options: found{}, expected solvers and preconditioners that this PETSc has",
         found);
}

/// The largest eigenvalue of A preconditioned by `by`, or by the 3x3 blocks of its diagonal where
/// that is null, from a few steps of conjugate gradients (Lanczos).
double largest_eigenvalue(Mat A, PC by = nullptr) {
    PetscHandle<KSP> ksp;
    PetscHandle<Vec> b, x;
    MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(A));
    LIVETET_PETSC(KSPCreate(comm, ksp.out()));
    LIVETET_PETSC(KSPSetOptionsPrefix(ksp.get(), "bounds_"));
    LIVETET_PETSC(KSPSetType(ksp.get(), KSPCG));
    LIVETET_PETSC(KSPSetComputeEigenvalues(ksp.get(), PETSC_TRUE));
    LIVETET_PETSC(KSPSetTolerances(ksp.get(), 1e-10, PETSC_DEFAULT, PETSC_DEFAULT, 12));
    LIVETET_PETSC(KSPSetOperators(ksp.get(), A, A));
    if (by) {
        LIVETET_PETSC(KSPSetPC(ksp.get(), by));
    } else {
        PC pc = nullptr;
        LIVETET_PETSC(KSPGetPC(ksp.get(), &pc));
        LIVETET_PETSC(PCSetType(pc, PCPBJACOBI));
    }
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
void add_identity(Mat A, const PartitionedMesh& share, std::span<const std::uint8_t> components) {
    for (std::int32_t i = 0; i < share.owned; ++i)
        for (PetscInt c = 0; c < 3; ++c)
            if (components[share.nodes[i]] >> c & 1)
                LIVETET_PETSC(MatSetValue(A, 3 * share.numbers[i] + c, 3 * share.numbers[i] + c,
                                          1.0, INSERT_VALUES));
    LIVETET_PETSC(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
}

/// What PETSc's shell objects do: work(context, x, y); exceptions become PETSc's error codes.
template <class Context, class Shell, class Get, class Work>
PetscErrorCode in_shell(Get get, Shell shell, Vec x, Vec y, Work&& work) noexcept {
    try {
        void* context = nullptr;
        LIVETET_PETSC(get(shell, &context));
        const ReadArray from(x);
        WriteArray to(y);
        work(*static_cast<Context*>(context), from.span(), to.span());
        return 0;
    } catch (const std::exception&) {
        return PETSC_ERR_LIB;
    }
}

}  // namespace

Formulation resolved_formulation(const ElasticModel& model) {
    if (model.formulation != Formulation::automatic) return model.formulation;
    const auto any = [&](auto&& is) {
        return std::any_of(model.materials.begin(), model.materials.end(), is);
    };
    const bool locks = any([](const Material& m) { return m.poisson >= 0.49; });
    const bool cork = any([](const Material& m) { return m.poisson <= 0; });  // has no pressure
    return locks && !cork ? Formulation::mixed : Formulation::displacement;
}

struct LinearSolver::Stopping {
    explicit Stopping(LinearSolver& o) : owner(o) {}

    void begin(const LinearControls& e, double allowed_residual) {
        effort = e;
        allowed = allowed_residual;
        steps[0] = steps[1] = 0;
        if (!previous && owner.live_) previous = make_vector(owner.fine().share());
        if (previous) LIVETET_PETSC(VecSet(previous.get(), 0));
        last = Clock::now();
    }

    static PetscErrorCode test(KSP ksp, PetscInt iteration, PetscReal residual,
                               KSPConvergedReason* reason, void* self) noexcept {
        try {
            *reason =
                static_cast<Stopping*>(self)->reason(ksp, static_cast<int>(iteration), residual);
            return 0;
        } catch (const std::exception&) {
            return PETSC_ERR_LIB;
        }
    }

    KSPConvergedReason reason(KSP ksp, int iteration, double residual) {
        if (!std::isfinite(residual)) return KSP_DIVERGED_NANORINF;
        if (iteration > 0) measure_step(ksp);
        if (residual <= allowed) return KSP_CONVERGED_RTOL;
        if (iteration >= effort.max_iterations) return KSP_DIVERGED_ITS;
        if (effort.deadline && iteration > 0) {
            const auto now = Clock::now();
            const auto next =
                now + 3 * (now - last) / 2;  // a budget kept is worth more than half an iteration
            last = now;
            if (next > *effort.deadline) return KSP_CONVERGED_ITS;
        }
        return KSP_CONVERGED_ITERATING;
    }

    /// How far the last iteration went, RMS over the nodes, m.
    void measure_step(KSP ksp) {
        if (!previous) return;
        Vec now = nullptr;
        LIVETET_PETSC(KSPBuildSolution(ksp, nullptr, &now));
        const ReadArray x(now);
        WriteArray y(previous.get());
        std::atomic<double> sum{0};
        owner.team_.run_pieces(y.span().size(), 1000, [&](std::size_t begin, std::size_t end) {
            double of_piece = 0;
            for (std::size_t i = begin; i < end; ++i) {
                const double step = x[i] - y[i];
                of_piece += step * step;
                y[i] = x[i];
            }
            sum += of_piece;
        });
        steps[0] = steps[1];
        steps[1] = std::sqrt(sum / (static_cast<double>(y.span().size()) / 3));
    }

    /// What further steps would add up to, each shorter than the one before by the same ratio.
    double error() {
        if (steps[0] > 0) ratio += 0.2 * (std::clamp(steps[1] / steps[0], 0.05, 0.8) - ratio);
        return steps[1] * ratio / (1 - ratio);
    }

    LinearSolver& owner;
    LinearControls effort;
    double allowed = 0;
    PetscHandle<Vec> previous;
    double steps[2] = {0, 0};
    double ratio = 0.3;  ///< of a step to the one before it: a running mean
    Clock::time_point last;
};

LinearSolver::LinearSolver(MPI_Comm comm, const MeshHierarchy& hierarchy,
                           std::span<const std::vector<std::int32_t>> parts,
                           const ElasticModel& model, const SolverOptions& options,
                           ThreadTeam& team)
    : options_(options),
      team_(team),
      kind_(resolved_kind(options.kind, hierarchy.levels.size())),
      coarse_(resolved_coarse(options.coarse, contrast_of(model.materials))),
      smoothing_steps_(options.smoothing_steps > 0 ? options.smoothing_steps
                       : kind_ == SolverKind::live ? 1
                                                   : 6),
      tet_count_(hierarchy.levels.front().tets.size()) {
    if (kind_ == SolverKind::multigrid && hierarchy.levels.size() < 2)
        fail(
            "solver.kind: found multigrid and a mesh of one level, expected a mesh of several or "
            "another kind (automatic)");
    make_levels(comm, hierarchy, parts, model);
    if (fine().pressure_space()) {
        const HeapGrowth grown(&costs_.pressures);
        coupling_ = std::make_unique<PressureCoupling>(fine());
    }
    const HeapGrowth grown(&costs_.preconditioner);
    if (kind_ == SolverKind::live) make_live(hierarchy, model);
    make_krylov(comm);
    if (coupling_) make_saddle_krylov(comm);
}

LinearSolver::~LinearSolver() = default;

void LinearSolver::make_levels(MPI_Comm comm, const MeshHierarchy& hierarchy,
                               std::span<const std::vector<std::int32_t>> parts,
                               const ElasticModel& model) {
    const bool has_levels = kind_ == SolverKind::multigrid || kind_ == SolverKind::live;
    const std::size_t count = has_levels ? hierarchy.levels.size() : 1;
    const Formulation formulation = resolved_formulation(model);
    // What the coarse levels precondition in the mixed form holds no volumetric stiffness: lambda =
    // 0, the same mu.
    std::vector<Material> coarse(model.materials.begin(), model.materials.end());
    if (formulation == Formulation::mixed)
        for (Material& m : coarse) {
            if (m.poisson <= 0)
                fail(
                    "materials: poisson = {} in the mixed form, expected above 0 (formulation: "
                    "displacement)",
                    m.poisson);
            m.young_Pa = 2 * m.mu();
            m.poisson = 0;
        }
    std::vector<double> volumes;  // of a coarse level
    for (std::size_t l = 0; l < count; ++l) {
        if (l > 0)
            volumes = carried_volumes(hierarchy.levels[l - 1],
                                      l == 1 ? tet_volumes(hierarchy.levels.front()) : volumes,
                                      hierarchy.transfers[l - 1], hierarchy.levels[l]);
        const auto layout = layout_for(kind_, coarse_, l + 1 == count);
        const HeapGrowth grown(l == 0 ? &costs_.elements : &costs_.coarse_levels);
        levels_.push_back(std::make_unique<LevelAssembler>(
            hierarchy.levels[l],
            distribute_mesh(comm, hierarchy.levels[l],
                            parts.empty() ? std::span<const std::int32_t>{} : parts[l],
                            hierarchy.is_cut(l)),
            l == 0 ? model.materials : std::span<const Material>(coarse), model.strain,
            l == 0 ? formulation : Formulation::displacement, layout, team_, volumes));
        if (l > 0)
            coarse_bodies_.emplace_back(hierarchy.levels[l], hierarchy.levels[l - 1],
                                        hierarchy.transfers[l - 1]);
        if (l == 0 || kind_ == SolverKind::live) continue;
        transfers_.push_back(std::make_unique<Transfer>(
            levels_[l - 1]->share(), levels_[l]->share(), hierarchy.transfers[l - 1]));
        displacements_.push_back(make_vector(levels_[l]->share()));
    }
    costs_.matrix.bytes = fine().matrix_bytes();
    costs_.rotations.bytes = fine().rotation_bytes();
    costs_.elements.bytes -= costs_.matrix.bytes + costs_.rotations.bytes;
}

void LinearSolver::make_live(const MeshHierarchy& hierarchy, const ElasticModel& model) {
    int ranks = 1;
    MPI_Comm_size(fine().share().comm, &ranks);
    const bool strain =
        model.strain == StrainModel::linear || model.strain == StrainModel::corotated;
    if (const double contrast = contrast_of(model.materials);
        contrast > SinglePrecisionMultigrid::most_contrast)
        fail(
            "solver.kind = live: found Young's moduli a factor of {:.3g} apart, expected at most "
            "{:g} (kind: multigrid)",
            contrast, SinglePrecisionMultigrid::most_contrast);
    if (ranks > 1 || !strain || coupling_ || !hierarchy.levels.front().edge_nodes.empty())
        fail(
            "solver.kind = live is for one rank, P1, linear or corotated strain, by displacements; "
            "found {} rank(s), {} "
            "nodes a tet{}{}",
            ranks, hierarchy.levels.front().edge_nodes.empty() ? 4 : 10,
            coupling_ ? ", pressures" : "", strain ? "" : ", another strain");
    std::vector<LevelAssembler*> levels;
    std::vector<const BarycentricMap*> maps;
    for (const auto& level : levels_) levels.push_back(level.get());
    for (const BarycentricMap& map : hierarchy.transfers) maps.push_back(&map);
    live_ = std::make_unique<SinglePrecisionMultigrid>(std::move(levels), std::move(maps),
                                                       smoothing_steps_, team_);
    const PetscInt n = 3 * fine().share().owned;
    LIVETET_PETSC(MatCreateShell(fine().share().comm, n, n, n, n, live_.get(), live_matrix_.out()));
    const auto multiply = [](Mat A, Vec x, Vec y) noexcept -> PetscErrorCode {
        return in_shell<SinglePrecisionMultigrid>(
            MatShellGetContext, A, x, y,
            [](SinglePrecisionMultigrid& m, auto from, auto to) { m.multiply(from, to); });
    };
    LIVETET_PETSC(MatShellSetOperation(
        live_matrix_.get(), MATOP_MULT,
        reinterpret_cast<void (*)()>(static_cast<PetscErrorCode (*)(Mat, Vec, Vec)>(multiply))));
}

void LinearSolver::read_asked_tolerances() {
    const auto number = [](const char* name) {
        PetscReal value = 0;
        PetscBool given = PETSC_FALSE;
        LIVETET_PETSC(PetscOptionsGetReal(nullptr, nullptr, name, &value, &given));
        return given ? std::optional(value) : std::nullopt;
    };
    asked_tolerance_ = number("-ksp_rtol");
    asked_residual_ = number("-ksp_atol").value_or(asked_residual_);
    if (const auto most = number("-ksp_max_it")) asked_iterations_ = static_cast<int>(*most);
}

void LinearSolver::make_krylov(MPI_Comm comm) {
    read_asked_tolerances();
    LIVETET_PETSC(KSPCreate(comm, krylov_.out()));
    KSP ksp = krylov_.get();
    if (coupling_) {
        LIVETET_PETSC(KSPSetOptionsPrefix(ksp, "displacement_"));
        LIVETET_PETSC(KSPSetType(ksp, KSPPREONLY));
    } else {
        LIVETET_PETSC(KSPSetType(ksp, KSPCG));
        LIVETET_PETSC(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
        stopping_ = std::make_unique<Stopping>(*this);
        PetscBool other = PETSC_FALSE;
        LIVETET_PETSC(PetscOptionsHasName(nullptr, nullptr, "-ksp_convergence_test", &other));
        if (!other)
            LIVETET_PETSC(KSPSetConvergenceTest(ksp, Stopping::test, stopping_.get(), nullptr));
    }
    LIVETET_PETSC(KSPSetOperators(ksp, displacement_matrix(), displacement_matrix()));
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp, &pc));
    switch (kind_) {
        case SolverKind::automatic:
        case SolverKind::multigrid:
            configure_multigrid(pc, 0);
            break;
        case SolverKind::live:
            LIVETET_PETSC(PCSetType(pc, PCSHELL));
            LIVETET_PETSC(PCShellSetName(pc, "multigrid in single precision, re-discretised"));
            LIVETET_PETSC(PCShellSetContext(pc, live_.get()));
            LIVETET_PETSC(
                PCShellSetApply(pc, [](PC shell, Vec r, Vec z) noexcept -> PetscErrorCode {
                    return in_shell<SinglePrecisionMultigrid>(
                        PCShellGetContext, shell, r, z,
                        [](SinglePrecisionMultigrid& m, auto from, auto to) { m.cycle(from, to); });
                }));
            break;
        case SolverKind::boomeramg:
            configure_boomeramg(pc);
            break;
        case SolverKind::gamg:
            LIVETET_PETSC(PCSetType(pc, PCGAMG));
            break;
        case SolverKind::direct:
            LIVETET_PETSC(
                PCSetType(pc, PCCHOLESKY));  // L D L^T: an exact tangent need not be positive
            LIVETET_PETSC(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
            break;
        case SolverKind::petsc:
            break;
    }
    take_options(ksp);
    if (fine().matrix() && !cycles()) fine().set_rigid_motions();
}

void LinearSolver::make_saddle_krylov(MPI_Comm comm) {
    LIVETET_PETSC(MatCreateTranspose(coupling_->b(), b_transposed_.out()));
    Mat blocks[4] = {fine().matrix(), b_transposed_.get(), coupling_->b(), coupling_->minus_c()};
    LIVETET_PETSC(MatCreateNest(comm, 2, nullptr, 2, nullptr, blocks, saddle_matrix_.out()));
    LIVETET_PETSC(KSPCreate(comm, saddle_.out()));
    KSP ksp = saddle_.get();
    LIVETET_PETSC(KSPSetType(ksp, KSPFGMRES));
    LIVETET_PETSC(KSPGMRESSetRestart(ksp, 60));
    LIVETET_PETSC(KSPSetOperators(ksp, saddle_matrix_.get(), saddle_matrix_.get()));
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp, &pc));
    LIVETET_PETSC(PCSetType(pc, PCSHELL));
    LIVETET_PETSC(PCShellSetName(pc, "block triangular: displacements, pressure mass"));
    LIVETET_PETSC(PCShellSetContext(pc, this));
    LIVETET_PETSC(PCShellSetApply(pc, [](PC shell, Vec r, Vec y) noexcept -> PetscErrorCode {
        try {
            void* self = nullptr;
            LIVETET_PETSC(PCShellGetContext(shell, &self));
            static_cast<LinearSolver*>(self)->apply_saddle_preconditioner(r, y);
            return 0;
        } catch (const std::exception&) {
            return PETSC_ERR_LIB;
        }
    }));
    take_options(ksp);
    saddle_work_ = make_vector(fine().share());
}

/// y_p = -S^-1 r_p, y_u = K^-1 (r_u - B^T y_p).
void LinearSolver::apply_saddle_preconditioner(Vec r, Vec y) {
    Vec r_u = nullptr, r_p = nullptr, y_u = nullptr, y_p = nullptr;
    LIVETET_PETSC(VecNestGetSubVec(r, 0, &r_u));
    LIVETET_PETSC(VecNestGetSubVec(r, 1, &r_p));
    LIVETET_PETSC(VecNestGetSubVec(y, 0, &y_u));
    LIVETET_PETSC(VecNestGetSubVec(y, 1, &y_p));
    coupling_->apply_schur_inverse(r_p, y_p);
    LIVETET_PETSC(VecScale(y_p, -1));
    LIVETET_PETSC(MatMultTranspose(coupling_->b(), y_p, saddle_work_.get()));
    LIVETET_PETSC(VecAYPX(saddle_work_.get(), -1, r_u));
    LIVETET_PETSC(KSPSolve(krylov_.get(), saddle_work_.get(), y_u));
}

void LinearSolver::configure_multigrid(PC pc, std::size_t l) {
    const char* outer = nullptr;  // "displacement_" in the mixed form
    LIVETET_PETSC(KSPGetOptionsPrefix(krylov_.get(), &outer));
    const auto set_prefix = [&](KSP ksp, const std::string& name) {
        LIVETET_PETSC(KSPSetOptionsPrefix(ksp, ((outer ? outer : "") + name).c_str()));
    };
    const std::size_t number = levels_.size() - 1 - l;  // PETSc counts from the coarsest
    LIVETET_PETSC(PCSetType(pc, PCMG));
    LIVETET_PETSC(PCMGSetLevels(pc, 2, nullptr));
    LIVETET_PETSC(PCMGSetGalerkin(pc, PC_MG_GALERKIN_NONE));
    LIVETET_PETSC(PCMGSetInterpolation(pc, 1, transfers_[l]->interpolation()));
    KSP smoother = nullptr, coarse = nullptr;
    PC block_jacobi = nullptr, below = nullptr;
    LIVETET_PETSC(PCMGGetSmoother(pc, 1, &smoother));
    set_prefix(smoother, fmt::format("mg_levels_{}_", number));
    LIVETET_PETSC(KSPSetType(smoother, KSPCHEBYSHEV));
    LIVETET_PETSC(
        KSPSetTolerances(smoother, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, smoothing_steps_));
    LIVETET_PETSC(KSPGetPC(smoother, &block_jacobi));
    LIVETET_PETSC(PCSetType(block_jacobi, PCPBJACOBI));
    LIVETET_PETSC(PCMGGetCoarseSolve(pc, &coarse));
    LIVETET_PETSC(KSPGetPC(coarse, &below));
    if (number > 1) {
        set_prefix(coarse, fmt::format("mg_cycles_{}_", number - 1));
        LIVETET_PETSC(KSPSetType(coarse, KSPCHEBYSHEV));
        LIVETET_PETSC(KSPSetNormType(coarse, KSP_NORM_NONE));
        LIVETET_PETSC(KSPSetConvergenceTest(coarse, KSPConvergedSkip, nullptr, nullptr));
        LIVETET_PETSC(
            KSPSetTolerances(coarse, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, cycles_below));
        configure_multigrid(below, l + 1);
    } else {
        int ranks = 1;
        MPI_Comm_size(PetscObjectComm(reinterpret_cast<PetscObject>(pc)), &ranks);
        set_prefix(coarse, "mg_coarse_");
        LIVETET_PETSC(KSPSetType(coarse, KSPPREONLY));
        LIVETET_PETSC(PCSetType(below, ranks > 1 ? PCREDUNDANT : PCLU));
    }
    smoothers_.insert(smoothers_.begin(), smoother);
    coarse_solves_.insert(coarse_solves_.begin(), coarse);
}

void LinearSolver::set_constrained(std::span<const std::uint8_t> components) {
    components_.assign(1, {components.begin(), components.end()});
    fine().set_constrained(components);
    if (live_) {
        for (std::size_t l = 1; l < levels_.size(); ++l) {
            components_.push_back(
                coarse_components(live_->map(l - 1), components_[l - 1], coarse_bodies_[l - 1]));
            levels_[l]->set_constrained(components_[l]);
        }
        live_->set_constrained();
    }
    for (std::size_t l = 0; l < transfers_.size(); ++l) {
        LevelAssembler &upper = *levels_[l], &lower = *levels_[l + 1];
        components_.push_back(
            coarse_components(transfers_[l]->map(), components_[l], coarse_bodies_[l]));
        lower.set_constrained(components_[l + 1]);
        transfers_[l]->set_constrained(upper.share(), lower.share(), components_[l],
                                       components_[l + 1]);
    }
    bounds_known_ = false;
    kept_.reset();
}

void LinearSolver::set_springs(std::span<const double> stiffness) {
    std::vector<double> level(stiffness.begin(), stiffness.end());
    fine().set_springs(level);
    for (std::size_t l = 0; l + 1 < levels_.size(); ++l) {
        std::vector<double> lower(level.empty() ? 0 : levels_[l + 1]->share().number_of_node.size(),
                                  0.0);
        const BarycentricMap& map = live_ ? live_->map(l) : transfers_[l]->map();
        for (std::size_t i = 0; i < level.size(); ++i)
            for (int k = 0; k < 4; ++k)  // no node of an extrapolated place is pushed away
                lower[map.nodes[i][k]] += std::max(map.weights[i][k], 0.0) * level[i];
        levels_[l + 1]->set_springs(lower);
        level = std::move(lower);
    }
    if (live_) live_->set_constrained();
    kept_.reset();
}

bool LinearSolver::assemble(const Configuration& at, double s, double m, Tangent tangent,
                            bool by_halves) {
    const bool is_linear = fine().strain() == StrainModel::linear;
    if (is_linear && kept_ == std::pair(s, m)) return false;
    const PhaseTimer timer(costs_.matrix);
    kept_.reset();
    if (is_linear) kept_.emplace(s, m);
    is_new_ = true;
    if (live_) {
        live_->update(s, m, by_halves && !is_linear);
        return live_->renewed_half();
    }
    if (kind_ == SolverKind::multigrid && !bounds_known_) {
        // Mass only lowers the largest eigenvalue of D^-1 A: bounds of the stiffness alone hold for
        // any time step.
        assemble_levels(at, s, 0, tangent);
        if (set_bounds()) {
            if (m == 0 && !coupling_) return false;
        } else {  // an exact tangent far from rest is not positive, and says little
            assemble_levels(at, s, 0,
                            fine().strain() == StrainModel::corotated ? Tangent::held_rotation
                                                                      : Tangent::positive);
            (void)set_bounds();
        }
    }
    assemble_levels(at, s, m, tangent);
    if (coupling_) {
        coupling_->assemble(at.u);
        LIVETET_PETSC(MatAssemblyBegin(saddle_matrix_.get(), MAT_FINAL_ASSEMBLY));
        LIVETET_PETSC(MatAssemblyEnd(saddle_matrix_.get(), MAT_FINAL_ASSEMBLY));
    }
    return false;
}

void LinearSolver::set_up_preconditioner() {
    if (!is_new_) return;
    is_new_ = false;
    const PhaseTimer timer(costs_.preconditioner);
    const HeapGrowth grown(costs_.preconditioner.times == 1 ? &costs_.preconditioner : nullptr);
    LIVETET_PETSC(KSPSetUp(krylov_.get()));
}

void LinearSolver::find_mass() {
    const HeapGrowth grown(&costs_.mass);
    for (const auto& level : levels_)
        if (level == levels_.front() || live_ || coarse_ == CoarseOperator::rediscretised)
            level->find_mass();
}

void LinearSolver::update_rotations(Vec u) {
    if (fine().strain() != StrainModel::corotated) return;
    const PhaseTimer timer(costs_.rotations);
    fine().update_rotations(u);
}

void LinearSolver::assemble_levels(const Configuration& at, double s, double m, Tangent tangent) {
    fine().assemble(s, m, tangent, at);
    if (kind_ != SolverKind::multigrid) return;
    for (std::size_t l = 0; l < transfers_.size(); ++l) {
        if (coarse_ == CoarseOperator::rediscretised) {
            Vec coarse = displacements_[l].get();
            transfers_[l]->restrict_displacement(l == 0 ? at.u : displacements_[l - 1].get(),
                                                 coarse);
            update_ghosts(coarse);
            levels_[l + 1]->update_rotations(coarse);
            levels_[l + 1]->assemble(s, m, Tangent::held_rotation, {.u = coarse});
        } else {
            const bool first = galerkin_.size() <= l;
            if (first) galerkin_.emplace_back();
            Mat A = l == 0 ? fine().matrix() : galerkin_[l - 1].get();
            Mat product = galerkin_[l].get();
            LIVETET_PETSC(MatPtAP(A, transfers_[l]->interpolation(),
                                  first ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX, 2, &product));
            if (first) galerkin_[l] = PetscHandle<Mat>::adopt(product);
            add_identity(product, levels_[l + 1]->share(), components_[l + 1]);
        }
    }
    set_level_operators();
}

bool LinearSolver::cycles() const {
    PC pc = nullptr;
    PetscBool multigrid = PETSC_FALSE;
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), PCMG, &multigrid));
    return multigrid;
}

void LinearSolver::set_level_operators() {
    if (!cycles()) return;
    const auto matrix = [&](std::size_t l) {
        return l > 0 && coarse_ == CoarseOperator::galerkin ? galerkin_[l - 1].get()
                                                            : levels_[l]->matrix();
    };
    for (std::size_t l = 0; l + 1 < levels_.size(); ++l) {
        LIVETET_PETSC(KSPSetOperators(smoothers_[l], matrix(l), matrix(l)));
        LIVETET_PETSC(KSPSetOperators(coarse_solves_[l], matrix(l + 1), matrix(l + 1)));
    }
}

bool LinearSolver::set_bounds() {
    bounds_known_ = true;
    if (!cycles()) return true;
    bool good = true;
    const auto bound = [&](KSP chebyshev, PC by, double low) {
        Mat A = nullptr;
        LIVETET_PETSC(KSPGetOperators(chebyshev, &A, nullptr));
        double high = 1.1 * largest_eigenvalue(A, by);
        if (!(high > 0.1 &&
              high < 1e4)) {  // one of at least 1 and some tens at most, as it should be
            good = false;
            high = 4;
        }
        LIVETET_PETSC(KSPChebyshevSetEigenvalues(chebyshev, high, low * high));
    };
    for (KSP smoother : smoothers_) bound(smoother, nullptr, 0.05);
    for (std::size_t l = coarse_solves_.size() - 1; l-- > 0;) {  // each cycles by the ones below it
        PC below = nullptr;
        LIVETET_PETSC(KSPGetPC(coarse_solves_[l], &below));
        bound(coarse_solves_[l], below, 0.2);
    }
    return good;
}

bool LinearSolver::start_from(std::span<const Vec> guesses, Vec b) {
    if (!rest_)
        for (PetscHandle<Vec>* v : {&rest_, &start_, &images_[0], &images_[1]})
            *v = make_vector(fine().share());
    // Fischer 1998, with images by the operator as it is now: the minimum of |x - sum c_i g_i| in
    // energy.
    const std::size_t count = std::min<std::size_t>(guesses.size(), max_guesses);
    for (std::size_t i = 0; i < count; ++i)
        LIVETET_PETSC(MatMult(displacement_matrix(), guesses[i], images_[i].get()));
    Eigen::Matrix2d gram = Eigen::Matrix2d::Identity();
    Eigen::Vector2d work = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
        const Vec others[] = {b, images_[0].get(), images_[1].get()};
        PetscScalar dots[3] = {};
        LIVETET_PETSC(VecMDot(guesses[i], static_cast<PetscInt>(1 + count), others, dots));
        work[i] = dots[0];
        for (std::size_t j = 0; j < count; ++j) gram(i, j) = dots[1 + j];
    }
    if (count == 2) gram(0, 1) = gram(1, 0) = (gram(0, 1) + gram(1, 0)) / 2;
    for (std::size_t i = 0; i < count; ++i) gram(i, i) = gram(i, i) * (1 + 1e-6) + 1e-300;
    const Eigen::Vector2d share = gram.inverse() * work;
    const bool of_use = share.allFinite() && work.dot(share) > 0;
    const Eigen::Vector2d c = of_use ? share : Eigen::Vector2d::Zero();
    const auto array = [&](std::span<const Vec> vectors, std::size_t i) {
        return i < count ? vectors[i] : b;
    };
    const Vec images[] = {images_[0].get(), images_[1].get()};
    const ReadArray from(b), g0(array(guesses, 0)), g1(array(guesses, 1)), i0(array(images, 0)),
        i1(array(images, 1));
    WriteArray start(start_.get()), rest(rest_.get());
    team_.run_pieces(rest.span().size(), 1000, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            start[i] = c[0] * g0[i] + c[1] * g1[i];
            rest[i] = from[i] - c[0] * i0[i] - c[1] * i1[i];
        }
    });
    return of_use;
}

LinearReport LinearSolver::solve(Vec b_u, Vec b_p, Vec x_u, Vec x_p, const LinearControls& effort,
                                 std::span<const Vec> guesses) {
    KSP ksp = coupling_ ? saddle_.get() : krylov_.get();
    // What PETSc's options say goes before what the step asks for.
    const double tolerance = asked_tolerance_.value_or(effort.relative_tolerance);
    const int most = asked_iterations_.value_or(effort.max_iterations);
    LIVETET_PETSC(KSPSetTolerances(ksp, tolerance, asked_residual_, PETSC_DEFAULT, most));
    LinearReport report;
    if (coupling_) {
        MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(ksp));
        Vec b_parts[2] = {b_u, b_p}, x_parts[2] = {x_u, x_p};
        PetscHandle<Vec> b, x;
        LIVETET_PETSC(VecCreateNest(comm, 2, nullptr, b_parts, b.out()));
        LIVETET_PETSC(VecCreateNest(comm, 2, nullptr, x_parts, x.out()));
        LIVETET_PETSC(VecScale(b_p, -1));  // B du - C dp = -g
        LIVETET_PETSC(VecSet(x.get(), 0));
        LIVETET_PETSC(KSPSolve(ksp, b.get(), x.get()));
        LIVETET_PETSC(VecScale(x_p, coupling_->scale()));
        LIVETET_PETSC(VecScale(b_p, -1));  // as it was given
    } else {
        PetscReal size = 0;
        LIVETET_PETSC(VecNorm(b_u, NORM_2, &size));
        const bool started = !guesses.empty() && start_from(guesses, b_u);
        stopping_->begin({tolerance, most, effort.deadline},
                         std::max(tolerance * size, asked_residual_));
        LIVETET_PETSC(KSPSolve(ksp, started ? rest_.get() : b_u, x_u));
        if (started) LIVETET_PETSC(VecAXPY(x_u, 1, start_.get()));
        report.error = stopping_->error();
    }
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    PetscInt iterations = 0;
    LIVETET_PETSC(KSPGetConvergedReason(ksp, &reason));
    LIVETET_PETSC(KSPGetIterationNumber(ksp, &iterations));
    LIVETET_PETSC(KSPGetResidualNorm(ksp, &report.residual));
    LIVETET_PETSC(KSPGetConvergedReasonString(ksp, &report.reason));
    report.iterations = static_cast<int>(iterations);
    report.converged = reason > 0 && reason != KSP_CONVERGED_ITS;
    report.cut_short = reason == KSP_CONVERGED_ITS || reason == KSP_DIVERGED_ITS;
    return report;
}

std::string LinearSolver::name() const {
    KSPType krylov = nullptr;
    PCType preconditioner = nullptr;
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetType(coupling_ ? saddle_.get() : krylov_.get(), &krylov));
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PCGetType(pc, &preconditioner));
    std::string text =
        fmt::format("{} + {}", krylov ? krylov : "?", preconditioner ? preconditioner : "?");
    if (kind_ == SolverKind::live)
        return fmt::format("{} + multigrid in single precision, {} levels, rediscretised",
                           krylov ? krylov : "?", level_count());
    if (kind_ == SolverKind::multigrid)
        text += fmt::format(", {} levels, {}", level_count(),
                            coarse_ == CoarseOperator::galerkin ? "galerkin" : "rediscretised");
    return text;
}

}  // namespace livetet
