/// The errors of the model that an ErrorStatement states, while a patch is pressed. Patches and
/// materials: what the model was told is drawn by its spread, and the body is solved with it.
/// Elements, law and solver are no random variables: they are differences of two computations, each
/// counted as one standard deviation, so there is nothing to draw. They are compared with the
/// differences of bodies that are solved here.

#include "apps/live/error_statement.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "apps/live/monte_carlo.hpp"
#include "mesh/surface_patch.hpp"

namespace livetet {
namespace {

using test::BlockStatement;
using test::MeanSquare;
using test::NormalDraws;
using test::StaticBody;
using test::TargetBlock;
using test::TrackedFrames;

Eigen::Matrix3d square_of(const Vector3& error) { return error * error.transpose(); }

/// Moves a patch that was placed at `at`.
void press(SensorPatch& patch, double time_s, const Vector3& at, const Vector3& motion,
           const TrackedFrames& frames) {
    patch.follow(time_s, frames.sensor_at(at + motion), frames.tracker_from_reference(),
                 frames.image_from_reference);
    ASSERT_LT((patch.motion().head<3>() - motion).norm(), 1e-6 * motion.norm());
}

/// A bar, 120 mm long, that is pressed in its middle. It is long and even along x: a patch that
/// moves along it meets the same body, up to the ends. Its mesh is fine enough for gradients.
class PressedBar : public ::testing::Test {
  protected:
    static void SetUpTestSuite() {
        state_ = std::make_unique<State>();
        state_->linear = StaticBody(state_->block.scene, state_->block.hierarchy)
                             .moved(state_->pressed.nodes(), motion());
    }
    static void TearDownTestSuite() { state_.reset(); }  // before PETSc ends

    static Vector3 sensor_place() { return {0.06, 0.005, 0.04}; }
    static Vector3 motion() { return {0.002, -0.001, -0.004}; }
    static const TargetBlock& block() { return state_->block; }
    static const std::vector<std::int32_t>& nodes() { return state_->pressed.nodes(); }
    /// The same patch on another mesh of the bar.
    static std::vector<std::int32_t> nodes_of(const StaticBody& body) {
        return surface_patch(body.mesh(), sensor_place(), options().radius).nodes;
    }
    /// Of the bar's nodes in the linear model.
    static const std::vector<Vector3>& linear() { return state_->linear; }
    static std::vector<Vector3> at_targets(const StaticBody& body, const std::vector<Vector3>& u) {
        return body.sample(block().places, u);
    }
    /// While pressed. Without an estimate of the poses' errors, and with no spread of the material.
    static FrameStatement stated(const std::vector<Vector3>& displacement,
                                 const ExpectedRegistrationError* registration = nullptr,
                                 std::optional<double> solver_error = {}) {
        return state_->statement(poses(registration), {&state_->pressed}, displacement,
                                 solver_error);
    }
    static FrameStatement stated_at_rest(const ExpectedRegistrationError* registration) {
        return state_->statement(poses(registration), {&state_->resting});
    }
    static const SensorPatchOptions& options() { return state_->pressed.options(); }
    static const TrackedFrames& frames() { return state_->frames; }

  private:
    static PoseErrors poses(const ExpectedRegistrationError* registration) {
        return {nullptr, frames().image_from_reference, registration};
    }
    static SensorPatchOptions patch_options() {
        SensorPatchOptions options = test::exact_patch();
        options.radius = 0.0125;
        options.radius_spread = 0.003;
        return options;
    }
    struct State {
        TargetBlock block{test::block({24, 2, 8}, {0.12, 0.01, 0.04}),
                          {{0.08, 0.007, 0.015}, {0.085, 0.002, 0.025}}};
        TrackedFrames frames{};
        SensorPatch resting{patch_options()};
        double time_s = test::place_at(resting, sensor_place(), frames, block.mesh());
        SensorPatch pressed{resting};
        BlockStatement statement{block, {&resting}};
        std::vector<Vector3> linear{};
        State() { press(pressed, time_s, sensor_place(), motion(), frames); }
    };
    static inline std::unique_ptr<State> state_;
};

/// An error of the registration puts the patch elsewhere on the organ, here along the bar by a
/// standard deviation of 2 mm. The body is solved with the patch moved by every millimetre, with
/// the mesh about it; between them the target's displacement is interpolated. The slack is for the
/// gradient, which the statement takes over the length of an edge.
TEST_F(PressedBar, ThePlaceOfThePatchErrsAsStated) {
    constexpr double spread = 2e-3, step = 1e-3;
    constexpr int steps = 8;            // to either side
    Eigen::Matrix<double, 6, 1> error;  // one cause moves and turns: along x at the patch
    error.tail<3>() << 0.01, -0.02, 0.015;
    const Vector3 arm = sensor_place() - frames().image_from_reference.translation;
    error.head<3>() = Vector3(spread, 0, 0) - error.tail<3>().cross(arm);
    const ExpectedRegistrationError registration{error * error.transpose(), true};
    const FrameStatement with = stated(linear(), &registration), without = stated(linear());
    const FrameStatement of_fiducials = stated_at_rest(&registration);

    std::vector<std::vector<Vector3>> displacements;
    for (int k = -steps; k <= steps; ++k) {
        TetMesh mesh = block().mesh();
        for (Vector3& x : mesh.nodes)  // all but the last 20 mm at the ends goes with the patch
            x.x() += k * step * std::clamp(std::min(x.x(), 0.12 - x.x()) / 0.02, 0.0, 1.0);
        StaticBody body(block().scene, make_hierarchy({mesh}, "a bar with its patch moved"));
        displacements.push_back(at_targets(body, body.moved(nodes(), motion())));
    }
    NormalDraws draws(81);
    std::array<MeanSquare, 2> found;
    for (int draw = 0; draw < 4000; ++draw) {
        const double along = std::clamp(spread * draws() / step, -steps + 0.0, steps - 1e-9);
        const double below = std::floor(along);
        const auto k = static_cast<std::size_t>(below + steps);
        for (std::size_t i = 0; i < 2; ++i)
            found[i].add((1 - along + below) * displacements[k][i] +
                         (along - below) * displacements[k + 1][i] - displacements[steps][i]);
    }
    for (std::size_t i = 0; i < 2; ++i)
        EXPECT_TRUE(found[i].is(with.targets[i].covariance - without.targets[i].covariance -
                                    of_fiducials.targets[i].covariance,
                                0.2))
            << "target " << i;
}

/// The patch of another radius is the one that a sensor with it would choose. It grows by nodes,
/// and so does the displacement at a target: hence the slack.
TEST_F(PressedBar, TheRadiusOfThePatchErrsAsStated) {
    constexpr double step = 5e-4, least = 3e-3, most = 22e-3;
    StaticBody body(block().scene, block().hierarchy);
    std::vector<std::vector<Vector3>> displacements;  // of every radius
    std::size_t nodes_before = 0;
    for (double radius = least; radius < most; radius += step) {
        const auto patch = surface_patch(block().mesh(), sensor_place(), radius).nodes;
        displacements.push_back(patch.size() == nodes_before
                                    ? displacements.back()
                                    : at_targets(body, body.moved(patch, motion())));
        nodes_before = patch.size();
    }
    const auto of_radius = [&](double radius) {
        const double k = std::round((radius - least) / step);
        return displacements[static_cast<std::size_t>(
            std::clamp(k, 0.0, static_cast<double>(displacements.size() - 1)))];
    };
    // The statement has the error of the elements, too; nothing else errs, as the displacement is
    // the linear one and the sensor is at a node, in the middle of its patch.
    Scene ten_nodes = block().scene;
    ten_nodes.elements = Elements::p2;
    StaticBody fine(ten_nodes, block().hierarchy);
    const auto by_fine = at_targets(fine, fine.moved(nodes_of(fine), motion()));
    const FrameStatement all = stated(linear());

    NormalDraws draws(82);
    std::array<MeanSquare, 2> found;
    const auto expected = of_radius(options().radius);
    for (int draw = 0; draw < 4000; ++draw) {
        const auto drawn = of_radius(options().radius + options().radius_spread * draws());
        for (std::size_t i = 0; i < 2; ++i) found[i].add(drawn[i] - expected[i]);
    }
    for (std::size_t i = 0; i < 2; ++i)
        EXPECT_TRUE(
            found[i].is(all.targets[i].covariance - square_of(by_fine[i] - expected[i]), 0.25))
            << "target " << i;
}

/// Elements: ten nodes against four. Law: 30 % of what large strain changes. Solver: a third of the
/// square along each axis.
TEST_F(PressedBar, ElementsLawAndSolverAreTheDifferencesOfBodies) {
    Scene ten_nodes = block().scene;
    ten_nodes.elements = Elements::p2;
    StaticBody model(block().scene, block().hierarchy), fine(ten_nodes, block().hierarchy);
    StaticBody of_large_strain(block().scene, block().hierarchy, "corotated");
    const auto of_large = of_large_strain.moved(nodes(), motion());
    const auto u = at_targets(model, linear()), by_large = at_targets(model, of_large);
    const auto by_fine = at_targets(fine, fine.moved(nodes_of(fine), motion()));
    constexpr double solver_error = 2e-5;
    const FrameStatement at_linear = stated(linear()), at_large = stated(of_large);
    const FrameStatement cut_short = stated(linear(), nullptr, solver_error);
    for (std::size_t i = 0; i < 2; ++i) {
        const Eigen::Matrix3d& without = at_linear.targets[i].covariance;
        const double elements =
            at_linear.targets[i].by_source[static_cast<std::size_t>(ErrorSource::elements)];
        EXPECT_NEAR(std::sqrt(elements), (by_fine[i] - u[i]).norm(), 2e-3 * motion().norm());
        const Eigen::Matrix3d law = square_of(0.3 * (by_large[i] - u[i]));
        EXPECT_LT((at_large.targets[i].covariance - without - law).norm(), 0.25 * law.norm())
            << "target " << i;
        EXPECT_LT((cut_short.targets[i].covariance - without -
                   std::pow(solver_error, 2) / 3 * Eigen::Matrix3d::Identity())
                      .norm(),
                  1e-6 * std::pow(solver_error, 2));
    }
}

/// A block of two layers. A body that is driven by displacements alone knows but the ratio of the
/// moduli, and that matters between layers.
TargetBlock layered_block() {
    TetMesh mesh = test::block({4, 4, 4}, {0.08, 0.08, 0.06});
    for (const Tet& tet : mesh.tets) {
        double height = 0;
        for (const std::int32_t n : tet) height += mesh.nodes[n].z() / 4;
        mesh.regions.push_back(height < 0.03 ? 1 : 2);
    }
    TargetBlock block(std::move(mesh), {{0.044, 0.037, 0.042}, {0.055, 0.046, 0.03}});
    block.scene.materials = {
        {.young_Pa = {9000, 900}, .poisson = {0.38, 0.015}, .region = 1},
        {.young_Pa = {3000, 300}, .poisson = {0.36, 0.02}, .region = 2},
    };
    return block;
}

/// The four values are drawn, and the body is made of them. It is not quite linear in them: hence
/// the slack.
TEST(ErrorStatementMonteCarlo, MaterialsErrAsStated) {
    const TargetBlock block = layered_block();
    TargetBlock certain = block;
    for (Material& m : certain.scene.materials) m.young_Pa.spread = m.poisson.spread = 0;
    const Vector3 at(0.04, 0.04, 0.06), motion(0.004, -0.003, -0.008);
    const TrackedFrames frames;
    SensorPatchOptions options = test::exact_patch();
    options.radius = 0.021;  // the node at the sensor and those next to it
    SensorPatch patch(options);
    const double time_s = test::place_at(patch, at, frames, block.mesh());
    BlockStatement statement(block, {&patch}), of_certain(certain, {&patch});
    press(patch, time_s, at, motion, frames);
    const PoseErrors poses{.image_from_reference = frames.image_from_reference};
    const FrameStatement with = statement(poses, {&patch}), without = of_certain(poses, {&patch});

    const auto solved = [&](const Scene& scene) {
        StaticBody body(scene, block.hierarchy);
        return body.sample(block.places, body.moved(patch.nodes(), motion));
    };
    const auto expected = solved(certain.scene);
    NormalDraws draws(83);
    std::array<MeanSquare, 2> found;
    for (int draw = 0; draw < 250; ++draw) {
        Scene drawn = block.scene;
        for (Material& m : drawn.materials)
            for (Uncertain* value : {&m.young_Pa, &m.poisson})
                *value = value->value + value->spread * draws();
        const auto u = solved(drawn);
        for (std::size_t i = 0; i < 2; ++i) found[i].add(u[i] - expected[i]);
    }
    for (std::size_t i = 0; i < 2; ++i)
        EXPECT_TRUE(found[i].is(with.targets[i].covariance - without.targets[i].covariance, 0.1))
            << "target " << i;
}

}  // namespace
}  // namespace livetet
