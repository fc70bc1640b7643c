#pragma once

#include <Eigen/Dense>

namespace livetet::test {

/// Errors of many trials, each whitened by the covariance that was stated for it: L^-1 e with L L^T
/// that covariance. Their mean square is the unit matrix if the statements are right.
template <int n>
class WhitenedErrors {
  public:
    using Vector = Eigen::Matrix<double, n, 1>;
    using Matrix = Eigen::Matrix<double, n, n>;

    void add(const Vector& error, const Matrix& covariance) {
        const Vector white = covariance.llt().matrixL().solve(error);
        sum_ += white * white.transpose();
        ++trials_;
    }

    /// Largest entry of mean square - I. Its diagonal scatters by sqrt(2 / trials), the rest less.
    double deviation() const { return (sum_ / trials_ - Matrix::Identity()).cwiseAbs().maxCoeff(); }

  private:
    Matrix sum_ = Matrix::Zero();
    double trials_ = 0;
};

}  // namespace livetet::test
