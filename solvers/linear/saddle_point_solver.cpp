#include "solvers/linear/saddle_point_solver.hpp"

#include <algorithm>
#include <cmath>

#include "base/piece_sums.hpp"
#include "solvers/linear/live_saddle_point.hpp"
#include "solvers/linear/unknown_parts.hpp"

namespace livetet {

namespace {

/// Iterations of FGMRES before it forgets its directions, in live frames.
constexpr int live_restart = 30;

/// Two Chebyshev steps on S, scaled by its diagonal.
void configure_schur_steps(KSP ksp) {
    constexpr double largest = 2.5, smallest = 0.5;  // see PressureCoupling::minus_schur
    constexpr int steps = 2;
    LIVETET_PETSC(KSPSetType(ksp, KSPCHEBYSHEV));
    LIVETET_PETSC(KSPChebyshevSetEigenvalues(ksp, largest, smallest));
    LIVETET_PETSC(KSPSetNormType(ksp, KSP_NORM_NONE));
    LIVETET_PETSC(KSPSetTolerances(ksp, PETSC_DEFAULT, PETSC_DEFAULT, PETSC_DEFAULT, steps));
    PC of_steps = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp, &of_steps));
    LIVETET_PETSC(PCSetType(of_steps, PCJACOBI));
}

/// The KSP around `pc` would apply the exact Schur complement, so the steps are those of a PCKSP,
/// which takes S.
void configure_schur_inverse(PC pc) {
    LIVETET_PETSC(PCSetType(pc, PCKSP));
    KSP ksp = nullptr;
    LIVETET_PETSC(PCKSPGetKSP(pc, &ksp));
    configure_schur_steps(ksp);
}

PetscHandle<KSP> make_schur_steps(Mat minus_schur) {
    PetscHandle<KSP> ksp;
    LIVETET_PETSC(
        KSPCreate(PetscObjectComm(reinterpret_cast<PetscObject>(minus_schur)), ksp.out()));
    LIVETET_PETSC(KSPSetOperators(ksp.get(), minus_schur, minus_schur));
    configure_schur_steps(ksp.get());
    return ksp;
}

}  // namespace

SaddlePointSolver::SaddlePointSolver(std::unique_ptr<DisplacementSolver> inner, ThreadTeam& team)
    : SaddlePointSolver{nullptr, std::move(inner), team} {}

SaddlePointSolver::SaddlePointSolver(std::unique_ptr<LiveSolver> inner, ThreadTeam& team)
    : SaddlePointSolver{inner.get(), std::move(inner), team} {}  // braces: from left to right

SaddlePointSolver::SaddlePointSolver(LiveSolver* live, std::unique_ptr<DisplacementSolver> inner,
                                     ThreadTeam& team)
    : LinearSolver(inner->tet_count()),
      inner_(std::move(inner)),
      stopping_(team, ErrorEstimate::none) {
    {
        const HeapMeter meter(&costs_.pressures);
        coupling_ = std::make_unique<PressureCoupling>(fine());
    }
    const HeapMeter meter(&costs_.preconditioner);
    if (live)
        live_ = std::make_unique<LiveSaddlePoint>(*live, *coupling_,
                                                  make_schur_steps(coupling_->minus_schur()));
    else
        make_blocks();
    LIVETET_PETSC(MatCreateVecs(matrix(), x_.out(), b_.out()));
    make_krylov(fine().share().comm);
}

void SaddlePointSolver::make_blocks() {
    LIVETET_PETSC(MatCreateTranspose(coupling_->b(), b_transposed_.out()));
    Mat blocks[4] = {inner_->inner_matrix(), b_transposed_.get(), coupling_->b(),
                     coupling_->minus_c()};
    LIVETET_PETSC(
        MatCreateNest(fine().share().comm, 2, nullptr, 2, nullptr, blocks, matrix_.out()));
    IS fields[2] = {nullptr, nullptr};
    LIVETET_PETSC(MatNestGetISs(matrix_.get(), fields, nullptr));
    fields_ = {fields[0], fields[1]};
}

SaddlePointSolver::~SaddlePointSolver() = default;

Mat SaddlePointSolver::matrix() const { return live_ ? live_->matrix() : matrix_.get(); }

UnknownFields SaddlePointSolver::fields() const { return live_ ? live_->fields() : fields_; }

void SaddlePointSolver::make_krylov(MPI_Comm comm) {
    read_user_tolerances();
    LIVETET_PETSC(KSPCreate(comm, krylov_.out()));
    KSP ksp = krylov_.get();
    LIVETET_PETSC(KSPSetType(ksp, KSPFGMRES));
    LIVETET_PETSC(KSPGMRESSetRestart(ksp, live_ ? live_restart : 60));
    LIVETET_PETSC(KSPSetOperators(ksp, matrix(), matrix()));
    stopping_.install(ksp);
    PC pc = nullptr;
    LIVETET_PETSC(KSPGetPC(ksp, &pc));
    if (live_) {  // frames allocate nothing
        LIVETET_PETSC(KSPGMRESSetPreAllocateVectors(ksp));
        live_->configure(pc);
        take_options(ksp);
        return;
    }
    LIVETET_PETSC(PCSetType(pc, PCFIELDSPLIT));
    LIVETET_PETSC(PCFieldSplitSetIS(pc, "displacement", fields_.displacement));
    LIVETET_PETSC(PCFieldSplitSetIS(pc, "pressure", fields_.pressure));
    LIVETET_PETSC(PCFieldSplitSetType(pc, PC_COMPOSITE_SCHUR));
    LIVETET_PETSC(PCFieldSplitSetSchurFactType(pc, PC_FIELDSPLIT_SCHUR_FACT_UPPER));
    LIVETET_PETSC(
        PCFieldSplitSetSchurPre(pc, PC_FIELDSPLIT_SCHUR_PRE_USER, coupling_->minus_schur()));
    take_options(ksp);
}

void SaddlePointSolver::connect_inner() {
    is_connected_ = true;
    PC pc = nullptr, of_part = nullptr;
    PCType type = nullptr;
    LIVETET_PETSC(KSPGetPC(krylov_.get(), &pc));
    LIVETET_PETSC(PCGetType(pc, &type));
    if (std::string_view(type) != PCFIELDSPLIT) return;  // the user's options chose another
    LIVETET_PETSC(KSPSetUp(krylov_.get()));
    PetscInt count = 0;
    KSP* parts = nullptr;
    LIVETET_PETSC(PCFieldSplitSchurGetSubKSP(pc, &count, &parts));
    LIVETET_PETSC(KSPSetType(parts[0], KSPPREONLY));
    LIVETET_PETSC(KSPGetPC(inner_->inner_krylov(), &of_part));
    LIVETET_PETSC(KSPSetPC(parts[0], of_part));
    LIVETET_PETSC(KSPSetType(parts[1], KSPPREONLY));
    LIVETET_PETSC(KSPGetPC(parts[1], &of_part));
    configure_schur_inverse(of_part);
    for (PetscInt i = 0; i < 2; ++i) take_options(parts[i]);
    LIVETET_PETSC(PetscFree(parts));
}

void SaddlePointSolver::set_constrained(std::span<const std::uint8_t> components) {
    inner_->set_constrained(components);
    coupling_->set_constrained();
    invalidate();
}

void SaddlePointSolver::set_springs(std::span<const double> stiffness) {
    inner_->set_springs(stiffness);
    invalidate();
}

RenewalExtent SaddlePointSolver::renew(const Configuration& at, const OperatorTerms& terms,
                                       RenewalExtent wanted) {
    const RenewalExtent renewed = inner_->renew_operators(at, terms, wanted);
    coupling_->assemble(at);
    if (live_) return renewed;
    LIVETET_PETSC(MatAssemblyBegin(matrix_.get(), MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(matrix_.get(), MAT_FINAL_ASSEMBLY));
    if (!is_connected_) connect_inner();
    return renewed;
}

LinearReport SaddlePointSolver::solve(Vec b_u, Vec b_p, Vec x_u, Vec x_p,
                                      const LinearControls& controls, LinearStart start) {
    const LinearControls asked = set_tolerances(controls);
    join(b_u, b_p, b_.get());
    {
        WriteArray b(b_.get());  // B du - C dp = -g
        const auto pressures = b.span().subspan(3 * static_cast<std::size_t>(fine().share().owned));
        for (double& g : pressures) g = -g;
    }
    LinearReport report;
    PetscReal size = 0;
    LIVETET_PETSC(VecNorm(b_.get(), NORM_2, &size));
    const double allowed = std::max(
        {asked.relative_tolerance * size, user_residual_, std::min(controls.enough, 0.5 * size)});
    const int iterations = live_ ? run_live(asked, allowed, start) : run(b_.get(), asked, allowed);
    finish_report(krylov_.get(), report);
    report.iterations = iterations;
    if (live_) report.error = error_of(report.residual, size);
    part(x_.get(), x_u, x_p);
    LIVETET_PETSC(VecScale(x_p, coupling_->scale()));
    return report;
}

int SaddlePointSolver::run(Vec b, const LinearControls& controls, double allowed) {
    PetscInt iterations = 0;
    LIVETET_PETSC(VecSet(x_.get(), 0));
    // Else the tolerances that PETSc was told hold, in the norm of the user's Krylov method.
    const bool is_judged = live_ || controls.deadline;
    if (is_judged) stopping_.begin(controls, allowed);
    LIVETET_PETSC(KSPSolve(krylov_.get(), b, x_.get()));
    if (is_judged) (void)stopping_.end();
    LIVETET_PETSC(KSPGetIterationNumber(krylov_.get(), &iterations));
    return static_cast<int>(iterations);
}

int SaddlePointSolver::run_live(const LinearControls& asked, double allowed, LinearStart start) {
    EarlierSolves& earlier = live_->earlier();
    const bool goes_on = start == LinearStart::earlier_solves;
    const bool started = goes_on && earlier.find_start(matrix(), b_.get());
    const int iterations = run(started ? earlier.rest() : b_.get(), asked, allowed);
    if (started) LIVETET_PETSC(VecAXPY(x_.get(), 1, earlier.start()));
    if (goes_on || live_->may_curve_down()) live_->find_image(x_.get());
    if (live_->may_curve_down() && live_->is_curved_down(ReadArray(x_.get()).span())) {
        live_->take_positive();
        // As many again, whatever the clock says: a replay, which is told their number, does the
        // same.
        (void)run(b_.get(), {asked.relative_tolerance, std::max(iterations, 1)}, allowed);
        if (goes_on) live_->find_image(x_.get());
    }
    return iterations;
}

void SaddlePointSolver::keep_solve(Vec /*x*/) {
    if (live_) live_->earlier().keep(x_.get(), live_->image());
}

void SaddlePointSolver::forget_solves() {
    if (live_) live_->earlier().clear();
}

double SaddlePointSolver::error_of(double residual, double size) {
    if (size <= 0) return 0;
    const auto nodes = static_cast<std::size_t>(fine().share().owned);
    const ReadArray x(x_.get());
    const auto u = x.span().first(3 * nodes);
    const double length = std::sqrt(dot_on_team(live_->team(), u.data(), u.data(), u.size()));
    return length / std::sqrt(nodes) * residual / size;
}

SolverCosts SaddlePointSolver::costs() const {
    SolverCosts all = inner_->costs();
    all.rotations += costs_.rotations;
    all.matrix += costs_.matrix;
    all.pressures += costs_.pressures;
    all.preconditioner += costs_.preconditioner;
    return all;
}

double SaddlePointSolver::bytes_of_update() const { return inner_->bytes_of_update(); }

double SaddlePointSolver::bytes_of_solve(double iterations) const {
    return inner_->bytes_of_solve(iterations);
}

std::string SaddlePointSolver::name() const {
    KSPType krylov = nullptr;
    LIVETET_PETSC(KSPGetType(krylov_.get(), &krylov));
    return fmt::format("{} + {}", krylov ? krylov : "?", inner_->preconditioner_name());
}

}  // namespace livetet
