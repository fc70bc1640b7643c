#include "solvers/linear/live_saddle_point.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <numeric>

#include "solvers/linear/shells.hpp"
#include "solvers/linear/unknown_parts.hpp"

namespace livetet {

LiveSaddlePoint::LiveSaddlePoint(LiveSolver& inner, PressureCoupling& coupling,
                                 PetscHandle<KSP> schur)
    : inner_(inner), coupling_(coupling), schur_(std::move(schur)) {
    displacements_ = static_cast<std::size_t>(3 * inner.fine().share().owned);
    const PetscInt pressures = coupling.matrix_free()->pressures();
    image_.resize(displacements_ + static_cast<std::size_t>(pressures));
    force_.resize(displacements_);
    const auto first = static_cast<PetscInt>(displacements_);
    MPI_Comm comm = inner.fine().share().comm;
    matrix_ = make_shell_matrix<&LiveSaddlePoint::multiply>(comm, first + pressures, *this);
    LIVETET_PETSC(ISCreateStride(comm, first, 0, 1, displacement_rows_.out()));
    LIVETET_PETSC(ISCreateStride(comm, pressures, first, 1, pressure_rows_.out()));
    LIVETET_PETSC(MatCreateVecs(coupling.minus_c(), q_.out(), cq_.out()));
    LIVETET_PETSC(MatCreateVecs(matrix_.get(), start_.out(), rest_.out()));
    for (auto& v : guesses_) LIVETET_PETSC(VecDuplicate(start_.get(), v.out()));
    for (auto& v : images_) LIVETET_PETSC(VecDuplicate(start_.get(), v.out()));
}

void LiveSaddlePoint::configure(PC pc) {
    make_shell_preconditioner<&LiveSaddlePoint::precondition>(
        pc, *this, "block triangle of the live cycle and a pressure mass");
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
    multiply_minus_c(q);
    const ReadArray c(cq_.get());
    for (std::size_t i = 0; i < g.size(); ++i) g[i] += c[i];
}

void LiveSaddlePoint::multiply_minus_c(std::span<const double> q) {
    LIVETET_PETSC(VecPlaceArray(q_.get(), q.data()));
    LIVETET_PETSC(MatMult(coupling_.minus_c(), q_.get(), cq_.get()));
    LIVETET_PETSC(VecResetArray(q_.get()));
}

bool LiveSaddlePoint::start_from(std::span<const Unknowns> guesses, Vec b) {
    const std::size_t count = std::min<std::size_t>(guesses.size(), max_guesses);
    for (std::size_t k = 0; k < count; ++k) {
        join(guesses[k].u, guesses[k].p, guesses_[k].get());
        {
            WriteArray x(guesses_[k].get());
            for (double& p : x.span().subspan(displacements_)) p /= coupling_.scale();
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
    inner_.multiply_mixed(*coupling_.matrix_free(), u, {}, Ku, Bu);
    multiply_minus_c(q);
    const double of_volume = dot(q, Bu), qCq = -dot(q, ReadArray(cq_.get()).span());
    return dot(u, Ku) + (qCq > 0 ? of_volume * of_volume / qCq : 0) < 0;
}

}  // namespace livetet
