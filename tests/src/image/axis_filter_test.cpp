#include "image/axis_filter.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

TEST(AxisFilter, restricted_to_where_a_field_is_gives_the_same) {
    constexpr int voxels = 30, low = 11, high = 14;
    std::vector<float> field(voxels, 0.0f);
    for (int v = low; v <= high; ++v) field[v] = 1 + 0.5f * v;
    const AxisFilter whole = gaussian_beyond(voxels, 1.3, 0.7);
    std::array<int, 3> size{voxels, 1, 1}, part_size{high - low + 1, 1, 1};
    const std::vector<float> all = apply(whole, field, size, 0);
    int start = 0;
    const AxisFilter part = restricted(whole, low, high, start);
    const std::vector<float> near(field.begin() + low, field.begin() + high + 1);
    const std::vector<float> some = apply(part, near, part_size, 0);
    ASSERT_EQ(size[0], whole.size());
    ASSERT_EQ(part_size[0], part.size());
    EXPECT_LT(part.size(), whole.size());
    float sum = 0;
    for (int p = 0; p < whole.size(); ++p) {
        const bool in = p >= start && p < start + part.size();
        EXPECT_NEAR(all[p], in ? some[p - start] : 0.0f, 1e-6) << p;
        sum += all[p];
    }
    EXPECT_NEAR(sum * whole.step, 1 * 4 + 0.5 * (11 + 12 + 13 + 14), 0.02);
    EXPECT_NEAR(part.origin + low, whole.origin + start * whole.step, 1e-12);
}

}  // namespace
}  // namespace livetet
