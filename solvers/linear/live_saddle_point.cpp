#include "solvers/linear/live_saddle_point.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <numeric>

namespace livetet {

LiveSaddlePoint::LiveSaddlePoint(LiveSolver& inner, PressureCoupling& coupling,
                                 PetscHandle<KSP> schur)
    : inner_(inner), coupling_(coupling), schur_(std::move(schur)) {
    displacements_ = static_cast<std::size_t>(3 * inner.fine().share().owned);
    LIVETET_PETSC(MatCreateVecs(coupling.minus_c(), q_.out(), cq_.out()));
    no_pressures_.resize(ReadArray(q_.get()).span().size());
    image_.resize(displacements_ + no_pressures_.size());
    force_.resize(displacements_);
    const auto n = static_cast<PetscInt>(image_.size());
    MPI_Comm comm = inner.fine().share().comm;
    LIVETET_PETSC(MatCreateShell(comm, n, n, n, n, this, matrix_.out()));
    const auto multiply = [](Mat A, Vec x, Vec y) noexcept -> PetscErrorCode {
        return in_callback([&] {
            LiveSaddlePoint* self = nullptr;
            LIVETET_PETSC(MatShellGetContext(A, static_cast<void*>(&self)));
            const ReadArray from(x);
            WriteArray to(y);
            self->multiply(from.span(), to.span());
        });
    };
    LIVETET_PETSC(MatShellSetOperation(
        matrix_.get(), MATOP_MULT,
        reinterpret_cast<void (*)()>(static_cast<PetscErrorCode (*)(Mat, Vec, Vec)>(multiply))));
    LIVETET_PETSC(MatCreateVecs(matrix_.get(), start_.out(), rest_.out()));
    for (auto& v : guesses_) LIVETET_PETSC(VecDuplicate(start_.get(), v.out()));
    for (auto& v : images_) LIVETET_PETSC(VecDuplicate(start_.get(), v.out()));
}

void LiveSaddlePoint::configure(PC pc) {
    LIVETET_PETSC(PCSetType(pc, PCSHELL));
    LIVETET_PETSC(PCShellSetName(pc, "block triangle of the live cycle and a pressure mass"));
    LIVETET_PETSC(PCShellSetContext(pc, this));
    const auto apply = [](PC shell, Vec r, Vec z) noexcept -> PetscErrorCode {
        return in_callback([&] {
            LiveSaddlePoint* self = nullptr;
            LIVETET_PETSC(PCShellGetContext(shell, static_cast<void*>(&self)));
            const ReadArray from(r);
            WriteArray to(z);
            self->precondition(from.span(), to.span());
        });
    };
    LIVETET_PETSC(PCShellSetApply(pc, apply));
}

void LiveSaddlePoint::precondition(std::span<const double> r, std::span<double> z) {
    const auto z_p = z.subspan(displacements_);
    LIVETET_PETSC(VecPlaceArray(cq_.get(), r.subspan(displacements_).data()));
    LIVETET_PETSC(VecPlaceArray(q_.get(), z_p.data()));
    LIVETET_PETSC(KSPSolve(schur_.get(), cq_.get(), q_.get()));
    LIVETET_PETSC(VecResetArray(cq_.get()));
    LIVETET_PETSC(VecResetArray(q_.get()));
    coupling_.matrix_free()->multiply_transposed(z_p, force_);
    for (std::size_t i = 0; i < displacements_; ++i) force_[i] = r[i] - force_[i];
    inner_.cycle(force_, z.first(displacements_));
}

void LiveSaddlePoint::multiply(std::span<const double> x, std::span<double> y) {
    const auto q = x.subspan(displacements_);
    const auto g = y.subspan(displacements_);
    inner_.multiply_mixed(*coupling_.matrix_free(), x.first(displacements_), q,
                          y.first(displacements_), g);
    LIVETET_PETSC(VecPlaceArray(q_.get(), q.data()));
    LIVETET_PETSC(MatMult(coupling_.minus_c(), q_.get(), cq_.get()));
    LIVETET_PETSC(VecResetArray(q_.get()));
    const ReadArray c(cq_.get());
    for (std::size_t i = 0; i < g.size(); ++i) g[i] += c[i];
}

bool LiveSaddlePoint::start_from(std::span<const Unknowns> guesses, Vec b) {
    const std::size_t count = std::min<std::size_t>(guesses.size(), max_guesses);
    for (std::size_t k = 0; k < count; ++k) {
        {
            const ReadArray u(guesses[k].u), p(guesses[k].p);
            WriteArray x(guesses_[k].get());
            std::copy(u.span().begin(), u.span().end(), x.span().begin());
            for (std::size_t i = 0; i < no_pressures_.size(); ++i)
                x[displacements_ + i] = p[i] / coupling_.scale();
        }
        LIVETET_PETSC(MatMult(matrix_.get(), guesses_[k].get(), images_[k].get()));
    }
    // Least squares: the normal equations of two unknowns.
    Eigen::Matrix2d gram = Eigen::Matrix2d::Identity();
    Eigen::Vector2d along = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
        LIVETET_PETSC(VecDot(b, images_[i].get(), &along[static_cast<Eigen::Index>(i)]));
        for (std::size_t j = 0; j <= i; ++j) {
            PetscScalar dot = 0;
            LIVETET_PETSC(VecDot(images_[i].get(), images_[j].get(), &dot));
            gram(i, j) = gram(j, i) = dot;
        }
        gram(i, i) = gram(i, i) * (1 + 1e-6) + 1e-300;
    }
    const Eigen::Vector2d c = gram.inverse() * along;
    if (!c.allFinite() || !(along.dot(c) > 0)) return false;
    LIVETET_PETSC(VecCopy(b, rest_.get()));
    LIVETET_PETSC(VecSet(start_.get(), 0));
    for (std::size_t k = 0; k < count; ++k) {
        const double weight = c[static_cast<Eigen::Index>(k)];
        LIVETET_PETSC(VecAXPY(start_.get(), weight, guesses_[k].get()));
        LIVETET_PETSC(VecAXPY(rest_.get(), -weight, images_[k].get()));
    }
    return true;
}

bool LiveSaddlePoint::is_curved_down(std::span<const double> x) {
    const auto u = x.first(displacements_), q = x.subspan(displacements_);
    const auto Ku = std::span(image_).first(displacements_),
               Bu = std::span(image_).subspan(displacements_);
    const auto dot = [](std::span<const double> a, std::span<const double> b) {
        return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
    };
    inner_.multiply_mixed(*coupling_.matrix_free(), u, no_pressures_, Ku, Bu);
    LIVETET_PETSC(VecPlaceArray(q_.get(), q.data()));
    LIVETET_PETSC(MatMult(coupling_.minus_c(), q_.get(), cq_.get()));
    LIVETET_PETSC(VecResetArray(q_.get()));
    const double of_volume = dot(q, Bu), qCq = -dot(q, ReadArray(cq_.get()).span());
    return dot(u, Ku) + (qCq > 0 ? of_volume * of_volume / qCq : 0) < 0;
}

}  // namespace livetet
