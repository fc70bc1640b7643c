#include "solvers/linear/stopping_test.hpp"

#include <algorithm>
#include <cmath>

#include "base/piece_sums.hpp"

namespace livetet {

bool is_too_slow(int iterations, double reduction) {
    constexpr int first_judged = 10;
    constexpr double allowance = 100;
    return iterations >= first_judged && reduction > allowance * std::pow(1e-8, iterations / 40.0);
}

void StoppingTest::install(KSP ksp) {
    PetscBool other = PETSC_FALSE;
    LIVETET_PETSC(PetscOptionsHasName(nullptr, nullptr, "-ksp_convergence_test", &other));
    if (other) return;
    const auto test = [](KSP k, PetscInt iteration, PetscReal residual, KSPConvergedReason* reason,
                         void* self) noexcept -> PetscErrorCode {
        return in_callback([&] {
            *reason =
                static_cast<StoppingTest*>(self)->reason(k, static_cast<int>(iteration), residual);
        });
    };
    LIVETET_PETSC(KSPSetConvergenceTest(ksp, test, this, nullptr));
}

void StoppingTest::begin(const LinearControls& controls, double allowed_residual) {
    begun_ = true;
    controls_ = controls;
    allowed_ = allowed_residual;
    steps_[0] = steps_[1] = 0;
    if (previous_) LIVETET_PETSC(VecSet(previous_.get(), 0));
    if (controls.deadline) last_ = controls.deadline->now();
}

void StoppingTest::resume(int iterations) {
    resumed_ = true;
    controls_.max_iterations = std::max(1, controls_.max_iterations - iterations);
}

KSPConvergedReason StoppingTest::reason(KSP ksp, int iteration, double residual) {
    if (!begun_ && !resumed_ && iteration == 0) {
        PetscReal relative = 0, absolute = 0;
        PetscInt iterations = 0;
        LIVETET_PETSC(KSPGetTolerances(ksp, &relative, &absolute, nullptr, &iterations));
        controls_ = {.relative_tolerance = relative,
                     .max_iterations = static_cast<int>(iterations)};
        allowed_ = std::max(relative * residual, absolute);
    }
    const bool measures = begun_ && iteration > 0 && estimate_ == ErrorEstimate::from_steps;
    return judge(iteration, residual, measures ? measure_step(ksp) : 0);
}

KSPConvergedReason StoppingTest::judge(int iteration, double residual, double step) {
    if (!std::isfinite(residual)) return KSP_DIVERGED_NANORINF;
    if (iteration == 0) first_ = residual;
    if (negative_ && iteration == 0) *negative_ = false;
    if (is_curved_down()) return KSP_DIVERGED_INDEFINITE_MAT;
    resumed_ = false;
    if (iteration > 0) {
        steps_[0] = steps_[1];
        steps_[1] = step;
    }
    if (residual <= allowed_) {
        if (residual <= 0.01 * first_) watched_ = false;  // this preconditioner will do
        return KSP_CONVERGED_RTOL;
    }
    if (iteration >= controls_.max_iterations) return KSP_DIVERGED_ITS;
    if (watched_ && !controls_.deadline && is_too_slow(iteration, residual / first_))
        return KSP_DIVERGED_BREAKDOWN;
    if (controls_.deadline && iteration > 0) {
        const auto now = controls_.deadline->now();
        const double next_s = 1.5 * std::chrono::duration<double>(now - last_).count();
        last_ = now;
        if (next_s > controls_.deadline->left_s(now)) return KSP_CONVERGED_ITS;
    }
    return KSP_CONVERGED_ITERATING;
}

double StoppingTest::measure_step(KSP ksp) {
    Vec now = nullptr;
    LIVETET_PETSC(KSPBuildSolution(ksp, nullptr, &now));
    if (!previous_) {
        LIVETET_PETSC(VecDuplicate(now, previous_.out()));
        LIVETET_PETSC(VecSet(previous_.get(), 0));
    }
    const ReadArray x(now);
    WriteArray y(previous_.get());
    const std::size_t size = y.span().size();
    const double sum = sum_in_pieces(team_, size, [&](std::size_t begin, std::size_t end) {
        double of_piece = 0;
        for (std::size_t i = begin; i < end; ++i) {
            const double step = x[i] - y[i];
            of_piece += step * step;
            y[i] = x[i];
        }
        return of_piece;
    });
    return std::sqrt(sum / (static_cast<double>(size) / 3));
}

double StoppingTest::end() {
    begun_ = false;
    if (steps_[0] > 0) ratio_ += 0.2 * (std::clamp(steps_[1] / steps_[0], 0.05, 0.8) - ratio_);
    return steps_[1] * ratio_ / (1 - ratio_);
}

}  // namespace livetet
