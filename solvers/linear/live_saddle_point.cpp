#include "solvers/linear/live_saddle_point.hpp"

#include "base/piece_sums.hpp"
#include "solvers/linear/shells.hpp"
#include "solvers/linear/unknown_parts.hpp"

namespace livetet {

LiveSaddlePoint::LiveSaddlePoint(LiveSolver& inner, PressureCoupling& coupling,
                                 PetscHandle<KSP> schur)
    : inner_(inner),
      coupling_(coupling),
      schur_(std::move(schur)),
      earlier_(EarlierSolves::Nearness::residual, inner.team()) {
    displacements_ = static_cast<std::size_t>(3 * inner.fine().share().owned);
    const PetscInt pressures = coupling.matrix_free()->pressures();
    force_.resize(displacements_);
    const auto first = static_cast<PetscInt>(displacements_);
    MPI_Comm comm = inner.fine().share().comm;
    matrix_ = make_shell_matrix<&LiveSaddlePoint::multiply>(comm, first + pressures, *this);
    run_vectors_on_team<LiveSaddlePoint>(matrix_.get());
    LIVETET_PETSC(ISCreateStride(comm, first, 0, 1, displacement_rows_.out()));
    LIVETET_PETSC(ISCreateStride(comm, pressures, first, 1, pressure_rows_.out()));
    LIVETET_PETSC(MatCreateVecs(coupling.minus_c(), q_.out(), cq_.out()));
    LIVETET_PETSC(MatCreateVecs(matrix_.get(), nullptr, image_.out()));
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
    inner_.fine().over_components([&](std::size_t i) { force_[i] = r[i] - force_[i]; });
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

bool LiveSaddlePoint::is_curved_down(std::span<const double> x) {
    // image() = {K u + B^T q, B u - C q}
    const auto u = x.first(displacements_), q = x.subspan(displacements_);
    multiply_minus_c(q);
    const ReadArray image(image_.get()), minus_cq(cq_.get());
    const auto dot = [&](std::span<const double> a, std::span<const double> b) {
        return dot_on_team(team(), a.data(), b.data(), a.size());
    };
    const double qCq = -dot(q, minus_cq.span());
    const double qBu = dot(q, image.span().subspan(displacements_)) + qCq;
    const double uKu = dot(u, image.span().first(displacements_)) - qBu;
    return uKu + (qCq > 0 ? qBu * qBu / qCq : 0) < 0;
}

}  // namespace livetet
