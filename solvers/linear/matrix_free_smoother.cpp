#include "solvers/linear/matrix_free_smoother.hpp"

#include "base/sliced_task.hpp"
#include "solvers/linear/chebyshev_steps.hpp"
#include "solvers/linear/lanczos_bound.hpp"

namespace livetet {

MatrixFreeSmoother::MatrixFreeSmoother(MatrixFreeOperator& A, int steps, double lowest)
    : A_(A), steps_(steps), lowest_(lowest) {
    for (std::vector<float>* v : {&b_, &x_, &d_}) v->assign(A.vector_size(), 0.0F);
}

/// Of the stiffness and its diagonal: r is b, p is x, and z and q are d.
struct MatrixFreeSmoother::Gradients {
    MatrixFreeSmoother& s;

    double residual() {
        for (std::size_t i = 0; i < s.A_.components(); ++i)
            s.d_[i] = s.b_[i] / s.A_.stiffness_diagonal(i);
        return s.dot(s.b_, s.d_);
    }
    void turn(double beta) {
        for (std::size_t i = 0; i < s.A_.components(); ++i)
            s.x_[i] = s.d_[i] + static_cast<float>(beta) * s.x_[i];
    }
    double curvature() {
        pause_point();
        s.A_.visit_stiffness(s.x_, [&](std::size_t i, float Kx) { s.d_[i] = Kx; });
        return s.dot(s.x_, s.d_);
    }
    void advance(double alpha) {
        for (std::size_t i = 0; i < s.A_.components(); ++i)
            s.b_[i] -= static_cast<float>(alpha) * s.d_[i];
    }
};

void MatrixFreeSmoother::find_bound() {
    if (is_bound_known_) return;
    RoughValues rough;
    for (std::size_t i = 0; i < A_.components(); ++i) {
        b_[i] = static_cast<float>(rough.next());
        x_[i] = 0;
    }
    const double found = lanczos_bound(bound_steps, Gradients{*this});
    if (found == 0) return;  // a level without stiffness
    bound_ = found;
    is_bound_known_ = true;
}

double MatrixFreeSmoother::dot(std::span<const float> x, std::span<const float> y) const {
    double sum = 0;
    for (std::size_t i = 0; i < A_.components(); ++i) sum += double{x[i]} * y[i];
    return A_.sum_over_ranks(sum);
}

void MatrixFreeSmoother::smooth(bool from_zero) {
    const auto inverse = A_.inverse_diagonal();
    ChebyshevSteps chebyshev(bound_, lowest_);
    for (int step = 0; step < steps_; ++step) {
        const ChebyshevSteps::Factors f = chebyshev.next();
        const bool is_last = step + 1 == steps_;  // nobody asks for its d
        if (step == 0 && from_zero)
            A_.over_components([&](std::size_t i) {
                x_[i] = f.of_r * inverse[i] * b_[i];
                if (!is_last) d_[i] = x_[i];
            });
        else
            A_.visit_positive(x_, [&](std::size_t i, float Ax) {
                float d = f.of_r * inverse[i] * (b_[i] - Ax);
                if (step > 0) d += f.of_d * d_[i];
                if (!is_last) d_[i] = d;
                x_[i] += d;
            });
    }
}

}  // namespace livetet
