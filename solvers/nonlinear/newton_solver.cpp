#include "solvers/nonlinear/newton_solver.hpp"

#include <algorithm>
#include <cmath>

#include "base/stopwatch.hpp"
#include "solvers/linear/unknown_parts.hpp"
#include "solvers/nonlinear/energy_search.hpp"
#include "solvers/nonlinear/line_search.hpp"

// Eisenstat and Walker's forcing terms. SNES calls these around its linear solves only where it
// made the KSP itself; they do nothing unless -snes_ksp_ew is given. PETSc exports them, but no
// header declares them.
extern "C" {
PetscErrorCode KSPPreSolve_SNESEW(KSP ksp, Vec b, Vec x, SNES snes);
PetscErrorCode KSPPostSolve_SNESEW(KSP ksp, Vec b, Vec x, SNES snes);
}

namespace livetet {

namespace {

/// Has SNES set the tolerances of `ksp` while it lives.
class ForcingTerms {
  public:
    ForcingTerms(KSP ksp, SNES snes) : ksp_(ksp) {
        const auto before = [](KSP k, Vec b, Vec x, void* s) {
            return KSPPreSolve_SNESEW(k, b, x, static_cast<SNES>(s));
        };
        const auto after = [](KSP k, Vec b, Vec x, void* s) {
            return KSPPostSolve_SNESEW(k, b, x, static_cast<SNES>(s));
        };
        LIVETET_PETSC(KSPSetPreSolve(ksp, before, snes));
        LIVETET_PETSC(KSPSetPostSolve(ksp, after, snes));
    }
    ~ForcingTerms() {
        KSPSetPreSolve(ksp_, nullptr, nullptr);
        KSPSetPostSolve(ksp_, nullptr, nullptr);
    }
    ForcingTerms(const ForcingTerms&) = delete;
    ForcingTerms& operator=(const ForcingTerms&) = delete;

  private:
    KSP ksp_;
};

/// Names the direction in which evaluate() finds the slope while this lives.
class Along {
  public:
    Along(Vec& place, Vec direction) : place_(place) { place_ = direction; }
    ~Along() { place_ = nullptr; }
    Along(const Along&) = delete;
    Along& operator=(const Along&) = delete;

  private:
    Vec& place_;
};

NewtonDirection direction_of(Tangent tangent) {
    return tangent == Tangent::positive ? NewtonDirection::positive
           : tangent == Tangent::exact  ? NewtonDirection::exact
                                        : NewtonDirection::frozen;
}

bool is_given(const char* option) {
    PetscBool given = PETSC_FALSE;
    LIVETET_PETSC(PetscOptionsHasName(nullptr, nullptr, option, &given));
    return given;
}

PetscHandle<Vec> make_unknown(const LinearSolver& solver) {
    if (!solver.is_mixed()) return solver.fine().make_vector();
    PetscHandle<Vec> x;
    LIVETET_PETSC(MatCreateVecs(solver.matrix(), x.out(), nullptr));
    return x;
}

}  // namespace

NewtonSolver::NewtonSolver(ForceBalance& balance, TimeIntegrator& time,
                           PrescribedMotion& prescribed, LinearSolver& solver, BodyState& state,
                           const SolverOptions& options)
    : balance_(balance),
      time_(time),
      prescribed_(prescribed),
      solver_(solver),
      state_(state),
      options_(options),
      pressures_(balance) {}

void NewtonSolver::make_snes(MPI_Comm comm) {
    x_ = make_unknown(solver_);
    f_ = make_unknown(solver_);
    LIVETET_PETSC(SNESCreate(comm, snes_.out()));
    du_ = solver_.fine().make_vector();
    if (state_.p) dp_ = solver_.fine().make_pressure_vector();
    SNES snes = snes_.get();
    LIVETET_PETSC(SNESSetKSP(snes, solver_.krylov({})));
    const auto function = [](SNES, Vec x, Vec f, void* self) noexcept -> PetscErrorCode {
        return in_callback([&] { static_cast<NewtonSolver*>(self)->evaluate(x, f); });
    };
    LIVETET_PETSC(SNESSetFunction(snes, f_.get(), function, this));
    const auto jacobian = [](SNES, Vec x, Mat, Mat, void* self) noexcept -> PetscErrorCode {
        return in_callback([&] { static_cast<NewtonSolver*>(self)->assemble(x); });
    };
    LIVETET_PETSC(SNESSetJacobian(snes, solver_.matrix(), solver_.matrix(), jacobian, this));
    const auto test = [](SNES s, PetscInt iteration, PetscReal x, PetscReal step, PetscReal f,
                         SNESConvergedReason* reason, void* context) noexcept -> PetscErrorCode {
        return in_callback([&] {
            auto& self = *static_cast<NewtonSolver*>(context);
            *reason = self.test(static_cast<int>(iteration), x, step, f);
            if (*reason == SNES_CONVERGED_ITERATING && self.has_user_tests_)
                LIVETET_PETSC(SNESConvergedDefault(s, iteration, x, step, f, reason, nullptr));
        });
    };
    LIVETET_PETSC(SNESSetConvergenceTest(snes, test, this, nullptr));
    // Zero, so that SNESConvergedDefault tests only the tolerances that the options set.
    LIVETET_PETSC(SNESSetTolerances(snes, 0, 0, 0, PETSC_DEFAULT, PETSC_MAX_INT));
    LIVETET_PETSC(SNESSetMaxLinearSolveFailures(snes, PETSC_MAX_INT));  // see mend_direction
    make_line_search();
    LIVETET_PETSC(SNESSetFromOptions(snes));
    has_user_tests_ = is_given("-snes_rtol") || is_given("-snes_atol") || is_given("-snes_stol");
    if (is_given("-snes_max_it")) {
        PetscInt limit = 0;
        LIVETET_PETSC(SNESGetTolerances(snes, nullptr, nullptr, nullptr, &limit, nullptr));
        user_limit_ = limit;
    }
    SNESLineSearch search = nullptr;
    PetscBool is_newton = PETSC_FALSE, is_ours = PETSC_FALSE;
    LIVETET_PETSC(SNESGetLineSearch(snes, &search));
    LIVETET_PETSC(
        PetscObjectTypeCompare(reinterpret_cast<PetscObject>(snes), SNESNEWTONLS, &is_newton));
    LIVETET_PETSC(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(search), SNESLINESEARCHSHELL,
                                         &is_ours));
    searches_lines_ = is_newton && is_ours;
    watch_linear_solver();
}

void NewtonSolver::watch_linear_solver() {
    const auto monitor = [](KSP, PetscInt iteration, PetscReal residual,
                            void* self) noexcept -> PetscErrorCode {
        return in_callback([&] {
            static_cast<NewtonSolver*>(self)->on_linear_iteration(static_cast<int>(iteration),
                                                                  residual);
        });
    };
    LIVETET_PETSC(KSPMonitorSet(solver_.krylov({}), monitor, this, nullptr));
}

void NewtonSolver::on_linear_iteration(int iteration, double residual) {
    if (!controls_.observe) return;
    if (iteration == 0) {
        first_residual_ = residual;
        return;
    }
    progress_.iterations = iteration;
    progress_.linear_residual = first_residual_ > 0 ? residual / first_residual_ : 0;
    controls_.observe(progress_);
}

void NewtonSolver::make_line_search() {
    SNESLineSearch search = nullptr;
    LIVETET_PETSC(SNESGetLineSearch(snes_.get(), &search));
    LIVETET_PETSC(SNESLineSearchSetType(search, SNESLINESEARCHSHELL));
    const auto apply = [](SNESLineSearch s, void* self) noexcept -> PetscErrorCode {
        return in_callback([&] { static_cast<NewtonSolver*>(self)->search_line(s); });
    };
    LIVETET_PETSC(SNESLineSearchShellSetUserFunc(search, apply, this));
    const auto check = [](SNESLineSearch s, Vec, Vec direction, PetscBool* changed,
                          void* self) noexcept -> PetscErrorCode {
        return in_callback([&] {
            Vec f = nullptr;
            LIVETET_PETSC(SNESLineSearchGetVecs(s, nullptr, &f, nullptr, nullptr, nullptr));
            *changed = static_cast<NewtonSolver*>(self)->mend_direction(f, direction) ? PETSC_TRUE
                                                                                      : PETSC_FALSE;
        });
    };
    LIVETET_PETSC(SNESLineSearchSetPreCheck(search, check, this));
}

StepReport NewtonSolver::solve(const SolveControls& controls) {
    if (!snes_) make_snes(solver_.fine().share().comm);
    controls_ = controls;
    old_tangents_ = controls.old_tangents;
    report_ = {};
    progress_ = {};
    Stopwatch watch;
    const double imbalance = balance_.evaluate();
    balance_.keep_scale();
    begin_pressures();
    report_.forces_s += watch.lap();
    if (!goes_on()) solver_.forget_solves();
    iterate(imbalance);
    if (pressures_.are_used() && !report_.converged && !is_time_up()) {
        controls_.linear_tolerance = controls.linear_tolerance;
        iterate(eliminate_pressures());
    }
    if (balance_.scale() > 0)
        report_.allowed_imbalance = balance_.allowed(controls_.tolerance) / balance_.scale();
    if (const char* fault = balance_.state_fault()) report_.drop(fault);
    controls_.observe = {};  // a frame's linear solves are not observed
    return report_;
}

void NewtonSolver::begin_pressures() {
    iterations_before_ = 0;
    pressures_.end();
    if (searches_lines_) pressures_.begin();  // only search_by_pressures knows how far they go
    if (!pressures_.are_used()) return;
    // An error of du makes one of lambda d theta : du in the pressures.
    constexpr double max_linear_tolerance = 1e-5;
    controls_.linear_tolerance = std::min(controls_.linear_tolerance, max_linear_tolerance);
    if (!start_) start_ = solver_.fine().make_vector();
    LIVETET_PETSC(VecCopy(state_.u.get(), start_.get()));
}

double NewtonSolver::eliminate_pressures() {
    pressures_.end();
    iterations_before_ = report_.newton_iterations;
    LIVETET_PETSC(VecCopy(start_.get(), state_.u.get()));
    balance_.update_rotations();
    return balance_.evaluate();
}

void NewtonSolver::iterate(double imbalance) {
    positive_steps_ = 0;
    const bool predicts = prescribed_.increment_size() != 0 ||
                          (solver_.fine().is_linear() && imbalance > balance_.negligible());
    if (!predicts || predict()) solve_by_snes();
}

bool NewtonSolver::predict() {
    const bool moves = prescribed_.increment_size() != 0;
    Stopwatch watch;
    const double imbalance = moves ? balance_.subtract_prescribed() : balance_.residual_norm();
    report_.forces_s += watch.lap();
    const LinearControls controls{controls_.linear_tolerance, options_.max_iterations, {}};
    const LinearStart start = goes_on() ? LinearStart::earlier_solves : LinearStart::zero;
    for (tangent_ = next_tangent();;) {
        assemble_operator();
        (void)watch.lap();  // it has counted its own time
        const LinearReport linear = solver_.solve(balance_.residual(), balance_.volume_residual(),
                                                  du_.get(), dp_.get(), controls, start);
        report_.solve_s += watch.lap();
        report_.iterations += linear.iterations;
        report_.linear_residual = imbalance > 0 ? linear.residual / imbalance : 0;
        const bool is_good = linear.converged && balance_.slope(du_.get(), dp_.get()) > 0;
        if (is_good || tangent_ != Tangent::exact) break;
        tangent_ = Tangent::positive;
        positive_steps_ = 2;
    }
    ++report_.newton_iterations;
    if (goes_on()) solver_.keep_solve(du_.get());
    if (moves) prescribed_.add_increment(du_.get());
    if (pressures_.are_used()) pressures_.step(du_.get());
    LIVETET_PETSC(VecAXPY(state_.u.get(), 1, du_.get()));
    if (state_.p) LIVETET_PETSC(VecAXPY(state_.p.get(), 1, dp_.get()));
    report_.finish_s += watch.lap();
    return !balance_.state_fault();
}

void NewtonSolver::set_tolerances() {
    PetscReal absolute = 0, relative = 0, step = 0;
    PetscInt evaluations = 0;
    LIVETET_PETSC(
        SNESGetTolerances(snes_.get(), &absolute, &relative, &step, nullptr, &evaluations));
    const int before = report_.newton_iterations - iterations_before_;
    PetscInt left = user_limit_ ? *user_limit_ : std::max(0, controls_.max_newton - before);
    if (pressures_.are_used())
        left = std::min(left, static_cast<PetscInt>(CellPressures::max_iterations));
    LIVETET_PETSC(SNESSetTolerances(snes_.get(), absolute, relative, step, left, evaluations));
}

double NewtonSolver::linear_tolerance(double residual) const {
    const double asked = controls_.linear_tolerance;
    const double last = 0.5 * balance_.allowed(controls_.tolerance) / residual;
    return last < 0.1 * asked ? asked : std::min(last, std::max(0.1, asked));
}

void NewtonSolver::solve_by_snes() {
    set_tolerances();
    const ForcingTerms terms(
        solver_.krylov({controls_.linear_tolerance, options_.max_iterations, {}}), snes_.get());
    copy_from_state();
    const double ours_before = report_.forces_s + report_.operator_s + report_.preconditioner_s;
    Stopwatch watch;
    LIVETET_PETSC(SNESSolve(snes_.get(), nullptr, x_.get()));
    const double ours =
        report_.forces_s + report_.operator_s + report_.preconditioner_s - ours_before;
    report_.solve_s += std::max(0.0, watch.lap() - ours);
    copy_to_state(x_.get());
    PetscInt iterations = 0, linear_iterations = 0;
    PetscReal residual = 0;
    SNESConvergedReason reason = SNES_CONVERGED_ITERATING;
    LIVETET_PETSC(SNESGetIterationNumber(snes_.get(), &iterations));
    LIVETET_PETSC(SNESGetLinearSolveIterations(snes_.get(), &linear_iterations));
    LIVETET_PETSC(SNESGetFunctionNorm(snes_.get(), &residual));
    LIVETET_PETSC(SNESGetConvergedReason(snes_.get(), &reason));
    LIVETET_PETSC(SNESGetConvergedReasonString(snes_.get(), &report_.reason));
    report_.newton_iterations += static_cast<int>(iterations);
    report_.iterations += static_cast<int>(linear_iterations);
    report_.converged = reason > 0;
    report_.imbalance = balance_.scale() > 0 ? residual / balance_.scale() : 0;
}

Tangent NewtonSolver::next_tangent() {
    if (options_.tangent == TangentChoice::frozen_rotation) return Tangent::frozen_rotation;
    if (positive_steps_ == 0) return Tangent::exact;
    --positive_steps_;
    return Tangent::positive;
}

void NewtonSolver::copy_from_state() {
    const UnknownParts x(solver_, x_.get());
    LIVETET_PETSC(VecCopy(state_.u.get(), x.u));
    if (!x.p) return;
    LIVETET_PETSC(VecCopy(state_.p.get(), x.p));
    LIVETET_PETSC(VecScale(x.p, 1 / solver_.coupling()->scale()));
}

void NewtonSolver::copy_to_state(Vec from) {
    const UnknownParts x(solver_, from);
    LIVETET_PETSC(VecCopy(x.u, state_.u.get()));
    if (x.p) {
        LIVETET_PETSC(VecCopy(x.p, state_.p.get()));
        LIVETET_PETSC(VecScale(state_.p.get(), solver_.coupling()->scale()));
    }
    balance_.update_rotations();
}

void NewtonSolver::evaluate(Vec x, Vec f) {
    Stopwatch watch;
    copy_to_state(x);
    if (along_)
        (void)balance_.evaluate_along(along_);
    else
        (void)balance_.evaluate();
    const UnknownParts to(solver_, f);
    LIVETET_PETSC(VecCopy(balance_.residual(), to.u));
    LIVETET_PETSC(VecScale(to.u, -1));
    if (to.p) LIVETET_PETSC(VecCopy(balance_.volume_residual(), to.p));
    report_.forces_s += watch.lap();
}

void NewtonSolver::assemble(Vec x) {
    Stopwatch watch;
    copy_to_state(x);  // PETSc's line searches may have evaluated another state last
    if (old_tangents_ > 0) {
        --old_tangents_;
        return;
    }
    report_.operator_s += watch.lap();
    tangent_ = next_tangent();
    assemble_operator();
}

void NewtonSolver::assemble_operator() {
    Stopwatch watch;
    {
        const AtCellPressures at(balance_, pressures_.get());
        balance_.assemble(tangent_);
    }
    report_.operator_s += watch.lap();
    solver_.set_up_preconditioner();
    report_.preconditioner_s += watch.lap();
}

SNESConvergedReason NewtonSolver::test(int iteration, double /*x_norm*/, double /*step_norm*/,
                                       double residual) {
    progress_.newton_iterations = report_.newton_iterations + iteration;
    progress_.imbalance = balance_.scale() > 0 ? residual / balance_.scale() : 0;
    if (!std::isfinite(residual) || balance_.state_fault()) return SNES_DIVERGED_FNORM_NAN;
    if (residual <= balance_.allowed(controls_.tolerance)) return SNES_CONVERGED_FNORM_ABS;
    if (is_time_up()) return SNES_DIVERGED_MAX_IT;
    (void)solver_.krylov({linear_tolerance(residual), options_.max_iterations, {}});
    return SNES_CONVERGED_ITERATING;
}

double NewtonSolver::slope(Vec f, Vec direction) const {
    // f = (-r, g), direction = -(du, dp / scale): r . du + g . dp / scale
    const UnknownParts force(solver_, f), step(solver_, direction);
    PetscScalar of_u = 0, of_p = 0;
    LIVETET_PETSC(VecDot(force.u, step.u, &of_u));
    if (force.p) LIVETET_PETSC(VecDot(force.p, step.p, &of_p));
    return of_u - of_p;
}

bool NewtonSolver::is_as_asked(KSP ksp, KSPConvergedReason reason, Vec f) const {
    PetscReal residual = 0;
    LIVETET_PETSC(KSPGetResidualNorm(ksp, &residual));
    return reason == KSP_DIVERGED_ITS && residual <= controls_.linear_tolerance * norm_of(f);
}

bool NewtonSolver::mend_direction(Vec f, Vec direction) {
    KSP ksp = nullptr;
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    LIVETET_PETSC(SNESGetKSP(snes_.get(), &ksp));
    const int with_another = solver_.go_on(f, direction);
    report_.iterations += with_another;
    LIVETET_PETSC(KSPGetConvergedReason(ksp, &reason));
    progress_.direction = direction_of(tangent_);
    if (tangent_ != Tangent::exact) return with_another > 0;
    const double falls = slope(f, direction);
    if ((reason > 0 || is_as_asked(ksp, reason, f)) && falls > 0) return with_another > 0;
    if (reason == KSP_DIVERGED_INDEFINITE_MAT && falls != 0 && std::isfinite(falls)) {
        // Where the first search direction has negative curvature, its step is a step back.
        if (falls < 0) LIVETET_PETSC(VecScale(direction, -1));
        progress_.direction = NewtonDirection::truncated;
        return true;
    }
    take_positive_direction(f, direction);
    return true;
}

void NewtonSolver::take_positive_direction(Vec f, Vec direction) {
    KSP ksp = nullptr;
    LIVETET_PETSC(SNESGetKSP(snes_.get(), &ksp));
    tangent_ = Tangent::positive;
    progress_.direction = NewtonDirection::positive;
    positive_steps_ = 2;
    assemble_operator();
    LIVETET_PETSC(KSPSolve(ksp, f, direction));
    PetscInt iterations = 0;
    LIVETET_PETSC(KSPGetIterationNumber(ksp, &iterations));
    report_.iterations += static_cast<int>(iterations) + solver_.go_on(f, direction);
}

/// x - length y, and f there; `trial` are the two at the length that was evaluated last.
struct NewtonSolver::Line {
    SNES snes = nullptr;
    Vec x = nullptr, f = nullptr, y = nullptr, x_trial = nullptr, f_trial = nullptr;
};

void NewtonSolver::go_to(const Line& line, double length) {
    LIVETET_PETSC(VecWAXPY(line.x_trial, -length, line.y, line.x));
    LIVETET_PETSC(SNESComputeFunction(line.snes, line.x_trial, line.f_trial));
}

double NewtonSolver::search_by_slope(const Line& line, double slope_before) {
    const double norm_before = norm_of(line.f);
    double length = 1;
    for (int trial = 1; trial < max_line_search_trials; ++trial) {
        const auto next = next_length(slope_before, slope(line.f_trial, line.y), norm_before,
                                      norm_of(line.f_trial), length);
        if (!next) break;
        go_to(line, length = *next);
    }
    return length;
}

double NewtonSolver::search_by_pressures(const Line& line) {
    Stopwatch watch;
    LIVETET_PETSC(VecCopy(line.y, du_.get()));
    LIVETET_PETSC(VecScale(du_.get(), -1));
    copy_to_state(line.x);
    const auto before = pressures_.aim(du_.get());
    double length = 1;
    for (int trial = 1;; ++trial) {
        LIVETET_PETSC(VecWAXPY(line.x_trial, -length, line.y, line.x));
        copy_to_state(line.x_trial);
        const auto after = pressures_.at(length);
        if (trial == max_line_search_trials) break;
        const auto next = next_length(before.slope, after.slope, before.norm, after.norm, length);
        if (!next) break;
        length = *next;
    }
    pressures_.take(length);
    report_.forces_s += watch.lap();
    go_to(line, length);  // the balance's scale is to be that of eliminated pressures
    return length;
}

std::optional<double> NewtonSolver::search_by_energy(const Line& line, double slope_before) {
    // With s = r . d and e = f_int . d, the loads' and the springs' part is s + e, affine in u.
    const Along along(along_, UnknownParts(solver_, line.y).u);  // -d
    const auto loads = [&](double slope) { return slope - balance_.elastic_along(); };
    go_to(line, 0);
    const double elastic_before = balance_.elastic_energy(), loads_before = loads(slope_before);
    constexpr double rounding = 1e-12;
    EnergySearch search(-slope_before,
                        rounding * (std::abs(elastic_before) + std::abs(loads_before)));
    double length = 1;
    for (;;) {
        go_to(line, length);
        const double s = slope(line.f_trial, line.y);
        const double energy =
            balance_.elastic_energy() - elastic_before - length / 2 * (loads_before + loads(s));
        const auto next = search.next({length, energy, -s});
        if (!next) break;
        length = *next;
    }
    const auto best = search.best();
    if (best && best->length != length) go_to(line, best->length);
    return best ? std::optional(best->length) : std::nullopt;
}

std::optional<double> NewtonSolver::find_length(const Line& line) {
    if (pressures_.are_used()) return search_by_pressures(line);
    for (;;) {
        const double before = slope(line.f, line.y);
        go_to(line, 1);
        if (norm_of(line.f_trial) <= 0.5 * norm_of(line.f)) return 1;
        const auto length = state_.p || !(before > 0) ? search_by_slope(line, before)
                                                      : search_by_energy(line, before);
        if (length || tangent_ != Tangent::exact) return length;
        take_positive_direction(line.f, line.y);
    }
}

// By hand: of the 160 cells of `bench stability --cells 2 --fine-cells 2` that are stepped as
// solve with neo-Hookean models, 9 fail with this search, with SNES's l2 10, bt 11, cp 13. Where
// no search is needed, as in presses of an organ, all take the same iterations.
void NewtonSolver::search_line(SNESLineSearch search) {
    Line line;
    PetscBool changed = PETSC_FALSE;
    LIVETET_PETSC(SNESLineSearchGetSNES(search, &line.snes));
    LIVETET_PETSC(
        SNESLineSearchGetVecs(search, &line.x, &line.f, &line.y, &line.x_trial, &line.f_trial));
    LIVETET_PETSC(SNESLineSearchPreCheck(search, line.x, line.y, &changed));
    const std::optional<double> length = find_length(line);
    if (!length) {
        LIVETET_PETSC(SNESLineSearchSetReason(search, SNES_LINESEARCH_FAILED_REDUCT));
        return;
    }
    progress_.step_length = *length;
    LIVETET_PETSC(VecCopy(line.x_trial, line.x));
    LIVETET_PETSC(VecCopy(line.f_trial, line.f));
    LIVETET_PETSC(SNESLineSearchSetLambda(search, *length));
    LIVETET_PETSC(SNESLineSearchSetNorms(search, norm_of(line.x), norm_of(line.f),
                                         *length * norm_of(line.y)));
}

}  // namespace livetet
