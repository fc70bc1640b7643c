#pragma once

#include <array>
#include <vector>

namespace livetet {

/// Minimum standard deviation of a Gaussian, in voxels. Less leaves the voxels' stair steps in a
/// surface.
constexpr double min_smoothing_voxels = 0.6;

/// Linear filter along one axis of a voxel grid: out[p] = sum_i weights[p][i - first[p]] * in[i].
struct AxisFilter {
    double origin = 0, step = 1;  ///< output sample p is at voxel coordinate origin + p * step
    std::vector<int> first;
    std::vector<std::vector<float>> weights;

    int size() const { return static_cast<int>(first.size()); }
};

/// Number of samples of `gaussian_beyond`.
double gaussian_samples(int voxels, double sigma, double step);

/// Gaussian of standard deviation sigma (voxels), sampled every `step` voxels and integrated over
/// each voxel's width. The weight of voxel i at sample x is
///
///     w_i = (erf((i + 1/2 - x) / (sqrt(2) sigma)) - erf((i - 1/2 - x) / (sqrt(2) sigma))) / 2
///
/// The input is zero outside the grid. The samples extend so far beyond the `voxels` that the
/// outermost are zero.
AxisFilter gaussian_beyond(int voxels, double sigma, double step);

/// The same Gaussian sampled at the voxels, with weights normalised to one at the border too.
AxisFilter gaussian_within(int voxels, double sigma);

/// Restricts a filter to the input voxels low to high (inclusive). Input i of the result is voxel
/// low + i; output p is sample `start` + p.
AxisFilter restricted(const AxisFilter& filter, int low, int high, int& start);

/// Filters `in` along `axis` (0 is the fastest). `size` is the grid's size; its entry for `axis`
/// becomes filter.size().
std::vector<float> apply(const AxisFilter& filter, const std::vector<float>& in,
                         std::array<int, 3>& size, int axis);

}  // namespace livetet
