#include "solvers/linear/conjugate_gradients.hpp"

#include <Eigen/Core>

#include <cmath>

#include "base/piece_sums.hpp"

namespace livetet {

namespace {

/// Least number of components for which a further thread is woken.
constexpr std::size_t grain = 1000;

}  // namespace

ConjugateGradients::ConjugateGradients(SingleSystem& system, std::size_t n, ThreadTeam& team)
    : system_(system), team_(team), n_(n) {
    for (std::vector<float>* v : {&r_, &z_, &p_, &q_, &start_}) v->assign(n + 1, 0.0F);
}

void ConjugateGradients::begin(Vec b, EarlierSolves* earlier) {
    iterations_ = runs_ = 0;
    of_start_ = earlier ? earlier->find_start(system_, b, start_, r_) : 0;
    if (!has_start()) {
        const ReadArray from(b);
        team_.run_pieces(n_, grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) r_[i] = static_cast<float>(from[i]);
        });
    }
    residual_ = std::sqrt(dot_on_team(team_, r_.data(), r_.data(), n_));
}

KSPConvergedReason ConjugateGradients::run(Vec x, StoppingTest& stopping) {
    double step = 0;
    ++runs_;
    for (int k = 0;; ++k) {
        const KSPConvergedReason reason = stopping.judge(k, residual_, step);
        if (reason != KSP_CONVERGED_ITERATING) {
            if (iterations_ == 0) write_start(x);
            return reason;
        }
        find_direction(k == 0);
        const Eigen::Array2d products =
            sum_in_pieces(team_, n_, [&](std::size_t begin, std::size_t end) -> Eigen::Array2d {
                return {dot_of_piece(p_.data(), q_.data(), begin, end),
                        dot_of_piece(p_.data(), p_.data(), begin, end)};
            });
        if (!(products[0] > 0 && rz_ > 0)) {
            if (iterations_ == 0) write_start(x);
            return rz_ > 0 ? KSP_DIVERGED_INDEFINITE_MAT : KSP_DIVERGED_INDEFINITE_PC;
        }
        const double length = rz_ / products[0];
        advance(length, x);
        step = length * std::sqrt(products[1] / (static_cast<double>(n_) / 3));
        ++iterations_;
    }
}

void ConjugateGradients::find_direction(bool is_first) {
    std::vector<float>& z = is_first ? p_ : z_;
    system_.precondition(r_, z);
    const double before = rz_;
    rz_ = dot_on_team(team_, r_.data(), z.data(), n_);
    if (!is_first) {
        const auto share = static_cast<float>(rz_ / before);
        team_.run_pieces(n_, grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) p_[i] = z_[i] + share * p_[i];
        });
    }
    system_.apply(p_, q_);
}

void ConjugateGradients::advance(double length, Vec x) {
    const bool is_first = iterations_ == 0;
    const auto of_q = static_cast<float>(length);
    WriteArray to(x);
    const double squares = sum_in_pieces(team_, n_, [&](std::size_t begin, std::size_t end) {
        if (is_first)
            for (std::size_t i = begin; i < end; ++i)
                to[i] = of_start_ * start_[i] + length * p_[i];
        else
            for (std::size_t i = begin; i < end; ++i) to[i] += length * p_[i];
        for (std::size_t i = begin; i < end; ++i) r_[i] -= of_q * q_[i];
        return dot_of_piece(r_.data(), r_.data(), begin, end);
    });
    residual_ = std::sqrt(squares);
}

void ConjugateGradients::write_start(Vec x) {
    WriteArray to(x);
    team_.run_pieces(n_, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) to[i] = has_start() ? of_start_ * start_[i] : 0;
    });
}

void ConjugateGradients::image(Vec b, Vec x, Vec y) {
    WriteArray to(y);
    if (runs_ > 1) {
        const ReadArray from(x);
        team_.run_pieces(n_, grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) p_[i] = static_cast<float>(from[i]);
        });
        system_.apply(p_, q_);
        team_.run_pieces(n_, grain, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) to[i] = q_[i];
        });
        return;
    }
    const ReadArray from(b);
    team_.run_pieces(n_, grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) to[i] = from[i] - r_[i];
    });
}

}  // namespace livetet
