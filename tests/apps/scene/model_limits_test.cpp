#include "apps/scene/model_limits.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>

#include "support/hex_grids.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A block of 200 x 100 x 100 mm; its diagonal has 245 mm.
const TetMesh& limits_block() {
    static const TetMesh block = test::block({8, 4, 4}, {0.2, 0.1, 0.1});
    return block;
}

/// What is said of a block that is moved so, of a material of this model.
std::vector<std::string> said(const std::string& model,
                              const std::function<Vector3(const Vector3& x)>& moved_to) {
    Scene scene;
    scene.strain = ModelChoice(model);
    std::vector<Vector3> displacement;
    for (const Vector3& x : limits_block().nodes) displacement.push_back(moved_to(x) - x);
    return beyond_model(scene, limits_block(), displacement);
}

std::function<Vector3(const Vector3&)> stretched(double by) {
    return [by](const Vector3& x) { return Vector3((1 + by) * x.x(), x.y(), x.z()); };
}

std::function<Vector3(const Vector3&)> turned(double degrees) {
    return [turn = rotation_of_vector({0, 0, degrees * std::numbers::pi / 180})](const Vector3& x) {
        return Vector3(turn * x);
    };
}

TEST(BeyondModel, StrainsAreJudgedByWhatTheModelStandsFor) {
    for (const auto& [model, good, bad] :
         {std::tuple("linear", 0.04, 0.06), {"corotated", 0.45, 0.55}, {"neohookean", 0.9, 1.1}}) {
        EXPECT_TRUE(said(model, stretched(good)).empty()) << model;
        const std::vector<std::string> sentences = said(model, stretched(bad));
        ASSERT_EQ(sentences.size(), 1u) << model;
        EXPECT_NE(sentences[0].find(fmt::format("the largest is {:.0f} %", 100 * bad)),
                  std::string::npos)
            << sentences[0];
        EXPECT_NE(sentences[0].find("100 % of its volume"), std::string::npos) << sentences[0];
    }
}

TEST(BeyondModel, ARotationIsBeyondSmallStrainAlone) {
    EXPECT_TRUE(said("corotated", turned(40)).empty());
    EXPECT_TRUE(said("neohookean", turned(40)).empty());
    EXPECT_TRUE(said("linear", turned(4)).empty());
    const std::vector<std::string> sentences = said("linear", turned(15));
    ASSERT_EQ(sentences.size(), 1u);
    EXPECT_NE(sentences[0].find("Rotations are above 6 degrees"), std::string::npos)
        << sentences[0];
}

TEST(BeyondModel, ADisplacementLargerThanTheBodyIsSaid) {
    EXPECT_TRUE(said("corotated", [](const Vector3& x) {
                    return Vector3(x + Vector3(0.24, 0, 0));
                }).empty());
    const std::vector<std::string> sentences =
        said("corotated", [](const Vector3& x) { return Vector3(x + Vector3(17, 0, 0)); });
    ASSERT_EQ(sentences.size(), 1u);
    EXPECT_NE(sentences[0].find("1.7e+04 mm, is above the body's size, 244.9 mm"),
              std::string::npos)
        << sentences[0];
}

TEST(BeyondModel, APeakInLessThanAHundredthOfTheVolumeIsNone) {
    const Vector3 corner(0.2, 0.1, 0.1);
    EXPECT_TRUE(said("corotated",
                     [&](const Vector3& x) {
                         return Vector3((x - corner).norm() < 1e-9 ? x + Vector3(0.02, 0, 0) : x);
                     })
                    .empty())
        << "one node at a corner of 8 x 4 x 4 cells is pulled";
}

constexpr TimeScheme schemes[] = {TimeScheme::static_equilibrium, TimeScheme::implicit_euler,
                                  TimeScheme::newmark, TimeScheme::generalized_alpha};

/// A tracked scene whose second material is so.
Scene nearly_incompressible() {
    Scene scene;
    scene.track.emplace();
    scene.materials = {{.young_Pa = 3000, .poisson = 0.45}, {.young_Pa = 3000, .poisson = 0.499}};
    return scene;
}

TEST(ModelLimits, FramesOfNearlyIncompressibleBodiesInNewmarksStepsTakeTwoNewtonIterations) {
    Scene scene = nearly_incompressible();
    for (const TimeScheme scheme : schemes) {
        scene.time.scheme = scheme;
        EXPECT_EQ(newton_iterations_of_frame(scene), scheme == TimeScheme::newmark ? 2 : 1);
    }
    scene.time.scheme = TimeScheme::newmark;
    scene.formulation = Formulation::displacement;
    EXPECT_EQ(newton_iterations_of_frame(scene), 1);
    scene.formulation = Formulation::automatic;
    for (const int given : {1, 3}) {
        scene.track->newton_iterations = given;
        EXPECT_EQ(newton_iterations_of_frame(scene), given);
    }
    scene.track.reset();
    EXPECT_EQ(newton_iterations_of_frame(scene), 2) << "frames of a body without a tracker";
    scene.materials[1].poisson = 0.498;
    EXPECT_EQ(newton_iterations_of_frame(scene), 1);
}

TEST(ModelLimits, NewmarksStepsOfNearlyIncompressibleBodiesAreTold) {
    const TetMesh grid = test::hex_grid({2, 1, 1}, {0.2, 0.1, 0.1}), tets = limits_block();
    Scene scene = nearly_incompressible();
    for (const TimeScheme scheme : schemes) {
        scene.time.scheme = scheme;
        EXPECT_EQ(swinging_note(scene, grid).has_value(), scheme == TimeScheme::newmark);
        EXPECT_FALSE(swinging_note(scene, tets)) << "frames of two Newton iterations";
    }
    scene.time.scheme = TimeScheme::newmark;
    scene.track->newton_iterations = 1;
    EXPECT_NE(swinging_note(scene, tets)->find("track.linearisations: 2"), std::string::npos);
    scene.track->newton_iterations = 2;
    EXPECT_FALSE(swinging_note(scene, tets));
    EXPECT_TRUE(swinging_note(scene, grid));
    scene.track->newton_iterations = 1;
    scene.formulation = Formulation::displacement;
    EXPECT_FALSE(swinging_note(scene, tets));
    EXPECT_NE(swinging_note(scene, grid)->find("materials[1].poisson = 0.499"), std::string::npos);
    scene.materials[1].poisson = 0.495;
    EXPECT_FALSE(swinging_note(scene, grid));
    scene.materials[1].poisson = 0.4999;
    scene.track.reset();
    EXPECT_FALSE(swinging_note(scene, grid));
}

}  // namespace
}  // namespace livetet
