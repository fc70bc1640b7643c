#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "geometry/umeyama.hpp"

// What a registration by fiducials is worth. Weights are those of the fit and mean w_i = FLE^2 /
// FLE_i^2: a localisation error "of weight 1" belongs to all fiducials where there are none.

namespace livetet {

/// The localisation error (RMS length, metres, of weight 1) that explains an FRE of `fiducials`
/// points:
///     FLE^2 = FRE^2 W / (N - 2), with a scale estimated FRE^2 W / (N - 7/3),
/// W the sum of weights (N without), N those above zero: Sibson 1979; Fitzpatrick, West, Maurer
/// 1998, eq. 10, a third for each unknown. Throws Error for fewer than 3 fiducials.
double fle_from_fre(double fre, std::size_t fiducials, Scaling scaling = Scaling::rigid,
                    std::span<const double> weights = {});

/// The target registration error (RMS, metres) to expect at `target` from fiducials at `points`
/// (same frame, metres) that are localised with an isotropic error of RMS length `fle` (of weight
/// 1): Fitzpatrick, West, Maurer (1998), "Predicting error in rigid-body point-based registration",
/// IEEE TMI 17(5), eq. 46,
///     <TRE^2> = <FLE^2> / W (1 + 1/3 sum_k d_k^2 / f_k^2),
/// d_k the target's distance from the fiducials' k-th principal axis, f_k the (weighted) RMS
/// distance of the fiducials from it. Where a scale is estimated, d^2 / f^2 of the distances from
/// the fiducials' mean joins the sum. To first order in fle. Throws Error where `fit_points` would.
double expected_tre(std::span<const Eigen::Vector3d> points, double fle,
                    const Eigen::Vector3d& target, Scaling scaling = Scaling::rigid,
                    std::span<const double> weights = {});

/// For each point the distance (metres) between its target and where the fit of all others puts it:
/// an honest measure of error, where FRE is not. Empty for a point without which the others do not
/// determine a fit; throws Error where `fit_points` would.
std::vector<std::optional<double>> leave_one_out(std::span<const Eigen::Vector3d> from,
                                                 std::span<const Eigen::Vector3d> to,
                                                 Scaling scaling,
                                                 std::span<const double> weights = {});

/// A fiducial that does not belong to the others.
struct Outlier {
    std::size_t index = 0;
    double leave_one_out = 0;  ///< how far it is from where the others put it, metres
    double probability =
        0;  ///< that noise alone sets the worst of the fiducials as far apart from the others
    PointFit without;  ///< the fit of the others; residuals of all
    std::vector<double> weights_without;
};

/// The fiducial whose removal lowers the sum of squares S most, if noise explains that with a
/// probability below 0.01 and it is at least half a millimetre off: F = ((S - S') / 3) / (S' / n),
/// n = 3 (N - 1) - unknowns, is distributed as F(3, n) (extra sum of squares: Cook, Weisberg 1982,
/// "Residuals and influence in regression", section 2.2), times N for having picked the worst
/// (Bonferroni). Needs four fiducials, and five to see anything but the grossest.
std::optional<Outlier> find_outlier(std::span<const Eigen::Vector3d> from,
                                    std::span<const Eigen::Vector3d> to, Scaling scaling,
                                    std::span<const double> weights = {});

/// P(F > f) of Snedecor's distribution with m and n degrees of freedom.
double f_survival(double f, double m, double n);

}  // namespace livetet
