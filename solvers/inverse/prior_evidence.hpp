#pragma once

#include <Eigen/Core>

namespace livetet {

/// Residuals y - G q of unit variance, which are linear in the unknowns q.
struct LinearMisfit {
    Eigen::MatrixXd information;  ///< G^T G
    Eigen::VectorXd projected;    ///< G^T y
    double squares = 0;           ///< y^T y
};

/// A weight of the prior, and how well the data tell it.
struct PriorWeight {
    double energy = 0;      ///< E0
    double log_spread = 0;  ///< standard deviation of ln E0; infinite where the data tell nothing
    /// Whether the evidence is largest at a bound, so that the weight is the bound's.
    bool at_bound = false;
    double determined = 0;  ///< effective number of coefficients that the data determine, gamma
};

/// Marginal likelihood ("evidence") of the weight of a Gaussian prior, for all weights by one
/// decomposition. The unknowns are q = (p, m): p has the prior N(0, E0 R^-1), with E0 sought, and m
/// has N(0, P^-1). With H = G^T G, b = G^T y and the integral over m done first,
///
///     A = H_pp - H_pm (H_mm + P)^-1 H_mp,   c = b_p - H_pm (H_mm + P)^-1 b_m,
///
/// the generalised eigenvectors A v_k = lambda_k R v_k, v_k^T R v_k = 1, leave for a = 1 / E0
///
///     ln p(y | E0) = 1/2 sum_k [ ln(a / (lambda_k + a)) + (v_k^T c)^2 / (lambda_k + a) ] + const.
///
/// D. J. C. MacKay 1992, Bayesian interpolation, Neural Computation 4; C. M. Bishop 2006, Pattern
/// Recognition and Machine Learning, section 3.5. The evidence's maximum satisfies
/// p^T R p = gamma E0, gamma = sum_k lambda_k / (lambda_k + a).
class PriorEvidence {
  public:
    /// `shape`: R, of the first unknowns, J per N^2 for forces. `precision`: P, of those after
    /// them; may be empty. Throws Error if sizes do not fit, R or P is not positive definite, or
    /// the misfit holds no information.
    PriorEvidence(const LinearMisfit& misfit, const Eigen::MatrixXd& shape,
                  const Eigen::MatrixXd& precision);

    /// ln p(y | E0), with its constant.
    double log_evidence(double energy) const;
    /// gamma: between 0 and the number of coefficients.
    double determined(double energy) const;
    /// The weight of the largest evidence. It is sought between the energy below which no direction
    /// is determined, 1 / lambda_max, and 1e6 times that.
    PriorWeight best() const;

  private:
    Eigen::VectorXd lambda_;   ///< of A in the metric R
    Eigen::VectorXd squares_;  ///< (v_k^T c)^2
    double constant_ = 0;
};

}  // namespace livetet
