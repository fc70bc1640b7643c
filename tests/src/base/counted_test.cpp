#include "base/counted.hpp"

#include <gtest/gtest.h>

namespace livetet {
namespace {

TEST(Counted, OnlyOneIsSingular) {
    EXPECT_EQ(counted(0, "frame"), "0 frames");
    EXPECT_EQ(counted(1U, "frame"), "1 frame");
    EXPECT_EQ(counted(2, "Newton iteration"), "2 Newton iterations");
    EXPECT_EQ(counted(1, "hexahedron", "hexahedra"), "1 hexahedron");
    EXPECT_EQ(counted(0, "hexahedron", "hexahedra"), "0 hexahedra");
}

}  // namespace
}  // namespace livetet
