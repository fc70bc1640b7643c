#include "geometry/surface_fit.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "mesh/shapes.hpp"
#include "support/points.hpp"

namespace livetet {
namespace {

using namespace test;
using Motion = RigidTransform<ImageFrame, ImageFrame>;

// A surface of the size of a liver, with three different axes, and a dent and a bulge that break
// every rotational symmetry.
TriangleMesh organ() {
    TriangleMesh mesh = shapes::sphere(1, 4);
    for (Vector3& x : mesh.nodes) {
        const double bulge = 1 + 0.25 * std::exp(-8 * (x - Vector3(0.6, 0.6, 0.5)).squaredNorm()) -
                             0.2 * std::exp(-8 * (x - Vector3(-0.5, 0.3, 0.8)).squaredNorm());
        x = bulge * x.cwiseProduct(Vector3(0.075, 0.055, 0.04));
    }
    return mesh;
}

// Points on some of its triangles.
Points points_on(const TriangleMesh& mesh, std::size_t count, unsigned seed, const auto& where) {
    std::mt19937_64 engine(seed);
    std::uniform_int_distribution<std::size_t> pick(0, mesh.triangles.size() - 1);
    std::uniform_real_distribution<double> unit(0, 1);
    Points points;
    while (points.size() < count) {
        const auto& [a, b, c] = mesh.triangles[pick(engine)];
        const double s = std::sqrt(unit(engine)), t = unit(engine);
        const Vector3d x =
            (1 - s) * mesh.nodes[a] + s * (1 - t) * mesh.nodes[b] + s * t * mesh.nodes[c];
        if (where(x)) points.push_back(x);
    }
    return points;
}
const auto anywhere = [](const Vector3d&) { return true; };

const Motion off{rotation_of_vector(Vector3d(0.06, -0.05, 0.07)), {0.004, -0.003, 0.005}};

double worst_error(const SurfaceFit& fit, const Points& moved, const Points& truth) {
    double worst = 0;
    for (std::size_t i = 0; i < moved.size(); ++i)
        worst = std::max(worst, (fit.image_from_start * moved[i] - truth[i]).norm());
    return worst;
}

TEST(SurfaceFit, BringsExactPointsBackOntoTheSurface) {
    const TriangleMesh surface = organ();
    const Points truth = points_on(surface, 300, 1, anywhere), moved = mapped(off, truth);
    const SurfaceFit fit = fit_to_surface(moved, surface);
    EXPECT_TRUE(fit.converged);
    EXPECT_LT(fit.iterations, 30);
    EXPECT_GT(fit.rms_before, 0.002);
    EXPECT_LT(fit.rms_after, 1e-6);
    EXPECT_LT(worst_error(fit, moved, truth), 1e-5);
    EXPECT_EQ(fit.used, 270u);
    EXPECT_EQ(fit.points, 300u);
    EXPECT_EQ(fit.free_motions, 0u);
    EXPECT_NEAR(fit.image_from_start.rotation.determinant(), 1, 1e-12);
}

TEST(SurfaceFit, LeavesOutPointsThatAreNotOnTheOrgan) {
    const TriangleMesh surface = organ();
    Points truth = points_on(surface, 300, 2, anywhere);
    for (std::size_t i = 0; i < 30; ++i) truth[10 * i] *= 1.3;  // 10 % of them far outside
    const Points moved = mapped(off, truth);
    const SurfaceFit trimmed = fit_to_surface(moved, surface, {.trimmed_share = 0.15});
    EXPECT_LT(worst_error(trimmed, moved, truth), 1e-4);
    EXPECT_GT(trimmed.rms_of_all, 100 * trimmed.rms_after);
    const SurfaceFit all = fit_to_surface(moved, surface, {.trimmed_share = 0});
    EXPECT_GT(worst_error(all, moved, truth), 0.001);
}

TEST(SurfaceFit, NoiseAveragesOutAsTheConstraintSays) {
    const TriangleMesh surface = organ();
    constexpr double noise = 0.001;  // metres, each axis
    constexpr std::size_t count = 400;
    std::vector<double> rms_after, weakest;
    double expected = 0;
    for (unsigned seed = 1; seed <= 40; ++seed) {
        Random random(seed);
        const Points truth = points_on(surface, count, seed, anywhere);
        Points moved = truth;
        for (Vector3d& p : moved) p += random.gaussian(noise);
        const SurfaceFit fit = fit_to_surface(moved, surface, {.trimmed_share = 0});
        rms_after.push_back(fit.rms_after);
        // Expected error along the least constrained motion: noise / sqrt(n constraint).
        const PointMotion& m = fit.motions.front();
        double along = 0;
        Vector3d mean = Vector3d::Zero();
        for (const Vector3d& p : truth) mean += p / count;
        const double size = std::sqrt(std::accumulate(
            truth.begin(), truth.end(), 0.0,
            [&](double s, const Vector3d& p) { return s + (p - mean).squaredNorm() / count; }));
        const Eigen::AngleAxisd turn(fit.image_from_start.rotation);
        along += turn.angle() * turn.axis().dot(m.turn) * size;
        along += (fit.image_from_start * mean - mean).dot(m.slide);
        weakest.push_back(along);
        expected += noise / std::sqrt(count * m.constraint) / 40;
    }
    EXPECT_NEAR(rms(rms_after), noise, 0.1 * noise);
    EXPECT_NEAR(rms(weakest), expected, 0.35 * expected);
}

TEST(SurfaceFit, SaysAndKeepsTheMotionsThatAPlaneDoesNotHold) {
    const TriangleMesh plate = [] {
        const TetMesh box = shapes::box({0.2, 0.2, 0.05}, {8, 8, 2});
        return TriangleMesh{box.nodes, boundary_triangles(box.tets)};
    }();
    const Points truth = points_on(plate, 200, 3, [](const Vector3d& x) {
        return x.z() > 0.05 - 1e-9 && (x - Vector3d(0.1, 0.1, 0.05)).norm() < 0.06;
    });
    const Motion slid{rotation_of_vector(Vector3d(0.02, 0, 0.1)), {0.005, 0.003, 0.002}};
    const Points moved = mapped(slid, truth);
    const SurfaceFit fit = fit_to_surface(moved, plate);
    EXPECT_EQ(fit.free_motions, 3u);
    // Translations along the plane and the rotation about its normal.
    for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(fit.motions[k].slide.z(), 0, 1e-6);
        EXPECT_NEAR(fit.motions[k].turn.head<2>().norm(), 0, 1e-6);
        EXPECT_LT(fit.motions[k].constraint, 1e-9);
    }
    EXPECT_LT(fit.rms_after, 1e-6);
    // Unconstrained motions are unchanged: the rotation by 0.1 about the normal.
    const Matrix3d left = fit.image_from_start.rotation * slid.rotation;
    EXPECT_NEAR(std::atan2(left(1, 0), left(0, 0)), 0.1, 1e-3);
}

TEST(SurfaceFit, ABallTurnsFreelyAndACylinderOnlyAboutItsAxis) {
    const TriangleMesh ball = shapes::sphere(0.05, 5);
    const Points on_ball =
        mapped(Motion{Matrix3d::Identity(), {0.002, 0, 0.001}}, points_on(ball, 400, 4, anywhere));
    const SurfaceFit fit = fit_to_surface(on_ball, ball);
    EXPECT_EQ(fit.free_motions, 3u);
    for (int k = 0; k < 3; ++k) EXPECT_LT(fit.motions[k].slide.norm(), 0.2);
    EXPECT_GT(fit.motions[3].constraint, 0.2);
    EXPECT_LT((fit.image_from_start * Vector3d(0.002, 0, 0.001)).norm(), 1e-4);

    TriangleMesh egg = shapes::sphere(0.05, 5);
    for (Vector3& x : egg.nodes) x.z() *= 2;
    const SurfaceFit on_egg = fit_to_surface(points_on(egg, 400, 5, anywhere), egg);
    EXPECT_EQ(on_egg.free_motions, 1u);
    EXPECT_GT(std::abs(on_egg.motions[0].turn.z()), 0.95);
}

TEST(SurfaceFit, RefusesWhatCannotBeFitted) {
    const TriangleMesh surface = organ();
    Points points = points_on(surface, 20, 6, anywhere);
    EXPECT_NE(message_of([&] {
                  fit_to_surface(std::span(points).first(9), surface);
              }).find("9 points, expected at least"),
              std::string::npos);
    EXPECT_THROW(fit_to_surface(points, {}), Error);
    EXPECT_THROW(fit_to_surface(points, surface, {.trimmed_share = 0.5}), Error);
    EXPECT_THROW(fit_to_surface(points, surface, {.trimmed_share = -0.1}), Error);
    points[4].x() = std::nan("");
    EXPECT_NE(message_of([&] { fit_to_surface(points, surface); }).find("point 5 of 20"),
              std::string::npos);
}

}  // namespace
}  // namespace livetet
