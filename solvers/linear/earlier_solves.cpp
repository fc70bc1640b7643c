#include "solvers/linear/earlier_solves.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

namespace {

/// Components that are summed one after the other: sums of pieces of fixed length have the same
/// bits on any number of threads.
constexpr std::size_t piece = 1536;

/// Least number of components for which a further thread is woken.
constexpr std::size_t grain = 1000;

/// A solution is left out if newer ones leave of it at most a part of its square in G. That is as
/// much as A changed, as the last combination showed, within these bounds: along the rest the
/// change outweighs the solution. Where A stays, rounding to float bounds what can be told apart.
constexpr double min_rest = 1e-6, max_rest = 1e-2;

/// x . v, in eight sums, which fill a vector register.
double dot(const float* x, const double* v, std::size_t count) {
    double sums[8] = {};
    std::size_t i = 0;
    for (; i + 8 <= count; i += 8)
        for (std::size_t k = 0; k < 8; ++k) sums[k] += static_cast<double>(x[i + k]) * v[i + k];
    for (; i < count; ++i) sums[0] += static_cast<double>(x[i]) * v[i];
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])) +
           ((sums[4] + sums[5]) + (sums[6] + sums[7]));
}

void round_to(std::vector<float>& to, Vec from) {
    const ReadArray values(from);
    std::ranges::transform(values.span(), to.begin(),
                           [](double v) { return static_cast<float>(v); });
}

}  // namespace

EarlierSolves::Numbers EarlierSolves::products_with(Vec v) {
    const ReadArray values(v);
    const std::size_t size = values.span().size(), pieces = (size + piece - 1) / piece;
    piece_sums_.resize(pieces * max_solutions);
    team_.run_pieces(pieces, 1, [&](std::size_t first, std::size_t last) {
        for (std::size_t k = first; k < last; ++k)
            for (int i = 0; i < count_; ++i)
                piece_sums_[k * max_solutions + i] =
                    dot(tests()[i].data() + k * piece, values.span().data() + k * piece,
                        std::min(piece, size - k * piece));
    });
    Numbers sums = Numbers::Zero();
    for (std::size_t k = 0; k < pieces; ++k)
        for (int i = 0; i < count_; ++i) sums[i] += piece_sums_[k * max_solutions + i];
    MPI_Comm comm = PetscObjectComm(reinterpret_cast<PetscObject>(v));
    sum_over_ranks(comm, {sums.data(), max_solutions});
    return sums;
}

EarlierSolves::Numbers EarlierSolves::shares(const Numbers& work) const {
    const double enough = std::clamp(change_, min_rest, max_rest);
    Gram L = Gram::Identity();
    Numbers D = Numbers::Zero();  // zero where a solution is left out
    for (int i = 0; i < count_; ++i) {
        double rest = gram_(i, i);
        for (int k = 0; k < i; ++k) {
            if (D[k] == 0) continue;
            const double product =
                gram_(i, k) -
                L.row(i).head(k).cwiseProduct(D.head(k).transpose()).dot(L.row(k).head(k));
            L(i, k) = product / D[k];
            rest -= L(i, k) * product;
        }
        if (rest > enough * std::abs(gram_(i, i)))
            D[i] = rest;
        else
            L.row(i).head(i).setZero();
    }
    const Numbers c = L.triangularView<Eigen::UnitLower>().solve(work);
    const Numbers of_kept = (D.array() != 0).select(c.cwiseQuotient(D), 0);
    return L.transpose().triangularView<Eigen::UnitUpper>().solve(of_kept);
}

void EarlierSolves::make_room(Vec like) {
    LIVETET_PETSC(VecDuplicate(like, start_.out()));
    LIVETET_PETSC(VecDuplicate(like, rest_.out()));
    PetscInt size = 0;
    LIVETET_PETSC(VecGetLocalSize(like, &size));
    for (auto& solution : solutions_) solution.resize(size);
    if (nearness_ == Nearness::residual)
        for (auto& image : images_) image.resize(size);
}

bool EarlierSolves::find_start(Mat A, Vec b) {
    if (!start_) make_room(b);
    if (count_ == 0) return false;
    const Numbers c = shares(products_with(b));
    if (!c.allFinite()) return false;
    {
        WriteArray x(start_.get());
        team_.run_pieces(x.span().size(), grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t first = begin; first < end; first += piece) {  // x stays in the cache
                const std::size_t last = std::min(end, first + piece);
                for (std::size_t i = first; i < last; ++i) x[i] = c[0] * solutions_[0][i];
                for (int k = 1; k < count_; ++k)
                    for (std::size_t i = first; i < last; ++i) x[i] += c[k] * solutions_[k][i];
            }
        });
    }
    LIVETET_PETSC(MatMult(A, start_.get(), rest_.get()));
    const Vec factors[] = {b, rest_.get()};
    PetscScalar work[2] = {};
    LIVETET_PETSC(
        VecMDot(nearness_ == Nearness::energy ? start_.get() : rest_.get(), 2, factors, work));
    // Where the energy rises, or does not fall along x, a frame, which searches along no line, must
    // not follow it.
    if (!(work[0] > 0 && work[1] > 0)) return false;
    const double a = work[0] / work[1];
    change_ = std::abs(work[1] / c.dot(gram_ * c) - 1);
    if (!std::isfinite(change_)) change_ = 1;
    const ReadArray from(b);
    WriteArray x(start_.get()), rest(rest_.get());
    team_.run_pieces(x.span().size(), grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            x[i] *= a;
            rest[i] = from[i] - a * rest[i];
        }
    });
    return true;
}

void EarlierSolves::keep(Vec x, Vec y) {
    std::rotate(solutions_.begin(), solutions_.end() - 1, solutions_.end());
    std::rotate(images_.begin(), images_.end() - 1, images_.end());
    round_to(solutions_.front(), x);
    if (nearness_ == Nearness::residual) round_to(images_.front(), y);
    const Eigen::Matrix<double, max_solutions - 1, max_solutions - 1> older =
        gram_.topLeftCorner<max_solutions - 1, max_solutions - 1>();
    gram_.bottomRightCorner<max_solutions - 1, max_solutions - 1>() = older;
    count_ = std::min(count_ + 1, max_solutions);
    gram_.row(0) = products_with(y).transpose();
    gram_.col(0) = gram_.row(0).transpose();
    if (!gram_.row(0).allFinite()) clear();
}

}  // namespace livetet
