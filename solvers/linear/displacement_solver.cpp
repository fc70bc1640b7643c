#include "solvers/linear/displacement_solver.hpp"

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
    : LinearSolver(mesh.tets),
      team_(team),
      earlier_(EarlierSolves::Nearness::energy, team),
      role_(role) {}

DisplacementSolver::~DisplacementSolver() = default;

void DisplacementSolver::add_level(DistributedHierarchy& mesh, const ElasticModel& model,
                                   LevelStorage storage) {
    const std::size_t l = levels_.size();
    DistributedHierarchy::Level& level = mesh.levels[l];
    // HexSolver, of role `solver`, has the pressures eliminated.
    const bool is_mixed =
        role_ == Role::preconditioner ||
        (!level.share.hexahedra.empty() && resolved_formulation(model) == Formulation::mixed);
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

LinearReport DisplacementSolver::solve(Vec b, Vec /*b_p*/, Vec x, Vec /*x_p*/,
                                       const LinearControls& controls, LinearStart start) {
    const LinearControls asked = set_tolerances(controls);
    PetscReal size = 0;
    LIVETET_PETSC(VecNorm(b, NORM_2, &size));
    const bool goes_on = start == LinearStart::earlier_solves;
    const bool started = goes_on && earlier_.find_start(matrix(), b);
    stopping_->begin(asked, std::max(asked.relative_tolerance * size, user_residual_));
    begin_solve(started);
    Vec right_side = started ? earlier_.rest() : b;
    PetscInt iterations = 0;
    LIVETET_PETSC(KSPSolve(krylov_.get(), right_side, x));
    LIVETET_PETSC(KSPGetIterationNumber(krylov_.get(), &iterations));
    const int more = go_on(right_side, x);
    if (started) LIVETET_PETSC(VecAXPY(x, 1, earlier_.start()));
    if (goes_on) find_image(b, x, more == 0);
    LinearReport report;
    report.error = stopping_->end();
    finish_report(krylov_.get(), report);
    report.iterations = static_cast<int>(iterations) + more;
    return report;
}

void DisplacementSolver::find_image(Vec b, Vec x, bool is_whole_solve) {
    if (!image_) LIVETET_PETSC(VecDuplicate(x, image_.out()));
    PetscBool is_cg = PETSC_FALSE;
    LIVETET_PETSC(
        PetscObjectTypeCompare(reinterpret_cast<PetscObject>(krylov_.get()), KSPCG, &is_cg));
    if (!is_cg || !is_whole_solve) {
        LIVETET_PETSC(MatMult(matrix(), x, image_.get()));
        return;
    }
    Vec residual = nullptr;  // CG has it; PETSc asks for a second vector, which CG does not touch
    LIVETET_PETSC(KSPBuildResidual(krylov_.get(), earlier_.start(), image_.get(), &residual));
    LIVETET_PETSC(VecAYPX(image_.get(), -1, b));
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
