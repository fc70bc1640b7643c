#include "image/image_markers.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "base/error.hpp"
#include "image/axis_filter.hpp"

namespace livetet {

namespace {

constexpr double inner_sigma = 0.45, outer_sigma = 0.72;  // standard deviations, radii
constexpr std::size_t max_candidates = 300;
// Margin of the window around the ball: radii, or voxels if that is more.
constexpr double window_beyond = 0.2, window_voxels = 0.8;
constexpr int windows = 6, iterations = 20;

Vector3 spacing_of(const GreyImage& image) {
    return image.ras_from_voxel.topLeftCorner<3, 3>().colwise().norm();
}

void check(const GreyImage& image, const MarkerOptions& options) {
    const Vector3 spacing = spacing_of(image);
    const double d = options.diameter;
    if (!(d >= 2 * spacing.maxCoeff()))
        fail(
            "markers: a diameter of {:.3g} mm, expected at least two voxels of {:.3g} x {:.3g} x "
            "{:.3g} mm",
            1e3 * d, 1e3 * spacing[0], 1e3 * spacing[1], 1e3 * spacing[2]);
    double extent = 1e30;
    for (int k = 0; k < 3; ++k) extent = std::min(extent, spacing[k] * image.size[k]);
    if (!(d <= extent / 2))
        fail(
            "markers: a diameter of {:.3g} mm, expected at most half of the image's least extent, "
            "{:.3g} mm",
            1e3 * d, 1e3 * extent);
}

std::vector<float> smoothed(const GreyImage& image, double sigma) {
    std::vector<float> values = image.values;
    std::array<int, 3> size = image.size;
    const Vector3 spacing = spacing_of(image);
    for (int axis = 0; axis < 3; ++axis)
        values = apply(gaussian_within(size[axis], sigma / spacing[axis]), values, size, axis);
    return values;
}

/// Maxima of the difference of Gaussians among their 26 neighbours, highest first.
std::vector<std::array<int, 3>> candidates(const GreyImage& image, const MarkerOptions& options) {
    GreyImage response{image.size, image.ras_from_voxel,
                       smoothed(image, inner_sigma * options.diameter / 2)};
    const std::vector<float> background = smoothed(image, outer_sigma * options.diameter / 2);
    const float sign = options.shade == MarkerShade::bright ? 1 : -1;
    for (std::size_t n = 0; n < background.size(); ++n)
        response.values[n] = sign * (response.values[n] - background[n]);

    const auto is_peak = [&](int i, int j, int k) {
        const float value = response.at(i, j, k);
        if (!(value > 0)) return false;
        for (int dk = -1; dk <= 1; ++dk)
            for (int dj = -1; dj <= 1; ++dj)
                for (int di = -1; di <= 1; ++di) {
                    if (!response.contains(i + di, j + dj, k + dk)) continue;
                    const float other = response.at(i + di, j + dj, k + dk);
                    // Of equal neighbours the first one counts.
                    const bool later = di + 3 * dj + 9 * dk > 0;
                    if (other > value || (other == value && !later && (di || dj || dk)))
                        return false;
                }
        return true;
    };
    std::vector<std::array<int, 3>> peaks;
    for (int k = 0; k < image.size[2]; ++k)
        for (int j = 0; j < image.size[1]; ++j)
            for (int i = 0; i < image.size[0]; ++i)
                if (is_peak(i, j, k)) peaks.push_back({i, j, k});
    std::stable_sort(peaks.begin(), peaks.end(), [&](const auto& a, const auto& b) {
        return response.at(a[0], a[1], a[2]) > response.at(b[0], b[1], b[2]);
    });
    if (peaks.size() > max_candidates) peaks.resize(max_candidates);
    return peaks;
}

/// Minimises |A x - b| by the normal equations. The columns have similar norms and are far from
/// parallel.
Eigen::VectorXd least_squares(const Eigen::Ref<const Eigen::MatrixXd>& A,
                              const Eigen::VectorXd& b) {
    return (A.transpose() * A).eval().ldlt().solve(A.transpose() * b);
}

/// Positions and values of the voxels in a window.
struct Window {
    std::vector<Vector3> place;
    std::vector<double> value;
    double share_inside = 0;  // share of the window's volume inside the image
};

class BallFit {
  public:
    BallFit(const GreyImage& image, const MarkerOptions& options)
        : image_(image),
          options_(options),
          radius_(options.diameter / 2),
          reach_(radius_ +
                 std::max(window_beyond * radius_, window_voxels * spacing_of(image).maxCoeff())),
          axes_(image.ras_from_voxel.topLeftCorner<3, 3>()),
          voxel_from_ras_(image.ras_from_voxel.inverse()) {}

    /// Fits a ball near `centre`; nothing if there is none.
    std::optional<ImageMarker> at(Vector3 centre) const {
        const Vector3 start = centre;
        ImageMarker marker;
        for (int round = 0; round < windows; ++round) {
            const Window window = window_about(centre);
            if (window.share_inside < 0.75) return std::nullopt;
            marker = refined(window, centre);
            const double moved = (marker.centre - centre).norm();
            centre = marker.centre;
            if (!centre.allFinite() || (centre - start).norm() > radius_) return std::nullopt;
            if (moved < 1e-4 * radius_) break;
        }
        if (!(marker.contrast > 0) || !(marker.fit >= options_.min_fit)) return std::nullopt;
        return marker;
    }

  private:
    Window window_about(const Vector3& centre) const {
        Window window;
        const Vector3 middle = (voxel_from_ras_ * centre.homogeneous()).head<3>();
        std::array<int, 3> low, high;
        // The ball's half extent along voxel index k is its reach times the norm of row k.
        for (int k = 0; k < 3; ++k) {
            const double half = reach_ * voxel_from_ras_.block<1, 3>(k, 0).norm();
            low[k] = std::max(0, static_cast<int>(std::ceil(middle[k] - half)));
            high[k] = std::min(image_.size[k] - 1, static_cast<int>(std::floor(middle[k] + half)));
        }
        for (int k = low[2]; k <= high[2]; ++k)
            for (int j = low[1]; j <= high[1]; ++j)
                for (int i = low[0]; i <= high[0]; ++i) {
                    const Vector3 x =
                        (image_.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>();
                    if ((x - centre).norm() > reach_) continue;
                    window.place.push_back(x);
                    window.value.push_back(image_.at(i, j, k));
                }
        const double whole =
            4.0 / 3 * M_PI * reach_ * reach_ * reach_ / std::abs(axes_.determinant());
        window.share_inside = static_cast<double>(window.place.size()) / whole;
        return window;
    }

    /// Share of the voxel at x inside the ball about c, and its derivative by c.
    std::pair<double, Vector3> coverage(const Vector3& x, const Vector3& c) const {
        const Vector3 away = x - c;
        const double distance = away.norm();
        const Vector3 normal = distance > 0 ? Vector3(away / distance) : Vector3::UnitX();
        // Standard deviation of the voxel's box across the edge.
        const double sigma = std::sqrt((axes_.transpose() * normal).squaredNorm() / 12);
        const double depth = (radius_ - distance) / sigma;
        const double density = std::exp(-depth * depth / 2) / std::sqrt(2 * M_PI) / sigma;
        return {0.5 * std::erfc(-depth / std::sqrt(2.0)), density * normal};
    }

    /// Gauss-Newton for the centre, with the optimal linear parameters for each centre (variable
    /// projection). The uncertainty is the square root of the trace of the centre's covariance
    /// sigma^2 (J^T J)^-1, with sigma^2 from the residual.
    ImageMarker refined(const Window& window, const Vector3& start) const {
        const auto count = static_cast<Eigen::Index>(window.place.size());
        // Derivatives by centre (radii), contrast, background and background gradient.
        Eigen::MatrixXd J(count, 8);
        Eigen::VectorXd residual(count);
        const Eigen::VectorXd value = Eigen::Map<const Eigen::VectorXd>(window.value.data(), count);
        // Residual of the model without a ball: background and gradient only.
        for (Eigen::Index n = 0; n < count; ++n)
            J.row(n).tail<4>() << 1, ((window.place[n] - start) / radius_).transpose();
        const Eigen::Vector4d flat = least_squares(J.rightCols<4>(), value);
        const double without = (value - J.rightCols<4>() * flat).squaredNorm();

        Vector3 centre = start;
        // Contrast, background and gradient; the optimum for each centre.
        Eigen::VectorXd linear;
        for (int i = 0; i < iterations; ++i) {
            for (Eigen::Index n = 0; n < count; ++n)
                J(n, 3) = coverage(window.place[n], centre).first;
            linear = least_squares(J.rightCols<5>(), value);
            residual = value - J.rightCols<5>() * linear;
            for (Eigen::Index n = 0; n < count; ++n)
                J.row(n).head<3>() =
                    linear[0] * radius_ * coverage(window.place[n], centre).second.transpose();
            const Eigen::VectorXd move = least_squares(J, residual);
            const double step = move.head<3>().norm(), max_step = 0.2;
            centre += radius_ * move.head<3>() * (step > max_step ? max_step / step : 1);
            if (!(step > 1e-5)) break;
        }
        const double left = residual.squaredNorm();
        const double sign = options_.shade == MarkerShade::bright ? 1 : -1;
        ImageMarker marker{centre, 0, sign * linear[0], without > 0 ? 1 - left / without : 0};
        const double variance = left / std::max<double>(1, static_cast<double>(count - 8));
        const Eigen::MatrixXd information = J.transpose() * J;
        const Eigen::MatrixXd covariance =
            variance * information.ldlt().solve(Eigen::MatrixXd::Identity(8, 8));
        marker.uncertainty = radius_ * std::sqrt(covariance.topLeftCorner<3, 3>().trace());
        return marker;
    }

    const GreyImage& image_;
    MarkerOptions options_;
    double radius_, reach_;
    Eigen::Matrix3d axes_;
    Eigen::Matrix4d voxel_from_ras_;
};

}  // namespace

std::vector<ImageMarker> find_markers(const GreyImage& image, const MarkerOptions& options) {
    check(image, options);
    const BallFit fit(image, options);
    std::vector<ImageMarker> found;
    for (const auto& [i, j, k] : candidates(image, options))
        if (const auto marker =
                fit.at((image.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>()))
            found.push_back(*marker);
    std::stable_sort(found.begin(), found.end(), [](const ImageMarker& a, const ImageMarker& b) {
        return a.score() > b.score();
    });
    std::vector<ImageMarker> apart;
    for (const ImageMarker& marker : found) {
        const bool taken = std::any_of(apart.begin(), apart.end(), [&](const ImageMarker& other) {
            return (other.centre - marker.centre).norm() < options.diameter;
        });
        if (!taken) apart.push_back(marker);
    }
    return apart;
}

}  // namespace livetet
