#include "apps/live/target_responses.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "apps/live/response_nodes.hpp"
#include "apps/live/statement_fixture.hpp"
#include "mesh/surface_patch.hpp"

namespace livetet {
namespace {

using test::StatedBlock;

/// Displacements at the places by the scene's body with small strain, at rest but for the nodes
/// that are driven by 1 mm along an axis.
std::vector<Vector3> solved(const StatedBlock& block, Scene scene,
                            const std::vector<std::int32_t>& nodes, int axis) {
    scene.track.reset();
    scene.strain = "linear";
    scene.time.scheme = TimeScheme::static_equilibrium;
    DriveOptions& drive = scene.drive.emplace_back();
    drive.nodes.emplace(nodes.begin(), nodes.end());
    drive.displacement_mm = Vector3::Unit(axis);
    SceneBody body = make_body(PETSC_COMM_SELF, scene, block.hierarchy, Use::solve);
    SceneConstraints constraints(scene, body.mesh());
    constraints.move_to_share(1);
    body.body->set_constraints(constraints.constraints());
    body.body->set_springs(constraints.springs());
    EXPECT_TRUE(body.body->solve(0, {.tolerance = 1e-9, .linear_tolerance = 1e-10}).converged);
    return PointSampler(body.mesh(), block.places).sample(body.body->displacement());
}

std::vector<std::int32_t> top_within(const TetMesh& mesh, double radius) {
    return test::nodes_where(mesh, [&](const Vector3& x) {
        return x.z() > 0.0599 && (x - Vector3(0.04, 0.04, 0.06)).norm() < radius;
    });
}

ResponsePatch patch_of(const StatedBlock& block) {
    return {.nodes = top_within(block.mesh(), 0.016),
            .wider_nodes = top_within(block.mesh(), 0.021),
            .wider_by = 0.005,
            .radius_spread = 0.002,
            .centre = {0.04, 0.04, 0.06},
            .place = {0.04, 0.04, 0.06},
            .radius = 0.016};
}

/// All responses are what solves of bodies that differ so give.
TEST(TargetResponses, AreThoseOfBodiesThatDiffer) {
    const StatedBlock block;
    const ResponsePatch patch = patch_of(block);
    TargetResponses responses(block.scene, block.hierarchy, block.places);
    responses.start({patch}, block.scene.fix);
    EXPECT_FALSE(responses.are_known());
    while (responses.work()) {
    }
    ASSERT_TRUE(responses.are_known()) << responses.failure();
    ASSERT_EQ(responses.at(0, 0).materials.size(), 1u);

    Scene stiffer = block.scene, ten_nodes = block.scene;
    stiffer.materials[0].poisson = 0.47;
    ten_nodes.elements = Elements::p2;
    const TetMesh quadratic = quadratic_mesh(block.mesh());
    for (int axis = 0; axis < 3; ++axis) {
        const auto base = solved(block, block.scene, patch.nodes, axis);
        const auto wider = solved(block, block.scene, patch.wider_nodes, axis);
        const auto other = solved(block, stiffer, patch.nodes, axis);
        const auto fine = solved(block, ten_nodes,
                                 surface_patch(quadratic, patch.place, patch.radius).nodes, axis);
        for (std::size_t i = 0; i < block.places.size(); ++i) {
            const PatchResponse& r = responses.at(i, 0);
            const auto near = [&](const Vector3& found, const Vector3& expected, double within,
                                  const char* what) {
                EXPECT_LT((found - expected).norm(), within)
                    << what << ", place " << i << ", axis " << axis << ": " << found.transpose()
                    << " for " << expected.transpose();
            };
            near(r.motion.col(axis), 1e3 * base[i], 1e-3, "the model");
            near(2.5 * r.wider.col(axis), 1e3 * (wider[i] - base[i]), 2e-3, "wider");
            near(r.materials[0].col(axis), 1e3 * (other[i] - base[i]), 2e-3, "material");
            near(r.elements.col(axis), 1e3 * (fine[i] - base[i]), 2e-3, "elements");
        }
    }
    EXPECT_GT(responses.at(0, 0).wider.norm(), 5e-3) << "the test can fail";
    EXPECT_GT(responses.at(1, 0).materials[0].norm(), 5e-3);
    EXPECT_GT(responses.at(0, 0).elements.norm(), 0.02);
}

/// Ten-node elements are compared with those of edges twice as long: with an error of order 1.3,
/// the model has 1 / (2^1.3 - 1) of what the two differ by.
TEST(TargetResponses, OfTenNodeElementsExtrapolateFromTheNextLevel) {
    StatedBlock block;
    block.scene.elements = Elements::p2;
    block.scene.materials[0].poisson = 0.45;
    const TetMesh fine = quadratic_mesh(block.mesh()),
                  coarse = quadratic_mesh(block.hierarchy.levels[1]);
    ResponsePatch patch = patch_of(block);
    patch.nodes = surface_patch(fine, patch.place, patch.radius).nodes;
    TargetResponses responses(block.scene, block.hierarchy, block.places);
    EXPECT_TRUE(responses.knows_elements());
    responses.start({patch}, block.scene.fix);
    while (responses.work()) {
    }
    ASSERT_TRUE(responses.are_known()) << responses.failure();
    EXPECT_FALSE(responses.lacking().elements);
    StatedBlock below = block;
    below.hierarchy = make_hierarchy({block.hierarchy.levels[1]}, "half as fine");
    const auto coarse_nodes = surface_patch(coarse, patch.place, patch.radius).nodes;
    for (int axis = 0; axis < 3; ++axis) {
        const auto of_fine = solved(block, block.scene, patch.nodes, axis);
        const auto of_coarse = solved(below, block.scene, coarse_nodes, axis);
        for (std::size_t i = 0; i < block.places.size(); ++i) {
            const Vector3 left = 1e3 * (of_fine[i] - of_coarse[i]) / (std::pow(2, 1.3) - 1);
            EXPECT_LT((responses.at(i, 0).elements.col(axis) - left).norm(), 3e-3)
                << "place " << i << ", axis " << axis;
        }
    }
    EXPECT_GT(responses.at(0, 0).elements.norm(), 0.02) << "the test can fail";
}

/// A ring's displacement is that of its nodes, weighed. Without places the model's solves are all.
TEST(TargetResponses, KnowTheTissueAroundAPatchWithAndWithoutPlaces) {
    StatedBlock block;
    ResponsePatch patch = patch_of(block);
    patch.ring.nodes = test::nodes_where(block.mesh(), [](const Vector3& x) {
        return x.z() > 0.0599 && std::abs(x.y() - 0.04) < 1e-6 && x.x() > 0.065 && x.x() < 0.075;
    });
    ASSERT_EQ(patch.ring.nodes.size(), 1u);
    patch.ring.nodes.push_back(patch.ring.nodes.front() + 1);
    patch.ring.weights = {0.25, 0.75};
    block.places.clear();
    for (const std::int32_t n : patch.ring.nodes) block.places.push_back(block.mesh().nodes[n]);
    TargetResponses with(block.scene, block.hierarchy, block.places);
    TargetResponses without(block.scene, block.hierarchy, {});
    for (TargetResponses* responses : {&with, &without}) {
        responses->start({patch}, block.scene.fix);
        EXPECT_FALSE(responses->knows_rings());
        for (int unit = 0; unit < 4; ++unit) responses->work();  // set up, three translations
        EXPECT_TRUE(responses->knows_rings());
        EXPECT_EQ(responses->is_done(), responses == &without);
    }
    const Eigen::Matrix3d K = without.ring_response(0);
    EXPECT_EQ(with.ring_response(0), K);
    EXPECT_GT(K(0, 0), 0.1);
    EXPECT_LT(K(0, 0), 0.9);
    for (int axis = 0; axis < 3; ++axis) {
        const auto u = solved(block, block.scene, patch.nodes, axis);
        EXPECT_LT((K.col(axis) - 1e3 * (0.25 * u[0] + 0.75 * u[1])).norm(), 2e-3) << axis;
    }
}

/// What is fixed is listed on the body's mesh; the responses' has no midpoints of edges.
TEST(TargetResponses, TakeListsOfNodesOfATenNodeMesh) {
    StatedBlock block;
    block.scene.elements = Elements::p2;
    ResponsePatch patch = patch_of(block);
    patch.ring.nodes = {patch.nodes.front() + 1};
    patch.ring.weights = {1};
    Scene listed = block.scene;
    const TetMesh whole = quadratic_mesh(block.mesh());
    list_selected_nodes(listed, whole);
    ASSERT_GT(listed.fix[0].nodes->back(), static_cast<int>(block.mesh().nodes.size()));
    TargetResponses by_list(block.scene, block.hierarchy, {});
    TargetResponses by_region(block.scene, block.hierarchy, {});
    by_list.start({patch}, listed.fix);
    by_region.start({patch}, block.scene.fix);
    for (TargetResponses* responses : {&by_list, &by_region})
        while (responses->work()) {
        }
    ASSERT_TRUE(by_list.are_known()) << by_list.failure();
    ASSERT_TRUE(by_region.are_known()) << by_region.failure();
    EXPECT_GT(by_list.ring_response(0).norm(), 0.1);
    EXPECT_EQ(by_list.ring_response(0), by_region.ring_response(0));
}

/// What holds the body: its border off by less than an edge of the mesh, which is scaled; and the
/// stiffness of its springs.
TEST(TargetResponses, KnowWhatIsFixed) {
    StatedBlock block;
    const ResponsePatch patch = patch_of(block);
    FixOptions& table = block.scene.fix[0];
    table.box_mm = {-1, -1, -1, 41, 81, 1};  // half of it
    table.half_space_mm.reset();
    table.spread_mm = 5;
    FixOptions& side = block.scene.fix.emplace_back();
    side.half_space_mm = {0.1, 0, 0, 1, 0, 0};
    side.stiffness_N_per_m = {300, 100};
    TargetResponses responses(block.scene, block.hierarchy, block.places);
    responses.start({patch}, block.scene.fix);
    while (responses.work()) {
    }
    ASSERT_TRUE(responses.are_known()) << responses.failure();
    ASSERT_EQ(responses.at(0, 0).fixed.size(), 2u);
    Scene wider = block.scene, stiffer = block.scene;
    wider.fix[0].box_mm = {-1, -1, -1, 51, 81, 1};  // by the nodes at an edge's length
    wider.fix.emplace_back().box_mm = {-1, -1, -1, 41, 81, 11};
    stiffer.fix[1].stiffness_N_per_m = 400;
    const double tets = static_cast<double>(block.mesh().tets.size());
    const double edge = std::cbrt(6 * std::sqrt(2) * 0.08 * 0.08 * 0.06 / tets);  // of regular ones
    for (int axis = 0; axis < 3; ++axis) {
        const auto base = solved(block, block.scene, patch.nodes, axis);
        const auto by_border = solved(block, wider, patch.nodes, axis);
        const auto by_stiffness = solved(block, stiffer, patch.nodes, axis);
        for (std::size_t i = 0; i < block.places.size(); ++i) {
            const PatchResponse& r = responses.at(i, 0);
            const Vector3 border = 1e3 * (by_border[i] - base[i]);
            const Vector3 stiffness = 1e3 * (by_stiffness[i] - base[i]);
            EXPECT_LT((r.fixed[0].col(axis) - 0.005 / edge * border).norm(), 2e-3) << axis;
            EXPECT_LT((r.fixed[1].col(axis) - stiffness).norm(), 2e-3) << axis;
        }
    }
    EXPECT_GT(responses.at(0, 0).fixed[0].norm(), 0.02) << "the test can fail";
    EXPECT_GT(responses.at(0, 0).fixed[1].norm(), 5e-3);
}

/// A turn of the patch, and the gradient of the response, by their definitions.
TEST(TargetResponses, KnowTurnsAndGradients) {
    const StatedBlock block;
    ResponsePatch patch = patch_of(block);
    patch.turns = true;
    std::vector<Vector3> places = block.places;
    constexpr double step = 0.01;
    places.push_back(places[0] + Vector3(step, 0, 0));
    places.push_back(places[0] - Vector3(step, 0, 0));
    places.push_back(patch.centre + Vector3(0.01, 0, 0));  // a node of the patch
    TargetResponses responses(block.scene, block.hierarchy, places);
    responses.start({patch}, block.scene.fix);
    while (responses.work()) {
    }
    ASSERT_TRUE(responses.are_known()) << responses.failure();
    const Eigen::Matrix3d slope =
        (responses.at(2, 0).motion - responses.at(3, 0).motion).leftCols<3>() / (2 * step);
    EXPECT_LT((responses.at(0, 0).gradient[0] - slope).norm(), 0.5 * slope.norm());
    const auto& turn = responses.at(4, 0).motion;
    EXPECT_LT((turn.col(5) - Vector3(0, 0.01, 0)).norm(), 1e-5) << "about z";
    EXPECT_LT((turn.col(4) - Vector3(0, 0, -0.01)).norm(), 1e-5) << "about y";
}

/// Frames take the mean of patches that overlap.
TEST(TargetResponses, OfEqualPatchesAreThoseOfOneTogether) {
    const StatedBlock block;
    const ResponsePatch patch = patch_of(block);
    TargetResponses one(block.scene, block.hierarchy, block.places);
    TargetResponses two(block.scene, block.hierarchy, block.places);
    one.start({patch}, block.scene.fix);
    two.start({patch, patch}, block.scene.fix);
    while (one.work()) {
    }
    while (two.work()) {
    }
    ASSERT_TRUE(two.are_known()) << two.failure();
    for (std::size_t i = 0; i < block.places.size(); ++i)
        EXPECT_LT((two.at(i, 0).motion + two.at(i, 1).motion - one.at(i, 0).motion).norm(), 3e-3);
}

TEST(TargetResponses, SayWhyTheyCannotBeKnown) {
    StatedBlock block;
    const std::vector<FixOptions> on_table = block.scene.fix;
    std::vector<FixOptions> in_the_air = on_table;
    in_the_air[0].half_space_mm = {0, 0, -50, 0, 0, 1};
    const ResponsePatch patch = patch_of(block);
    TargetResponses responses(block.scene, block.hierarchy, block.places);
    responses.start({patch}, in_the_air);
    while (responses.work()) {
    }
    EXPECT_FALSE(responses.are_known());
    EXPECT_NE(responses.failure().find("fix[0] selects no node"), std::string::npos)
        << responses.failure();
    responses.start({}, {});
    EXPECT_TRUE(responses.are_known()) << "no patch, nothing to respond to";
    responses.start({patch}, on_table);
    while (responses.work()) {
    }
    EXPECT_TRUE(responses.are_known()) << "the table holds it now: " << responses.failure();
}

/// A border that may reach the patch says nothing of first order: that source is lacking, no other.
TEST(TargetResponses, LackWhatCannotBeComputedAndNoMore) {
    StatedBlock block;
    block.scene.fix[0].spread_mm = 55;  // of a block that is 60 mm high
    block.scene.fix.emplace_back(block.scene.fix[0]).spread_mm = 5;
    TargetResponses responses(block.scene, block.hierarchy, block.places);
    responses.start({patch_of(block)}, block.scene.fix);
    while (responses.work()) {
    }
    EXPECT_TRUE(responses.are_known());
    EXPECT_FALSE(responses.lacking().fixed) << "the top is 60 mm above it";
    block.scene.fix[0].spread_mm = 65;
    responses.start({patch_of(block)}, block.scene.fix);
    while (responses.work()) {
    }
    EXPECT_TRUE(responses.are_known());
    EXPECT_TRUE(responses.lacking().fixed);
    EXPECT_FALSE(responses.lacking().materials || responses.lacking().wider);
    EXPECT_TRUE(responses.knows_elements());
    EXPECT_EQ(responses.at(1, 0).fixed[0].norm(), 0);
    EXPECT_GT(responses.at(1, 0).fixed[1].norm(), 1e-3) << "the other border is known";
    EXPECT_GT(responses.at(0, 0).materials[0].norm(), 1e-3);
}

TEST(TargetResponses, OfALargeMeshOnSpringsLackTheElementsAndSaySoOnce) {
    StatedBlock block;
    const Vector3 size(0.08, 0.08, 0.06);
    const MeshHierarchy large = make_hierarchy(
        {test::block({16, 16, 12}, size), test::block({8, 8, 6}, size)}, "a large block");
    ASSERT_GT(large.levels.front().tets.size(), 15000u);
    TargetResponses responses(block.scene, large, block.places);
    const auto told = [&](std::vector<FixOptions> fix) {
        testing::internal::CaptureStderr();
        responses.start({}, fix);
        return testing::internal::GetCapturedStderr();
    };
    EXPECT_EQ(told(block.scene.fix), "");
    EXPECT_TRUE(responses.knows_elements());
    std::vector<FixOptions> on_springs = block.scene.fix;
    on_springs[0].stiffness_N_per_m = 300;
    const std::string warning = told(on_springs);
    EXPECT_FALSE(responses.knows_elements());
    EXPECT_NE(warning.find("lacks elements"), std::string::npos) << warning;
    EXPECT_NE(warning.find("fix has springs"), std::string::npos) << warning;
    EXPECT_EQ(told(on_springs), "");
}

/// Two patches hold the body that nothing else does: where both move, all of it follows.
TEST(TargetResponses, OfABodyThatOnlyItsPatchesHoldAreOneTogether) {
    StatedBlock block;
    const ResponsePatch top = patch_of(block);
    ResponsePatch below{.nodes = test::nodes_where(
                            block.mesh(),
                            [](const Vector3& x) {
                                return x.z() < 1e-4 && (x - Vector3(0.04, 0.04, 0)).norm() < 0.016;
                            }),
                        .place = {0.04, 0.04, 0},
                        .radius = 0.016};
    below.wider_nodes = below.nodes;
    TargetResponses responses(block.scene, block.hierarchy, block.places);
    responses.start({top, below}, {});
    while (responses.work()) {
    }
    ASSERT_TRUE(responses.are_known()) << responses.failure();
    const Eigen::Matrix3d motion =
        (responses.at(0, 0).motion + responses.at(0, 1).motion).leftCols<3>();
    EXPECT_LT((motion - Eigen::Matrix3d::Identity()).norm(), 1e-2) << motion;
    EXPECT_GT(responses.at(0, 1).motion.norm(), 0.1);
}

}  // namespace
}  // namespace livetet
