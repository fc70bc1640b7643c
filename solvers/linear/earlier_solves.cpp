#include "solvers/linear/earlier_solves.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>

#include "base/piece_sums.hpp"
#include "solvers/linear/min_floats.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

namespace {

/// A solution is left out if newer ones leave of it at most a part of its square in G. That is as
/// much as A changed, as the last combination showed, within these bounds: along the rest the
/// change outweighs the solution. Where A stays, rounding to float bounds what can be told apart.
constexpr double min_rest = 1e-6, max_rest = 1e-2;

void round_to(std::vector<float>& to, Vec from, ThreadTeam& team) {
    const ReadArray values(from);
    team.run_pieces(to.size(), min_floats_per_thread, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) to[i] = static_cast<float>(values[i]);
    });
}

}  // namespace

EarlierSolves::Numbers EarlierSolves::products_with(Vec v) const {
    const ReadArray values(v);
    Numbers sums = sum_in_pieces(
        team_, values.span().size(), [&](std::size_t begin, std::size_t end) -> Numbers {
            Numbers of_piece = Numbers::Zero();
            for (int i = 0; i < count_; ++i)
                of_piece[i] = dot_of_piece(tests()[i].data(), values.span().data(), begin, end);
            return of_piece;
        });
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
    PetscInt size = 0;
    LIVETET_PETSC(VecGetLocalSize(like, &size));
    for (auto& solution : solutions_) solution.resize(size);
    if (nearness_ == Nearness::residual)
        for (auto& image : images_) image.resize(size);
    has_room_ = true;
}

std::optional<EarlierSolves::Numbers> EarlierSolves::combination(Vec b) const {
    if (count_ == 0) return std::nullopt;
    const Numbers c = shares(products_with(b));
    return c.allFinite() ? std::optional(c) : std::nullopt;
}

template <class Scalar>
void EarlierSolves::combine(const Numbers& c, std::span<Scalar> x) const {
    const Eigen::Vector<Scalar, max_solutions> share = c.cast<Scalar>();
    team_.run_pieces(solutions_[0].size(), min_floats_per_thread,
                     [&](std::size_t begin, std::size_t end) {
                         constexpr std::size_t piece = 1536;  // of x, which stays in the cache
                         for (std::size_t first = begin; first < end; first += piece) {
                             const std::size_t last = std::min(end, first + piece);
                             for (std::size_t i = first; i < last; ++i)
                                 x[i] = share[0] * solutions_[0][i];
                             for (int k = 1; k < count_; ++k)
                                 for (std::size_t i = first; i < last; ++i)
                                     x[i] += share[k] * solutions_[k][i];
                         }
                     });
}

double EarlierSolves::length(const Numbers& c, double along_b, double along_image) {
    // Where the energy rises, or does not fall along x, a frame, which searches along no line, must
    // not follow it.
    if (!(along_b > 0 && along_image > 0)) return 0;
    change_ = std::abs(along_image / c.dot(gram_ * c) - 1);
    if (!std::isfinite(change_)) change_ = 1;
    return along_b / along_image;
}

bool EarlierSolves::find_start(Mat A, Vec b) {
    if (!has_room_) make_room(b);
    if (!start_)
        for (PetscHandle<Vec>* v : {&start_, &rest_}) LIVETET_PETSC(VecDuplicate(b, v->out()));
    const auto c = combination(b);
    if (!c) return false;
    combine(*c, WriteArray(start_.get()).span());
    LIVETET_PETSC(MatMult(A, start_.get(), rest_.get()));
    const Vec factors[] = {b, rest_.get()};
    PetscScalar along[2] = {};
    LIVETET_PETSC(
        VecMDot(nearness_ == Nearness::energy ? start_.get() : rest_.get(), 2, factors, along));
    const double a = length(*c, along[0], along[1]);
    if (a == 0) return false;
    const ReadArray from(b);
    WriteArray x(start_.get()), rest(rest_.get());
    team_.run_pieces(x.span().size(), min_floats_per_thread,
                     [&](std::size_t begin, std::size_t end) {
                         for (std::size_t i = begin; i < end; ++i) {
                             x[i] *= a;
                             rest[i] = from[i] - a * rest[i];
                         }
                     });
    return true;
}

double EarlierSolves::find_start(SingleSystem& A, Vec b, std::span<float> start,
                                 std::span<float> rest) {
    if (!has_room_) make_room(b);
    const auto c = combination(b);
    if (!c) return 0;
    combine(*c, start);
    A.apply(start, rest);
    const ReadArray from(b);
    const std::size_t size = from.span().size();
    const Eigen::Array2d along =
        sum_in_pieces(team_, size, [&](std::size_t begin, std::size_t end) -> Eigen::Array2d {
            return {dot_of_piece(start.data(), from.span().data(), begin, end),
                    dot_of_piece(start.data(), rest.data(), begin, end)};
        });
    const double a = length(*c, along[0], along[1]);
    if (a == 0) return 0;
    team_.run_pieces(size, min_floats_per_thread, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            rest[i] = static_cast<float>(from[i] - a * rest[i]);
    });
    return a;
}

void EarlierSolves::keep(Vec x, Vec y) {
    std::rotate(solutions_.begin(), solutions_.end() - 1, solutions_.end());
    std::rotate(images_.begin(), images_.end() - 1, images_.end());
    round_to(solutions_.front(), x, team_);
    if (nearness_ == Nearness::residual) round_to(images_.front(), y, team_);
    const Eigen::Matrix<double, max_solutions - 1, max_solutions - 1> older =
        gram_.topLeftCorner<max_solutions - 1, max_solutions - 1>();
    gram_.bottomRightCorner<max_solutions - 1, max_solutions - 1>() = older;
    count_ = std::min(count_ + 1, max_solutions);
    gram_.row(0) = products_with(y).transpose();
    gram_.col(0) = gram_.row(0).transpose();
    if (!gram_.row(0).allFinite()) clear();
}

}  // namespace livetet
