#include "mechanics/constraints.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

TEST(Constraints, PrescribeOnlyTheComponentsAsked) {
    Constraints constraints(3);
    constraints.prescribe(std::vector<std::int32_t>{1}, {1, 2, 3}, 4);
    EXPECT_EQ(constraints.components, (std::vector<std::uint8_t>{0, 4, 0}));
    EXPECT_EQ(constraints.values[1], Eigen::Vector3d(0, 0, 3));
}

TEST(Constraints, RefuseANodeThatThereIsNot) {
    Constraints constraints(3);
    for (const std::int32_t n : {-1, 3}) {
        const std::vector<std::int32_t> nodes{n};
        EXPECT_THROW(constraints.prescribe(nodes, Eigen::Vector3d::Zero()), Error) << n;
    }
}

}  // namespace
}  // namespace livetet
