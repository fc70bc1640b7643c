#include "solvers/linear/live_support.hpp"

#include <gtest/gtest.h>

#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

MeshHierarchy block_of_levels(int levels) {
    std::vector<TetMesh> meshes;
    for (const std::array<int, 3> cells : {std::array{6, 4, 4}, std::array{3, 2, 2}})
        if (static_cast<int>(meshes.size()) < levels)
            meshes.push_back(test::block(cells, test::beam_size));
    return make_hierarchy(std::move(meshes), "a block");
}

TEST(LiveSupport, SaysWhatTheLiveSolverDoesNotTake) {
    const std::vector<Material> soft{{.young_Pa = 3000, .poisson = 0.4}};
    const auto reason = [&](const ModelChoice& model, Formulation formulation, int levels = 2) {
        return why_not_live({soft, model, formulation}, block_of_levels(levels));
    };
    using enum Formulation;
    EXPECT_EQ(reason("corotated", automatic), "");
    EXPECT_EQ(reason("linear", displacement), "");
    EXPECT_EQ(reason("neohookean", displacement), "");
    EXPECT_EQ(reason("corotated", mixed), "");
    EXPECT_NE(reason("corotated", displacement, 1), "");
    EXPECT_EQ(why_not_live({soft, "corotated"}, with_quadratic_level(block_of_levels(2))), "");
    EXPECT_NE(why_not_live({soft, "corotated"}, with_quadratic_level(block_of_levels(1))), "");
}

TEST(LiveSupport, AsksTheModuliOfEachRegion) {
    const auto reason = [](const ModelChoice& own, double young_Pa) {
        const std::vector<Material> two{{.young_Pa = 3000, .poisson = 0.4},
                                        {.young_Pa = young_Pa, .region = 2, .model = own}};
        return why_not_live({two, "corotated"}, block_of_levels(2));
    };
    EXPECT_EQ(reason({}, 9000), "");
    EXPECT_EQ(reason("corotated", 9000), "");
    EXPECT_EQ(reason("mooney_rivlin", 9000), "");
    EXPECT_NE(reason({}, 3e9), "");
}

}  // namespace
}  // namespace livetet
