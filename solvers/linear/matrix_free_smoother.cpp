#include "solvers/linear/matrix_free_smoother.hpp"

#include <cmath>

#include "base/sliced_task.hpp"
#include "solvers/linear/chebyshev_steps.hpp"

namespace livetet {

MatrixFreeSmoother::MatrixFreeSmoother(MatrixFreeOperator& A, int steps, double lowest)
    : A_(A), steps_(steps), lowest_(lowest) {
    for (std::vector<float>* v : {&b_, &x_, &d_}) v->assign(A.vector_size(), 0.0F);
}

void MatrixFreeSmoother::find_bound() {
    if (is_bound_known_) return;
    std::uint32_t state = 12345;
    for (std::size_t i = 0; i < A_.components(); ++i) {
        state = state * 1664525u + 1013904223u;
        x_[i] = static_cast<float>(state) / 4294967296.0F - 0.5F;
    }
    bound_ = 1;
    for (int k = 0; k < 20; ++k) {
        pause_point();
        const double before = squared_norm(x_);
        A_.visit_stiffness(x_,
                           [&](std::size_t i, float Kx) { d_[i] = Kx / A_.stiffness_diagonal(i); });
        const double after = squared_norm(d_);
        if (!(before > 0 && after > 0)) return;  // a level without stiffness
        bound_ = std::sqrt(after / before);
        const auto scale = static_cast<float>(1 / std::sqrt(after));
        for (std::size_t i = 0; i < A_.components(); ++i) x_[i] = scale * d_[i];
    }
    is_bound_known_ = true;
}

double MatrixFreeSmoother::squared_norm(std::span<const float> x) const {
    double size = 0;
    for (const float v : x.first(A_.components())) size += v * v;
    return A_.sum_over_ranks(size);
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
