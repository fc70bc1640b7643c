#include "solvers/linear/multigrid_solver.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/log.hpp"
#include "solvers/assembly/batch_support.hpp"
#include "solvers/linear/lanczos_bound.hpp"

namespace livetet {

namespace {

/// Whether conjugate gradients ended within an iteration: the operator or its preconditioner is not
/// positive, or nothing is left.
bool breaks_down(KSPConvergedReason reason) {
    return reason == KSP_DIVERGED_INDEFINITE_MAT || reason == KSP_DIVERGED_INDEFINITE_PC ||
           reason == KSP_CONVERGED_ATOL;
}

// Not KSPChebyshevEstEig, which takes the bounds anew from each operator: on an organ of 60,000
// tets (P1 and P2) with as many steps of the same method, linear solves took 1.2 to 1.6 times as
// long in as many iterations. Here they are taken once for given constraints.

/// The largest eigenvalue of A preconditioned by `by`, or by the 3x3 blocks of its diagonal where
/// that is null, from a few steps of conjugate gradients (Lanczos). Infinity if these end in
/// numbers that are not finite.
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
        WriteArray values(b.get());
        RoughValues rough;
        for (double& v : values.span()) v = rough.next();
    }
    LIVETET_PETSC(KSPSolve(ksp.get(), b.get(), x.get()));
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    LIVETET_PETSC(KSPGetConvergedReason(ksp.get(), &reason));
    if (breaks_down(reason)) {
        // PETSc counts the iteration that broke down, whose coefficients it never sets: whatever
        // the memory held was taken for them. All before it are made once more.
        PetscInt iterations = 0;
        LIVETET_PETSC(KSPGetIterationNumber(ksp.get(), &iterations));
        if (iterations < 2) return 2.0;
        LIVETET_PETSC(
            KSPSetTolerances(ksp.get(), 1e-10, PETSC_DEFAULT, PETSC_DEFAULT, iterations - 1));
        LIVETET_PETSC(KSPSolve(ksp.get(), b.get(), x.get()));
        LIVETET_PETSC(KSPGetConvergedReason(ksp.get(), &reason));
    }
    // PETSc looks for the eigenvalues of what is not finite without end.
    PetscReal residual = 0, size = 0;
    LIVETET_PETSC(KSPGetResidualNorm(ksp.get(), &residual));
    LIVETET_PETSC(VecNorm(x.get(), NORM_2, &size));
    if (reason == KSP_DIVERGED_NANORINF || !std::isfinite(residual + size))
        return std::numeric_limits<double>::infinity();
    PetscReal real[12], imaginary[12];
    PetscInt count = 0;
    LIVETET_PETSC(KSPComputeEigenvalues(ksp.get(), 12, real, imaginary, &count));
    return count > 0 ? *std::max_element(real, real + count) : 2.0;
}

/// Ones on the diagonal of constrained components, whose rows and columns P^T A P leaves empty.
void add_identity(Mat A, const PartitionedMesh& share, std::span<const std::uint8_t> components) {
    for (std::int32_t i = 0; i < share.owned; ++i)
        for (PetscInt c = 0; c < 3; ++c)
            if (components[i] >> c & 1)
                LIVETET_PETSC(MatSetValue(A, 3 * share.numbers[i] + c, 3 * share.numbers[i] + c,
                                          1.0, INSERT_VALUES));
    LIVETET_PETSC(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
}

}  // namespace

MultigridSolver::MultigridSolver(DistributedHierarchy mesh, const ElasticModel& model,
                                 const SolverOptions& options, Role role)
    : DisplacementSolver(mesh, role, ThreadTeam::alone()),
      asked_kind_(options.kind),
      asked_coarse_(options.coarse),
      coarse_(resolved_coarse(options.coarse, contrast_of(model.materials))),
      smoothing_steps_(options.smoothing_steps) {
    const std::size_t count = mesh.levels.size();
    const bool matrix_free = finest_is_matrix_free(model, options) && !options_want_matrix(count);
    if (smoothing_steps_ == 0) smoothing_steps_ = matrix_free ? 4 : 6;
    for (std::size_t l = 0; l < count; ++l) {
        // Galerkin products and factorisations take matrices of scalars.
        const bool blocks = coarse_ == CoarseOperator::rediscretised && l + 1 < count;
        const LevelStorage matrix = blocks ? MatrixLayout::blocks : MatrixLayout::scalars;
        add_level(mesh, model, l == 0 && matrix_free ? LevelStorage(BothPrecisions{}) : matrix);
    }
    make_coarse_levels(mesh);
    const HeapMeter meter(&costs_.preconditioner);
    if (matrix_free) matrix_free_ = std::make_unique<MatrixFreeLevel>(fine(), smoothing_steps_);
    make_krylov(mesh.comm, ErrorEstimate::none);
    if (preconditions_by(PCMG)) warn_of_idle_options();
    is_cycle_ = role == Role::solver && has_cycle();
    watch_convergence(is_watched());
}

MultigridSolver::~MultigridSolver() = default;

bool MultigridSolver::finest_is_matrix_free(const ElasticModel& model,
                                            const SolverOptions& options) {
    if (options.finest == FinestOperator::assembled ||
        resolved_formulation(model) == Formulation::mixed ||
        resolved_coarse(options.coarse, contrast_of(model.materials)) == CoarseOperator::galerkin)
        return false;
    std::vector<const ConstitutiveModel*> models;
    for (const Material& m : model.materials)
        models.push_back(&*(m.model ? m.model : model.strain));
    return why_not_batched(false, false, models).empty();
}

bool MultigridSolver::options_want_matrix(std::size_t levels) const {
    char* all = nullptr;
    LIVETET_PETSC(PetscOptionsGetAll(nullptr, &all));
    const std::string given = all;
    LIVETET_PETSC(PetscFree(all));
    const auto names = [&](const std::string& option) {
        return given.find(fmt::format("-{}{}", prefix(), option));
    };
    for (const std::string& option :
         {std::string("pc_type"), std::string("pc_mg_"), fmt::format("mg_levels_{}_", levels - 1)})
        if (names(option) != std::string::npos) return true;
    // PETSc takes an option without a number for all levels.
    for (const char letter : std::string("abcdefghijklmnopqrstuvwxyz"))
        if (names(std::string("mg_levels_") + letter) != std::string::npos) return true;
    return false;
}

void MultigridSolver::make_coarse_levels(DistributedHierarchy& mesh) {
    costs_.coarse_levels += mesh.cost_of_between;
    const HeapMeter meter(&costs_.coarse_levels);
    constraints_.emplace(std::move(mesh.between));
    for (std::size_t l = 1; l < levels_.size(); ++l) {
        CoarseLevel& coarse = coarse_levels_.emplace_back();
        coarse.transfer = std::make_unique<Transfer>(levels_[l - 1]->share(), levels_[l]->share(),
                                                     constraints_->rows(l - 1));
        coarse.u = make_vector(levels_[l]->share());
        coarse.rotations = levels_[l]->make_rotations();
    }
}

void MultigridSolver::set_prefix(KSP ksp, const std::string& name) const {
    LIVETET_PETSC(KSPSetOptionsPrefix(ksp, (prefix() + name).c_str()));
}

void MultigridSolver::warn_of_idle_options() const {
    int rank = 0;
    MPI_Comm_rank(levels_.front()->share().comm, &rank);
    for (const char* option : {"-pc_mg_levels", "-pc_mg_cycle_type"}) {
        PetscBool given = PETSC_FALSE;
        LIVETET_PETSC(PetscOptionsHasName(nullptr, prefix().c_str(), option, &given));
        if (given && rank == 0)
            log_warning(
                fmt::format("PETSc option -{}{} changes nothing: levels and cycle are the "
                            "hierarchy's; expected solver.smoothing_steps, or "
                            "-mg_levels_ options",
                            prefix(), option + 1));
    }
}

void MultigridSolver::configure_cycle(PC pc, std::size_t l) {
    const std::size_t number = levels_.size() - 1 - l;  // PETSc counts from the coarsest
    LIVETET_PETSC(PCSetType(pc, PCMG));
    LIVETET_PETSC(PCMGSetLevels(pc, 2, nullptr));
    LIVETET_PETSC(PCMGSetGalerkin(pc, PC_MG_GALERKIN_NONE));
    LIVETET_PETSC(PCMGSetInterpolation(pc, 1, coarse_levels_[l].transfer->interpolation()));
    KSP smoother = nullptr, coarse = nullptr;
    PC block_jacobi = nullptr;
    LIVETET_PETSC(PCMGGetSmoother(pc, 1, &smoother));
    set_prefix(smoother, fmt::format("mg_levels_{}_", number));
    LIVETET_PETSC(KSPSetType(smoother, KSPCHEBYSHEV));
    LIVETET_PETSC(
        KSPSetTolerances(smoother, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, smoothing_steps_));
    LIVETET_PETSC(KSPGetPC(smoother, &block_jacobi));
    LIVETET_PETSC(PCSetType(block_jacobi, PCPBJACOBI));
    LIVETET_PETSC(PCMGGetCoarseSolve(pc, &coarse));
    configure_coarse(coarse, l);
    smoothers_.insert(smoothers_.begin(), smoother);
}

void MultigridSolver::configure(PC pc) {
    if (!matrix_free_) return configure_cycle(pc, 0);
    LIVETET_PETSC(KSPCreate(fine().share().comm, first_coarse_.out()));
    configure_coarse(first_coarse_.get(), 0);
    take_options(first_coarse_.get());
    smoothers_.insert(smoothers_.begin(), nullptr);
    matrix_free_->precondition(pc, first_coarse_.get(), *coarse_levels_.front().transfer);
}

void MultigridSolver::configure_coarse(KSP coarse, std::size_t l) {
    const std::size_t number = levels_.size() - 1 - l;
    PC below = nullptr;
    LIVETET_PETSC(KSPGetPC(coarse, &below));
    if (number > 1) {
        set_prefix(coarse, fmt::format("mg_cycles_{}_", number - 1));
        LIVETET_PETSC(KSPSetType(coarse, KSPCHEBYSHEV));
        LIVETET_PETSC(KSPSetNormType(coarse, KSP_NORM_NONE));
        LIVETET_PETSC(KSPSetConvergenceTest(coarse, KSPConvergedSkip, nullptr, nullptr));
        LIVETET_PETSC(
            KSPSetTolerances(coarse, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, cycles_below));
        configure_cycle(below, l + 1);
    } else {
        configure_coarsest(coarse, below);
    }
    coarse_solves_.insert(coarse_solves_.begin(), coarse);
}

void MultigridSolver::configure_coarsest(KSP coarse, PC pc) {
    set_prefix(coarse, "mg_coarse_");
    LIVETET_PETSC(KSPSetType(coarse, KSPPREONLY));
    LIVETET_PETSC(PCSetType(pc, fine().share().ranks > 1 ? PCREDUNDANT : PCLU));
}

void MultigridSolver::set_constrained(std::span<const std::uint8_t> components) {
    constraints_->set_constrained(levels_, components);
    for (std::size_t l = 0; l < coarse_levels_.size(); ++l)
        coarse_levels_[l].transfer->set_constrained(levels_[l]->share(), levels_[l]->constrained(),
                                                    levels_[l + 1]->constrained());
    if (matrix_free_) matrix_free_->set_constrained();
    bounds_known_ = false;
    invalidate();
}

void MultigridSolver::set_springs(std::span<const double> stiffness) {
    constraints_->set_springs(levels_, stiffness);
    if (matrix_free_) matrix_free_->set_springs();
    invalidate();
}

void MultigridSolver::find_mass() {
    timed_mass([&] {
        for (const auto& level : levels_)
            if (level == levels_.front() || coarse_ == CoarseOperator::rediscretised)
                level->find_mass();
    });
}

RenewalExtent MultigridSolver::renew(const Configuration& at, const OperatorTerms& terms,
                                     RenewalExtent /*wanted*/) {
    may_be_negative_ = terms.tangent == Tangent::exact && !fine().is_linear();
    if (!bounds_known_ && !substitute_) {
        // Mass only lowers the largest eigenvalue of D^-1 A: bounds of the stiffness alone hold for
        // any time step.
        OperatorTerms massless = terms;
        massless.mass = 0;
        assemble_levels(at, massless);
        if (set_bounds()) {
            if (terms.mass == 0) return RenewalExtent::whole;
        } else {  // an exact tangent far from rest need not be positive, and then gives no bound
            massless.tangent = Tangent::frozen_rotation;
            assemble_levels(at, massless);
            (void)set_bounds();
        }
    }
    assemble_levels(at, terms);
    return RenewalExtent::whole;
}

void MultigridSolver::assemble_levels(const Configuration& at, const OperatorTerms& terms) {
    if (matrix_free_) matrix_free_->update(at, terms);
    if (fine().matrix()) fine().assemble(at, terms);
    if (substitute_) return substitute_->set_matrix(scalar_matrix());
    for (std::size_t l = 0; l < coarse_levels_.size(); ++l) {
        if (coarse_ == CoarseOperator::galerkin) {
            form_galerkin_product(l);
            continue;
        }
        CoarseLevel& coarse = coarse_levels_[l];
        Vec u = coarse.u.get();
        coarse.transfer->restrict_displacement(l == 0 ? at.u : coarse_levels_[l - 1].u.get(), u);
        update_ghosts(u);
        levels_[l + 1]->update_rotations(u, coarse.rotations);
        levels_[l + 1]->assemble({.u = u, .rotations = &coarse.rotations},
                                 {.stiffness = terms.whole_stiffness(), .mass = terms.mass});
    }
    set_level_operators();
}

Mat MultigridSolver::scalar_matrix() {
    if (!fine().matrix()) {
        fine().make_matrix(MatrixLayout::scalars);
        fine().assemble(matrix_free_->at(), matrix_free_->terms());
    }
    return scalars_.update(fine().matrix());
}

void MultigridSolver::form_galerkin_product(std::size_t l) {
    CoarseLevel& coarse = coarse_levels_[l];
    const bool first = !coarse.galerkin;
    Mat product = coarse.galerkin.get();
    LIVETET_PETSC(MatPtAP(l == 0 ? scalar_matrix() : level_matrix(l),
                          coarse.transfer->interpolation(),
                          first ? MAT_INITIAL_MATRIX : MAT_REUSE_MATRIX, 2, &product));
    if (first) coarse.galerkin = PetscHandle<Mat>::adopt(product);
    add_identity(product, levels_[l + 1]->share(), levels_[l + 1]->constrained());
}

Mat MultigridSolver::level_matrix(std::size_t l) const {
    return l > 0 && coarse_ == CoarseOperator::galerkin ? coarse_levels_[l - 1].galerkin.get()
                                                        : levels_[l]->matrix();
}

void MultigridSolver::set_level_operators() {
    if (!has_cycle()) return;
    for (std::size_t l = 0; l + 1 < levels_.size(); ++l) {
        if (smoothers_[l])
            LIVETET_PETSC(KSPSetOperators(smoothers_[l], level_matrix(l), level_matrix(l)));
        LIVETET_PETSC(KSPSetOperators(coarse_solves_[l], level_matrix(l + 1), level_matrix(l + 1)));
    }
}

bool MultigridSolver::set_bounds() {
    bounds_known_ = true;
    if (!has_cycle()) return true;
    bool good = true;
    const auto bound = [&](KSP chebyshev, PC by, double low) {
        Mat A = nullptr;
        LIVETET_PETSC(KSPGetOperators(chebyshev, &A, nullptr));
        double high = 1.1 * largest_eigenvalue(A, by);
        if (!(high > 0.1 && high < 1e4)) {  // expected: from 1 to some tens
            good = false;
            high = 4;
        }
        LIVETET_PETSC(KSPChebyshevSetEigenvalues(chebyshev, high, low * high));
    };
    for (KSP smoother : smoothers_)
        if (smoother) bound(smoother, nullptr, 0.05);
    for (std::size_t l = coarse_solves_.size() - 1; l-- > 0;) {  // needs the bounds below it
        PC below = nullptr;
        LIVETET_PETSC(KSPGetPC(coarse_solves_[l], &below));
        bound(coarse_solves_[l], below, 0.2);
    }
    return good;
}

MultigridSolver::Change MultigridSolver::next_change() {
    if (substitute_)
        return substitute_->method() == MatrixMethod::factorisation ? Change::aggregation
                                                                    : Change::none;
    if (asked_kind_ != SolverKind::automatic)
        return galerkin_is_left() ? Change::galerkin : Change::none;
    if (replaced_.empty()) {
        Mat A = scalar_matrix();
        if (is_affordable(A, estimate_factorisation(A),
                          FactorisationLimit::rather_than_slow_cycles))
            return Change::factorisation;
    }
    return galerkin_is_left() ? Change::galerkin : Change::aggregation;
}

void MultigridSolver::make_change(Change change) {
    if (change == Change::galerkin) {
        coarse_ = CoarseOperator::galerkin;
        for (std::size_t l = 0; l < coarse_levels_.size(); ++l) form_galerkin_product(l);
        set_level_operators();
        set_bounds();
    } else {
        PC pc = nullptr;
        LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
        (void)scalar_matrix();  // made before it is told of rigid motions, copied after
        fine().set_rigid_motions();
        substitute_ = std::make_unique<MatrixPreconditioner>(pc,
                                                             change == Change::factorisation
                                                                 ? MatrixMethod::factorisation
                                                                 : MatrixMethod::aggregation,
                                                             prefix() + "substitute_");
        substitute_->set_matrix(scalar_matrix());
    }
    renew_preconditioner();
}

bool MultigridSolver::change_preconditioner(KSPConvergedReason reason) {
    const bool is_indefinite = reason == KSP_DIVERGED_INDEFINITE_PC && !may_be_negative_;
    const bool is_slow = reason == KSP_DIVERGED_BREAKDOWN;
    if (!is_cycle_ || !(is_indefinite || is_slow || reason == KSP_DIVERGED_PC_FAILED)) return false;
    const Change change = next_change();
    if (change == Change::none) return false;
    PetscInt iterations = 0;
    LIVETET_PETSC(KSPGetIterationNumber(krylov_.get(), &iterations));
    const std::string before = preconditioner_name();
    make_change(change);
    replaced_ = before;
    watch_convergence(is_watched());
    int rank = 0;
    MPI_Comm_rank(fine().share().comm, &rank);
    if (rank == 0)
        log_warning(fmt::format(
            "solver: {} in place of {}: {}", cycle_name(), before,
            is_slow ? fmt::format("its coarse levels do not fit the body ({} iterations brought "
                                  "too little)",
                                  iterations)
                    : fmt::format("its coarse levels do not fit the body ({})",
                                  is_indefinite ? "it is indefinite" : "it could not be set up")));
    return true;
}

std::string MultigridSolver::cycle_name() const {
    if (substitute_) return name_of(substitute_->method());
    return fmt::format(
        "{}, {} levels, {}{}", matrix_free_ ? "mg" : DisplacementSolver::preconditioner_name(),
        level_count(), coarse_ == CoarseOperator::galerkin ? "galerkin" : "rediscretised",
        matrix_free_ ? ", finest matrix-free" : "");
}

std::string MultigridSolver::preconditioner_name() const {
    return replaced_.empty() ? cycle_name()
                             : fmt::format("{} in place of {}", cycle_name(), replaced_);
}

}  // namespace livetet
