#pragma once

#include <array>
#include <vector>

namespace livetet {

/// Least standard deviation of a Gaussian over voxels: less leaves the voxels' stairs in a surface.
constexpr double min_smoothing_voxels = 0.6;

/// A linear filter along one axis of a voxel grid: value p of the output is sum_i weights[p][i -
/// first[p]] * value i of the input.
struct AxisFilter {
    double origin = 0, step = 1;  ///< output sample p lies at voxel coordinate origin + p * step
    std::vector<int> first;
    std::vector<std::vector<float>> weights;

    int size() const { return static_cast<int>(first.size()); }
};

/// How many samples `gaussian_beyond` takes.
double gaussian_samples(int voxels, double sigma, double step);

/// A Gaussian of standard deviation sigma (voxels) about output samples every `step` voxels,
/// integrated over each voxel's width: w_i = (erf((i + 1/2 - x) / (sqrt(2) sigma)) - erf((i - 1/2 -
/// x) / (sqrt(2) sigma))) / 2. The samples reach so far beyond the `voxels` that the field is zero
/// there, as it is taken to be outside of the grid.
AxisFilter gaussian_beyond(int voxels, double sigma, double step);

/// The same at the voxels themselves, of the voxels that there are: weights add up to one at the
/// border, too.
AxisFilter gaussian_within(int voxels, double sigma);

/// The part of a filter that voxels low to high (inclusive) have a share in: input i is then voxel
/// low + i, and output p sample `start` + p.
AxisFilter restricted(const AxisFilter& filter, int low, int high, int& start);

/// Filters along `axis` (0 is the fastest): the field has `size` before, filter.size() along that
/// axis afterwards.
std::vector<float> apply(const AxisFilter& filter, const std::vector<float>& in,
                         std::array<int, 3>& size, int axis);

}  // namespace livetet
