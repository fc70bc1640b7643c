// `livetet bench registration`, of the shipped program.
#ifdef LIVETET_IMAGES
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "io/surface_file.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

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

TEST(RegistrationBench, TakesTheSurfaceOfAnotherOrgan) {
    const test::Folder folder;
    const TetMesh body = test::block({6, 5, 6}, {0.15, 0.10, 0.12});
    write_surface(folder / "organ.stl", {body.nodes, boundary_triangles(body.tets)}, Space::ras);
    const auto outcome = test::livetet(folder,
                                       "bench registration --quick --seeds 1 --tets 2000 "
                                       "--truth-tets 1500 --surface organ.stl --json runs.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto runs = nlohmann::json::parse(test::text_of(folder / "runs.json"));
    const auto& run = runs.front();
    EXPECT_EQ(run["refusal"], "");
    EXPECT_NEAR(run["targets_moved_mm"].get<double>(), 15, 3);
    EXPECT_LT(run["deforming_mm"].get<double>(), run["rigid_mm"].get<double>());
    EXPECT_EQ(run["motion_rigid_deforming_radius_mm"].size(), 32);
    test::expect_refused(test::livetet(folder, "bench registration --quick --surface none.stl"),
                         {"none.stl"});
}

}  // namespace
}  // namespace livetet
#endif
