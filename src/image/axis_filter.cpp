#include "image/axis_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

namespace livetet {

namespace {

constexpr double gaussian_reach = 4.0;  // standard deviations

void add_sample(AxisFilter& filter, int voxels, double sigma) {
    const double x = filter.origin + filter.size() * filter.step, reach = gaussian_reach * sigma;
    const int low = std::clamp(static_cast<int>(std::floor(x - reach)), 0, voxels - 1);
    const int high = std::clamp(static_cast<int>(std::ceil(x + reach)), 0, voxels - 1);
    std::vector<float> weights;
    const auto below = [&](double edge) {
        return 0.5 * std::erf((edge - x) / (std::numbers::sqrt2 * sigma));
    };
    for (int i = low; i <= high; ++i)
        weights.push_back(static_cast<float>(below(i + 0.5) - below(i - 0.5)));
    filter.first.push_back(low);
    filter.weights.push_back(std::move(weights));
}

}  // namespace

double gaussian_samples(int voxels, double sigma, double step) {
    return std::ceil((voxels - 1 + 2 * (gaussian_reach * sigma + step)) / step) + 1;
}

AxisFilter gaussian_beyond(int voxels, double sigma, double step) {
    AxisFilter filter;
    const int count = static_cast<int>(gaussian_samples(voxels, sigma, step));
    filter.step = step;
    filter.origin = (voxels - 1 - (count - 1) * step) / 2;
    for (int p = 0; p < count; ++p) add_sample(filter, voxels, sigma);
    return filter;
}

AxisFilter gaussian_within(int voxels, double sigma) {
    AxisFilter filter;
    for (int p = 0; p < voxels; ++p) {
        add_sample(filter, voxels, sigma);
        float sum = 0;
        for (const float w : filter.weights.back()) sum += w;
        for (float& w : filter.weights.back()) w /= sum;
    }
    return filter;
}

AxisFilter restricted(const AxisFilter& filter, int low, int high, int& start) {
    AxisFilter part;
    part.step = filter.step;
    start = filter.size();
    for (int p = 0; p < filter.size(); ++p) {
        const int from = std::max(low, filter.first[p]);
        const int to =
            std::min(high, filter.first[p] + static_cast<int>(filter.weights[p].size()) - 1);
        if (from > to) continue;
        start = std::min(start, p);
        const auto weights = filter.weights[p].begin();
        part.first.push_back(from - low);
        part.weights.emplace_back(weights + (from - filter.first[p]),
                                  weights + (to + 1 - filter.first[p]));
    }
    part.origin = filter.origin + start * filter.step - low;
    return part;
}

std::vector<float> apply(const AxisFilter& filter, const std::vector<float>& in,
                         std::array<int, 3>& size, int axis) {
    const std::size_t inner = axis == 0   ? 1
                              : axis == 1 ? size[0]
                                          : static_cast<std::size_t>(size[0]) * size[1];
    const std::size_t outer = in.size() / inner / size[axis];
    std::vector<float> out(inner * filter.size() * outer, 0.0f);
    for (std::size_t o = 0; o < outer; ++o)
        for (int p = 0; p < filter.size(); ++p) {
            float* to = &out[inner * (p + static_cast<std::size_t>(filter.size()) * o)];
            const float* from =
                &in[inner * (filter.first[p] + static_cast<std::size_t>(size[axis]) * o)];
            for (const float w : filter.weights[p]) {
                for (std::size_t i = 0; i < inner; ++i) to[i] += w * from[i];
                from += inner;
            }
        }
    size[axis] = filter.size();
    return out;
}

}  // namespace livetet
