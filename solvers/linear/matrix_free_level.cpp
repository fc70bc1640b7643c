#include "solvers/linear/matrix_free_level.hpp"

#include "solvers/linear/shells.hpp"

namespace livetet {

namespace {

/// Where the smoother's interval begins, as a share of its end (see docs/theory/multigrid.md).
constexpr double lowest_smoothed = 0.04;

}  // namespace

MatrixFreeLevel::MatrixFreeLevel(LevelAssembler& level, int smoothing_steps)
    : level_(level),
      positive_(level, ThreadTeam::alone()),
      smoother_(positive_, smoothing_steps, lowest_smoothed),
      x_(level.make_vector()),
      f_(level.make_vector()),
      matrix_(make_shell_matrix<&MatrixFreeLevel::multiply>(
          level.share().comm, static_cast<PetscInt>(positive_.components()), *this)) {}

void MatrixFreeLevel::precondition(PC pc, KSP coarse, const Transfer& transfer) {
    pc_ = pc;
    coarse_ = coarse;
    transfer_ = &transfer;
    make_shell_preconditioner<&MatrixFreeLevel::cycle>(pc, *this, "multigrid, finest matrix-free");
    const auto set_up = [](PC shell) noexcept -> PetscErrorCode {
        return in_callback([&] {
            void* self = nullptr;
            LIVETET_PETSC(PCShellGetContext(shell, &self));
            KSP coarse_solver = static_cast<MatrixFreeLevel*>(self)->coarse_;
            PC below = nullptr;
            PCFailedReason failure = PC_NOERROR;
            LIVETET_PETSC(KSPSetUp(coarse_solver));
            LIVETET_PETSC(KSPGetPC(coarse_solver, &below));
            LIVETET_PETSC(PCGetFailedReason(below, &failure));
            LIVETET_PETSC(PCSetFailedReason(shell, failure));
        });
    };
    LIVETET_PETSC(PCShellSetSetUp(pc, set_up));
}

void MatrixFreeLevel::set_constrained() { positive_.set_constrained(); }

void MatrixFreeLevel::set_springs() { positive_.renew_diagonal(); }

void MatrixFreeLevel::update(const Configuration& at, const OperatorTerms& terms) {
    terms_ = terms;
    at_ = at;
    if (!level_.rotates()) {  // K is the same anywhere, and kept for longer than `at`
        if (fixed_.batches.empty()) fixed_ = level_.make_rotations();
        at_ = {.u = x_.get(), .rotations = &fixed_};
    }
    level_.round_rotations(*at_.rotations, rotations_);
    positive_.update(rotations_, terms.whole_stiffness(), terms.mass);
    smoother_.find_bound();
    // Tells PETSc that it is another operator, so that preconditioners are set up anew.
    LIVETET_PETSC(MatAssemblyBegin(matrix_.get(), MAT_FINAL_ASSEMBLY));
    LIVETET_PETSC(MatAssemblyEnd(matrix_.get(), MAT_FINAL_ASSEMBLY));
}

void MatrixFreeLevel::multiply(std::span<const double> x, std::span<double> y) {
    const auto free = positive_.free();
    const auto mass = level_.node_mass(), springs = level_.springs();
    {
        WriteArray masked(x_.get());
        for (std::size_t i = 0; i < x.size(); ++i) masked[i] = free[i] != 0 ? x[i] : 0;
    }
    update_ghosts(x_.get());
    level_.tangent_times(terms_.stiffness, terms_.tangent, at_, x_.get(), f_.get());
    if (terms_.damping != 0) level_.add_damping_times(terms_.damping, x_.get(), f_.get());
    const ReadArray f(f_.get());
    for (std::size_t i = 0; i < y.size(); ++i) {
        const double shift = (terms_.mass != 0 ? terms_.mass * mass[i / 3] : 0) +
                             (springs.empty() ? 0 : springs[i / 3]);
        y[i] = free[i] != 0 ? f[i] + shift * x[i] : x[i];
    }
}

void MatrixFreeLevel::correct() {
    Mat P = transfer_->interpolation();
    if (!r_) {
        LIVETET_PETSC(MatCreateVecs(P, coarse_r_.out(), r_.out()));
        LIVETET_PETSC(VecDuplicate(coarse_r_.get(), coarse_z_.out()));
    }
    {
        WriteArray r(r_.get());
        smoother_.visit_residual([&](std::size_t i, float of_i) { r[i] = of_i; });
    }
    LIVETET_PETSC(MatMultTranspose(P, r_.get(), coarse_r_.get()));
    LIVETET_PETSC(KSPSolve(coarse_, coarse_r_.get(), coarse_z_.get()));
    LIVETET_PETSC(KSPCheckSolve(coarse_, pc_, coarse_z_.get()));
    LIVETET_PETSC(MatMult(P, coarse_z_.get(), r_.get()));
    const ReadArray z(r_.get());
    std::vector<float>& x = smoother_.x();
    for (std::size_t i = 0; i < z.span().size(); ++i) x[i] += static_cast<float>(z[i]);
}

void MatrixFreeLevel::cycle(std::span<const double> r, std::span<double> z) {
    const auto free = positive_.free();
    std::vector<float>&b = smoother_.b(), &x = smoother_.x();
    for (std::size_t i = 0; i < r.size(); ++i) b[i] = free[i] * static_cast<float>(r[i]);
    smoother_.smooth(true);
    correct();
    smoother_.smooth(false);
    for (std::size_t i = 0; i < z.size(); ++i) z[i] = free[i] != 0 ? x[i] : r[i];
}

}  // namespace livetet
