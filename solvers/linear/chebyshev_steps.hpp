#pragma once

namespace livetet {

/// Chebyshev's iteration for A x = b on an interval of the eigenvalues of D^-1 A (Saad 2003,
/// algorithm 12.1), a step after the other:
///
///     d = of_d d + of_r D^-1 (b - A x),     x = x + d.
class ChebyshevSteps {
  public:
    /// `bound`: the largest eigenvalue; the interval ends a tenth above it, and begins at this
    /// share of its end.
    explicit ChebyshevSteps(double bound, double lowest = 0.1) {
        const auto high = static_cast<float>(1.1 * bound), low = static_cast<float>(lowest) * high;
        theta_ = (high + low) / 2;
        delta_ = (high - low) / 2;
        sigma_ = theta_ / delta_;
        rho_ = 1 / sigma_;
    }
    struct Factors {
        float of_d, of_r;
    };
    /// Of the next step; of_d is 0 in the first.
    Factors next() {
        if (is_first_) {
            is_first_ = false;
            return {0, 1 / theta_};
        }
        const float following = 1 / (2 * sigma_ - rho_);
        const Factors factors{following * rho_, 2 * following / delta_};
        rho_ = following;
        return factors;
    }

  private:
    float theta_, delta_, sigma_, rho_;
    bool is_first_ = true;
};

}  // namespace livetet
