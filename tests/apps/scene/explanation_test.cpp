#include "apps/scene/explanation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

namespace livetet {
namespace {

/// What is said of a part of a scene on a small mesh; none if nothing is.
std::optional<ExplainedPart> explained(const Scene& scene, const std::string& part) {
    const auto parts = explain_parts(scene, 1000, 2, SolverKind::multigrid);
    const auto found = std::ranges::find(parts, part, &ExplainedPart::part);
    if (found == parts.end()) return {};
    return *found;
}

Scene tracked_scene() {
    Scene scene;
    scene.track.emplace();
    return scene;
}

TargetOptions a_target() {
    TargetOptions target;
    target.name = "Vessel";
    target.point_mm = Eigen::Vector3d::Zero();
    return target;
}

TEST(Explanation, SpreadsHaveNoEffectWithoutTargets) {
    Scene scene = tracked_scene();
    EXPECT_FALSE(explained(scene, "spreads")) << "none is stated";
    scene.materials[0].poisson = {0.45, 0.03};
    scene.materials[0].young_Pa = {3000, 600};
    scene.fix.resize(2);
    scene.fix[0].stiffness_N_per_m = Uncertain(500, 200);
    scene.fix[1].spread_mm = 3;
    scene.track->sensors[0].patch_spread_mm = 2;
    const auto spreads = explained(scene, "spreads");
    ASSERT_TRUE(spreads);
    EXPECT_FALSE(spreads->built);
    EXPECT_EQ(spreads->why,
              "no effect without track.targets: materials[0].young_Pa, materials[0].poisson, "
              "fix[0].stiffness_N_per_m, fix[1].spread_mm, track.sensors[0].patch_spread_mm");
    scene.track->targets.push_back(a_target());
    EXPECT_FALSE(explained(scene, "spreads"));
    scene.track.reset();
    EXPECT_TRUE(explained(scene, "spreads")) << "`solve` takes none";
}

TEST(Explanation, AGradedMeshNamesItsPlaces) {
    Scene scene = tracked_scene();
    EXPECT_FALSE(explained(scene, "graded mesh")) << "no place is stated";
    scene.track->sensors[0].place_mm = Eigen::Vector3d(1, 2, 3);
    ASSERT_TRUE(explained(scene, "graded mesh"));
    EXPECT_FALSE(explained(scene, "graded mesh")->built);
    scene.mesh.grading = MeshGrading::scene;
    scene.drive.resize(1);
    scene.drive[0].group = "top";
    EXPECT_TRUE(explained(scene, "graded mesh")->built);
    EXPECT_EQ(explained(scene, "graded mesh")->why,
              "edges of 0.25 times the others at track.sensors[0].place_mm; not stated are the "
              "places of drive[0]");
}

TEST(Explanation, MoreThanOneNewtonIterationAFrameHasItsReason) {
    Scene scene = tracked_scene();
    scene.time.scheme = TimeScheme::newmark;
    EXPECT_FALSE(explained(scene, "Newton iterations")) << "one";
    scene.materials[0].poisson = 0.499;
    ASSERT_TRUE(explained(scene, "Newton iterations"));
    EXPECT_EQ(explained(scene, "Newton iterations")->why,
              "2 a frame: newmark near nu = 0.5: with one the body may keep swinging");
    scene.track->newton_iterations = 3;
    EXPECT_EQ(explained(scene, "Newton iterations")->why, "3 a frame: track.linearisations");
    scene.track.reset();
    EXPECT_FALSE(explained(scene, "Newton iterations"));
}

TEST(Explanation, TheSurfaceStatementComesWithTargets) {
    Scene scene = tracked_scene();
    EXPECT_FALSE(explained(scene, "surface statement"));
    scene.track->targets.push_back(a_target());
    ASSERT_TRUE(explained(scene, "surface statement"));
    EXPECT_TRUE(explained(scene, "surface statement")->built);
    scene.output.file = "none";
    EXPECT_FALSE(explained(scene, "surface statement")->built) << "nothing keeps it";
}

TEST(Explanation, TheSlipMonitorJudgesSensorsThatMaySlip) {
    Scene scene = tracked_scene();
    scene.track->sensors.resize(2);
    scene.track->sensors[1].may_slip = false;
    ASSERT_TRUE(explained(scene, "slip monitor"));
    EXPECT_TRUE(explained(scene, "slip monitor")->built);
    EXPECT_EQ(explained(scene, "slip monitor")->why.find("1 of 2 sensor(s)"), 0u);
    EXPECT_NE(explained(scene, "slip monitor")->why.find("second body"), std::string::npos);
    scene.track->sensors[0].may_slip = false;
    EXPECT_FALSE(explained(scene, "slip monitor")->built);
    scene.track->sensors.clear();
    EXPECT_EQ(explained(scene, "slip monitor")->why, "no sensors");
}

}  // namespace
}  // namespace livetet
