// `livetet bench registration`, of the shipped program.
#ifdef LIVETET_IMAGES
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/program.hpp"

namespace livetet {
namespace {

TEST(RegistrationBench, TheDeformingModelFindsTargetsThatARigidOneMisses) {
    const test::Folder folder;
    const auto outcome = test::livetet(folder,
                                       "bench registration --quick --seeds 1 --tets 2000 "
                                       "--truth-tets 2000 --json runs.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto runs = nlohmann::json::parse(test::text_of(folder / "runs.json"));
    ASSERT_EQ(runs.size(), 1);
    const auto& run = runs.front();
    EXPECT_EQ(run["refusal"], "");
    EXPECT_NEAR(run["targets_moved_mm"].get<double>(), 15, 3);
    EXPECT_GT(run["rigid_mm"].get<double>(), 3);
    EXPECT_LT(run["deforming_mm"].get<double>(), run["rigid_mm"].get<double>() / 1.5);
    EXPECT_EQ(run["motion_rigid_deforming_radius_mm"].size(), 32);
}

}  // namespace
}  // namespace livetet
#endif
