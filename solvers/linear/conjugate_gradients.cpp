#include "solvers/linear/conjugate_gradients.hpp"

#include <Eigen/Core>

#include <cmath>

#include "base/piece_sums.hpp"
#include "solvers/linear/min_floats.hpp"

namespace livetet {

ConjugateGradients::ConjugateGradients(SingleSystem& system, std::size_t n, ThreadTeam& team)
    : system_(system), team_(team), n_(n) {
    for (std::vector<float>* v : {&r_, &z_, &p_, &q_, &start_}) v->assign(n + 1, 0.0F);
}

void ConjugateGradients::begin(Vec b, EarlierSolves* earlier) {
    iterations_ = 0;
    start_scale_ = earlier ? earlier->find_start(system_, b, start_, r_) : 0;
    if (!has_start()) {
        const ReadArray from(b);
        team_.run_pieces(n_, min_floats_per_thread, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) r_[i] = static_cast<float>(from[i]);
        });
    }
    find_norm();
}

void ConjugateGradients::find_norm() {
    residual_ = std::sqrt(dot_on_team(team_, r_.data(), r_.data(), n_));
}

KSPConvergedReason ConjugateGradients::run(Vec x, StoppingTest& stopping, KSP monitored) {
    const KSPConvergedReason reason = iterate(x, stopping, monitored);
    if (iterations_ == 0) write_start(x);
    return reason;
}

KSPConvergedReason ConjugateGradients::iterate(Vec x, StoppingTest& stopping, KSP monitored) {
    double step = 0;
    for (int k = 0;; ++k) {
        if (monitored) LIVETET_PETSC(KSPMonitor(monitored, k, residual_));
        const KSPConvergedReason reason = stopping.judge(k, residual_, step);
        if (reason != KSP_CONVERGED_ITERATING) return reason;
        find_direction(k == 0);
        if (!(rz_ > 0)) return KSP_DIVERGED_INDEFINITE_PC;
        const Eigen::Array2d products =
            sum_in_pieces(team_, n_, [&](std::size_t begin, std::size_t end) -> Eigen::Array2d {
                return {dot_of_piece(p_.data(), q_.data(), begin, end),
                        dot_of_piece(p_.data(), p_.data(), begin, end)};
            });
        if (!(products[0] > 0)) return KSP_DIVERGED_INDEFINITE_MAT;
        const double alpha = rz_ / products[0];
        advance(alpha, x);
        step = alpha * std::sqrt(products[1] / (static_cast<double>(n_) / 3));
        ++iterations_;
    }
}

void ConjugateGradients::find_direction(bool is_first) {
    const double before = rz_;
    std::vector<float>& z = is_first ? p_ : z_;
    const auto precondition = [&] {
        system_.precondition(r_, z);
        rz_ = dot_on_team(team_, r_.data(), z.data(), n_);
    };
    precondition();
    // The first cycle after a start need not be positive (LiveCycle::begin_solve); the next is.
    if (is_first && !(rz_ > 0)) precondition();
    if (!is_first) {
        const auto beta = static_cast<float>(rz_ / before);
        team_.run_pieces(n_, min_floats_per_thread, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) p_[i] = z_[i] + beta * p_[i];
        });
    }
    system_.apply(p_, q_);
}

void ConjugateGradients::advance(double alpha, Vec x) {
    const auto single_alpha = static_cast<float>(alpha);
    const bool is_first = iterations_ == 0;
    WriteArray to(x);
    residual_ = std::sqrt(sum_in_pieces(team_, n_, [&](std::size_t begin, std::size_t end) {
        if (is_first)
            for (std::size_t i = begin; i < end; ++i)
                to[i] = start_scale_ * start_[i] + alpha * p_[i];
        else
            for (std::size_t i = begin; i < end; ++i) to[i] += alpha * p_[i];
        for (std::size_t i = begin; i < end; ++i) r_[i] -= single_alpha * q_[i];
        return dot_of_piece(r_.data(), r_.data(), begin, end);
    }));
}

void ConjugateGradients::write_start(Vec x) {
    WriteArray to(x);
    team_.run_pieces(n_, min_floats_per_thread, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            to[i] = has_start() ? start_scale_ * start_[i] : 0;
    });
}

void ConjugateGradients::renew_residual(Vec b, Vec x) {
    const ReadArray from(b), at(x);
    team_.run_pieces(n_, min_floats_per_thread, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) p_[i] = static_cast<float>(at[i]);
    });
    system_.apply(p_, q_);
    team_.run_pieces(n_, min_floats_per_thread, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) r_[i] = static_cast<float>(from[i] - q_[i]);
    });
    find_norm();
}

void ConjugateGradients::image(Vec b, Vec y) const {
    const ReadArray from(b);
    WriteArray to(y);
    team_.run_pieces(n_, min_floats_per_thread, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) to[i] = from[i] - r_[i];
    });
}

}  // namespace livetet
