#include "solvers/linear/displacement_solver.hpp"

#include <Eigen/Dense>

#include <cmath>

#include "solvers/linear/stopping_test.hpp"

namespace livetet {

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

DisplacementSolver::DisplacementSolver(const DistributedHierarchy& mesh, Role role,
                                       ThreadTeam& team)
    : LinearSolver(mesh.tets), team_(team), role_(role) {}

DisplacementSolver::~DisplacementSolver() = default;

void DisplacementSolver::add_level(DistributedHierarchy& mesh, const ElasticModel& model,
                                   LevelStorage storage) {
    const std::size_t l = levels_.size();
    DistributedHierarchy::Level& level = mesh.levels[l];
    const bool is_mixed = level.share.hexahedra.empty()
                              ? role_ == Role::preconditioner
                              : resolved_formulation(model) == Formulation::mixed;
    std::vector<Material> materials(model.materials.begin(), model.materials.end());
    if (is_mixed)
        for (Material& m : materials) {
            if (m.poisson <= 0)
                fail(
                    "materials: poisson = {} in the mixed form, expected above 0 (formulation: "
                    "displacement)",
                    m.poisson);
            if (l == 0) continue;
            m.young_Pa = 2 * m.mu();
            m.poisson = 0;
        }
    PhaseCost& cost = l == 0 ? costs_.elements : costs_.coarse_levels;
    cost += level.cost;
    const HeapMeter meter(&cost);
    levels_.push_back(std::make_unique<LevelAssembler>(
        std::move(level.share), materials, model.strain,
        l == 0 && is_mixed ? Formulation::mixed : Formulation::displacement, storage, team_));
    if (l > 0) return;
    costs_.matrix.bytes = fine().matrix_bytes();
    costs_.elements.bytes -= costs_.matrix.bytes;
}

void DisplacementSolver::make_krylov(MPI_Comm comm, ErrorEstimate estimate) {
    LIVETET_PETSC(KSPCreate(comm, krylov_.out()));
    KSP ksp = krylov_.get();
    if (role_ == Role::preconditioner) {
        LIVETET_PETSC(KSPSetOptionsPrefix(ksp, prefix().c_str()));
        LIVETET_PETSC(KSPSetType(ksp, KSPPREONLY));
    } else {
        read_user_tolerances();
        LIVETET_PETSC(KSPSetType(ksp, KSPCG));
        LIVETET_PETSC(KSPSetNormType(ksp, KSP_NORM_UNPRECONDITIONED));
        stopping_ = std::make_unique<StoppingTest>(team_, estimate);
        stopping_->install(ksp);
    }
    LIVETET_PETSC(KSPSetOperators(ksp, matrix(), matrix()));
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp, &pc));
    configure(pc);
    take_options(ksp);
    if (fine().matrix() && !preconditions_by(PCMG)) fine().set_rigid_motions();
}

bool DisplacementSolver::preconditions_by(PCType type) const {
    PC pc = nullptr;
    PetscBool same = PETSC_FALSE;
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(pc), type, &same));
    return same;
}

bool DisplacementSolver::start_from(std::span<const Unknowns> guesses, Vec b) {
    if (!rest_)
        for (PetscHandle<Vec>* v : {&rest_, &start_, &images_[0], &images_[1]})
            *v = make_vector(fine().share());
    // By hand: KSPGuess drops its vectors when the operator changes. Kept from doing so, in 60
    // frames of a pressed block KSPGUESSFISCHER of size 2 takes 330 to 340 iterations, for it
    // restarts when full; KSPGUESSPOD takes 181; this takes 179, and no guess 682.
    // Fischer 1998: c minimises |x - sum c_i g_i| in the energy norm of the present operator.
    const std::size_t count = std::min<std::size_t>(guesses.size(), max_guesses);
    for (std::size_t i = 0; i < count; ++i)
        LIVETET_PETSC(MatMult(matrix(), guesses[i].u, images_[i].get()));
    Eigen::Matrix2d gram = Eigen::Matrix2d::Identity();
    Eigen::Vector2d work = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
        const Vec others[] = {b, images_[0].get(), images_[1].get()};
        PetscScalar dots[3] = {};
        LIVETET_PETSC(VecMDot(guesses[i].u, static_cast<PetscInt>(1 + count), others, dots));
        work[i] = dots[0];
        for (std::size_t j = 0; j < count; ++j) gram(i, j) = dots[1 + j];
    }
    if (count == 2) gram(0, 1) = gram(1, 0) = (gram(0, 1) + gram(1, 0)) / 2;
    for (std::size_t i = 0; i < count; ++i) gram(i, i) = gram(i, i) * (1 + 1e-6) + 1e-300;
    const Eigen::Vector2d share = gram.inverse() * work;
    // A frame searches along no line: its guesses must not lead uphill.
    const bool positive =
        !stopping_->watches_curvature() || (gram(0, 0) > 0 && gram.determinant() > 0);
    const bool of_use = positive && share.allFinite() && work.dot(share) > 0;
    const Eigen::Vector2d c = of_use ? share : Eigen::Vector2d::Zero();
    const auto guess = [&](std::size_t i) { return i < count ? guesses[i].u : b; };
    const auto image = [&](std::size_t i) { return i < count ? images_[i].get() : b; };
    const ReadArray from(b), g0(guess(0)), g1(guess(1)), i0(image(0)), i1(image(1));
    WriteArray start(start_.get()), rest(rest_.get());
    team_.run_pieces(rest.span().size(), 1000, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            start[i] = c[0] * g0[i] + c[1] * g1[i];
            rest[i] = from[i] - c[0] * i0[i] - c[1] * i1[i];
        }
    });
    return of_use;
}

LinearReport DisplacementSolver::solve(Vec b, Vec /*b_p*/, Vec x, Vec /*x_p*/,
                                       const LinearControls& controls,
                                       std::span<const Unknowns> guesses) {
    const LinearControls asked = set_tolerances(controls);
    PetscReal size = 0;
    LIVETET_PETSC(VecNorm(b, NORM_2, &size));
    const bool started = !guesses.empty() && start_from(guesses, b);
    stopping_->begin(asked, std::max(asked.relative_tolerance * size, user_residual_));
    Vec right_side = started ? rest_.get() : b;
    PetscInt iterations = 0;
    LIVETET_PETSC(KSPSolve(krylov_.get(), right_side, x));
    LIVETET_PETSC(KSPGetIterationNumber(krylov_.get(), &iterations));
    const int more = go_on(right_side, x);
    if (started) LIVETET_PETSC(VecAXPY(x, 1, start_.get()));
    LinearReport report;
    report.error = stopping_->end();
    finish_report(krylov_.get(), report);
    report.iterations = static_cast<int>(iterations) + more;
    return report;
}

bool DisplacementSolver::apply_factorisation(Mat B, Mat X) {
    if (role_ != Role::solver || !preconditions_by(PCCHOLESKY)) return false;
    set_up_preconditioner();
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PCMatApply(pc, B, X));
    return true;
}

int DisplacementSolver::go_on(Vec b, Vec x) {
    KSP ksp = krylov_.get();
    int more = 0;
    for (;;) {
        KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
        PetscInt iterations = 0;
        LIVETET_PETSC(KSPGetConvergedReason(ksp, &reason));
        LIVETET_PETSC(KSPGetIterationNumber(ksp, &iterations));
        if (reason >= 0 || !change_preconditioner(reason)) return more;
        set_up_preconditioner();
        stopping_->resume(static_cast<int>(iterations));
        PetscReal size = 0;
        LIVETET_PETSC(VecNorm(x, NORM_2, &size));
        if (!std::isfinite(size) || stopping_->is_curved_down())  // x may lead uphill
            LIVETET_PETSC(VecSet(x, 0));
        PetscBool nonzero = PETSC_FALSE;
        LIVETET_PETSC(KSPGetInitialGuessNonzero(ksp, &nonzero));
        LIVETET_PETSC(KSPSetInitialGuessNonzero(ksp, PETSC_TRUE));
        LIVETET_PETSC(KSPSolve(ksp, b, x));
        LIVETET_PETSC(KSPSetInitialGuessNonzero(ksp, nonzero));
        LIVETET_PETSC(KSPGetIterationNumber(ksp, &iterations));
        more += static_cast<int>(iterations);
    }
}

std::string DisplacementSolver::preconditioner_name() const {
    PC pc = nullptr;
    PCType type = nullptr;
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PCGetType(pc, &type));
    return type ? type : "?";
}

std::string DisplacementSolver::name() const {
    KSPType krylov = nullptr;
    LIVETET_PETSC(KSPGetType(krylov_.get(), &krylov));
    return fmt::format("{} + {}", krylov ? krylov : "?", preconditioner_name());
}

}  // namespace livetet
