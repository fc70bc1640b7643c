#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "geometry/umeyama.hpp"

// Error estimates of point-based registrations. Weights are those of the fit, with mean 1 and w_i =
// FLE^2 / FLE_i^2. "FLE of weight 1" is the localisation error of a fiducial of weight 1; without
// weights it is that of every fiducial.

namespace livetet {

/// Fiducial localisation error (RMS length, metres, of weight 1) that explains an FRE of
/// `fiducials` points:
///
///     FLE^2 = FRE^2 W / (N - 2)     rigid
///     FLE^2 = FRE^2 W / (N - 7/3)   with an estimated scale
///
/// with W the sum of the weights (N without weights) and N the number of weights above zero.
/// Source: Sibson 1979; Fitzpatrick, West, Maurer 1998, eq. 10; each unknown of the fit takes a
/// third. Throws Error for fewer than 3 fiducials.
double fle_from_fre(double fre, std::size_t fiducials, Scaling scaling = Scaling::rigid,
                    std::span<const double> weights = {});

/// Expected target registration error (RMS, metres) at `target` of a registration by fiducials at
/// `points` (same frame, metres), localised with an isotropic error of RMS length `fle` (of weight
/// 1):
///
///     <TRE^2> = <FLE^2> / W (1 + 1/3 sum_k d_k^2 / f_k^2)
///
/// d_k is the target's distance from the k-th principal axis of the fiducials, f_k their (weighted)
/// RMS distance from it. With an estimated scale the sum has a fourth term d^2 / f^2, with the
/// distances from the mean of the fiducials. First order in fle. Source: Fitzpatrick, West, Maurer
/// (1998), "Predicting error in rigid-body point-based registration", IEEE TMI 17(5), eq. 46.
/// Throws Error as `fit_points` does.
double expected_tre(std::span<const Eigen::Vector3d> points, double fle,
                    const Eigen::Vector3d& target, Scaling scaling = Scaling::rigid,
                    std::span<const double> weights = {});

/// For each point, the distance (metres) between its target and its image under the fit of all
/// other points. Unlike FRE this is not biased towards zero. Empty for a point without which the
/// others do not determine a fit. Throws Error as `fit_points` does.
std::vector<std::optional<double>> leave_one_out(std::span<const Eigen::Vector3d> from,
                                                 std::span<const Eigen::Vector3d> to,
                                                 Scaling scaling,
                                                 std::span<const double> weights = {});

/// A fiducial that does not match the others.
struct Outlier {
    std::size_t index = 0;
    double leave_one_out = 0;  ///< distance from its image under the fit of the others, metres
    /// Probability that noise alone sets the worst of the fiducials this far apart.
    double probability = 0;
    PointFit without;  ///< fit of the others, with the residuals of all
    std::vector<double> weights_without;
};

/// The fiducial whose removal reduces the residual sum of squares S most, if noise explains the
/// reduction with a probability below 0.01 and its leave-one-out error is at least 0.5 mm.
///
///     F = ((S - S') / 3) / (S' / n),   n = 3 (N - 1) - unknowns
///
/// follows the distribution F(3, n) (extra sum of squares: Cook, Weisberg 1982, "Residuals and
/// influence in regression", section 2.2). The probability is multiplied by N because the worst of
/// N is picked (Bonferroni). Needs four fiducials, and five to detect any but gross errors.
std::optional<Outlier> find_outlier(std::span<const Eigen::Vector3d> from,
                                    std::span<const Eigen::Vector3d> to, Scaling scaling,
                                    std::span<const double> weights = {});

/// P(F > f) of Snedecor's F distribution with m and n degrees of freedom.
double f_survival(double f, double m, double n);

}  // namespace livetet
