#pragma once

#include <algorithm>
#include <cmath>

#include "image/image.hpp"

namespace livetet {

/// Interpolation between voxel centres: the nearest voxel (halves round up), trilinear over 8
/// voxels, or cubic convolution over 64 (R. Keys, 1981, a = -1/2; interpolates the voxel values, is
/// exact for quadratics, and can overshoot at edges).
enum class Interpolation { nearest, linear, cubic };

/// Whether a position (voxel coordinates) is inside the image, whose outermost voxels extend half a
/// voxel beyond their centres.
template <class T>
bool is_inside(const Image<T>& image, const Eigen::Vector3d& place) {
    for (int d = 0; d < 3; ++d)
        if (!(place[d] >= -0.5 && place[d] <= image.size[d] - 0.5)) return false;
    return true;
}

namespace sampling {

/// Voxels beyond the end of an axis repeat the last one.
inline int clamped(int i, int size) { return std::clamp(i, 0, size - 1); }

/// The first of `Taps` voxels along an axis, and their weights.
template <int Taps>
struct Axis {
    int first;
    float weights[Taps];
};

/// Linear weights at voxel coordinate x.
inline Axis<2> linear_axis(double x) {
    const double low = std::floor(x);
    const auto f = static_cast<float>(x - low);
    return {static_cast<int>(low), {1 - f, f}};
}

/// Keys' cubic convolution weights at voxel coordinate x.
inline Axis<4> cubic_axis(double x) {
    const double low = std::floor(x);
    const auto f = static_cast<float>(x - low);
    return {static_cast<int>(low) - 1,
            {f * (-0.5F + f * (1 - 0.5F * f)), 1 + f * f * (-2.5F + 1.5F * f),
             f * (0.5F + f * (2 - 1.5F * f)), f * f * (-0.5F + 0.5F * f)}};
}

/// Separable interpolation: sum over the taps of all three axes of w_x w_y w_z times the voxel.
template <int Taps, class T>
float weighted_sum(const Image<T>& image, const Axis<Taps> (&axes)[3]) {
    std::size_t offset[3][Taps];
    for (int d = 0; d < 3; ++d)
        for (int n = 0; n < Taps; ++n) offset[d][n] = clamped(axes[d].first + n, image.size[d]);
    float sum = 0;
    for (int k = 0; k < Taps; ++k)
        for (int j = 0; j < Taps; ++j) {
            const T* row =
                image.values.data() + image.size[0] * (offset[1][j] + image.size[1] * offset[2][k]);
            float in_row = 0;
            for (int i = 0; i < Taps; ++i)
                in_row += axes[0].weights[i] * static_cast<float>(row[offset[0][i]]);
            sum += axes[1].weights[j] * axes[2].weights[k] * in_row;
        }
    return sum;
}

}  // namespace sampling

/// The image at a position within it (voxel coordinates).
template <Interpolation how, class T>
T sample(const Image<T>& image, const Eigen::Vector3d& place) {
    if constexpr (how == Interpolation::nearest) {
        const auto at = [&](int d) {
            return sampling::clamped(static_cast<int>(std::floor(place[d] + 0.5)), image.size[d]);
        };
        return image.at(at(0), at(1), at(2));
    } else if constexpr (how == Interpolation::linear) {
        return static_cast<T>(sampling::weighted_sum<2>(
            image, {sampling::linear_axis(place[0]), sampling::linear_axis(place[1]),
                    sampling::linear_axis(place[2])}));
    } else {
        return static_cast<T>(sampling::weighted_sum<4>(
            image, {sampling::cubic_axis(place[0]), sampling::cubic_axis(place[1]),
                    sampling::cubic_axis(place[2])}));
    }
}

}  // namespace livetet
