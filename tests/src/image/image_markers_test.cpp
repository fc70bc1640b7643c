#include "image/image_markers.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <random>

#include "support/points.hpp"

namespace livetet {
namespace {

using test::message_of;
using test::rms;

/// An anisotropic, oblique grid, optionally left-handed, sheared by `shear`.
GreyImage grid(std::array<int, 3> size, const Vector3& spacing_mm, const Vector3& turn,
               double shear = 0, bool left = false) {
    GreyImage image;
    image.size = size;
    Eigen::Matrix3d axes = 1e-3 * spacing_mm.asDiagonal().toDenseMatrix();
    axes(0, 1) = shear * axes(1, 1);
    if (left) axes.col(0) *= -1;
    if (turn.norm() > 0)
        axes = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * axes;
    image.ras_from_voxel.topLeftCorner<3, 3>() = axes;
    image.ras_from_voxel.topRightCorner<3, 1>() =
        Vector3(0.02, -0.03, 0.1) - axes * Vector3(size[0], size[1], size[2]) / 2;
    image.values.resize(static_cast<std::size_t>(size[0]) * size[1] * size[2]);
    return image;
}

Vector3 place_of(const GreyImage& image, const Vector3& voxel) {
    return (image.ras_from_voxel * voxel.homogeneous()).head<3>();
}

/// Averages `value(position)` over each voxel's volume (6^3 samples) and adds normal noise.
void fill(GreyImage& image, double noise, unsigned seed, const auto& value) {
    std::mt19937_64 engine(seed);
    std::normal_distribution<double> normal(0, 1);
    constexpr int n = 6;
    for (int k = 0; k < image.size[2]; ++k)
        for (int j = 0; j < image.size[1]; ++j)
            for (int i = 0; i < image.size[0]; ++i) {
                double sum = 0;
                for (int s = 0; s < n * n * n; ++s)
                    sum += value(place_of(
                        image, Vector3(i + (s % n + 0.5) / n - 0.5, j + (s / n % n + 0.5) / n - 0.5,
                                       k + (s / n / n + 0.5) / n - 0.5)));
                image.at(i, j, k) = static_cast<float>(sum / (n * n * n) + noise * normal(engine));
            }
}

struct Grid {
    const char* name;
    std::array<int, 3> size;
    Vector3 spacing_mm, turn;
    double shear = 0;
    bool left = false;
};
const Grid grids[] = {{"cubes", {40, 40, 40}, {1.2, 1.2, 1.2}, {0, 0, 0}},
                      {"anisotropic", {56, 48, 16}, {0.9, 0.9, 3}, {0, 0, 0}},
                      {"oblique", {48, 48, 24}, {1, 1, 2}, {0.3, -0.2, 0.5}},
                      {"left-handed", {48, 48, 24}, {1, 1, 2}, {0.3, -0.2, 0.5}, 0, true},
                      {"sheared", {48, 48, 24}, {1, 1, 2}, {0.1, 0.2, 0}, 0.3}};

TEST(ImageMarkers, AreFoundWithinAFewHundredthsOfAVoxelOnAnyGrid) {
    constexpr double radius = 0.005;
    for (const Grid& g : grids)
        for (const MarkerShade shade : {MarkerShade::bright, MarkerShade::dark}) {
            GreyImage image = grid(g.size, g.spacing_mm, g.turn, g.shear, g.left);
            const Vector3 extent(g.size[0], g.size[1], g.size[2]);
            const std::vector<Vector3> truth{
                place_of(image, extent.cwiseProduct(Vector3(0.31, 0.33, 0.44)) +
                                    Vector3(0.13, 0.41, 0.27)),
                place_of(image, extent.cwiseProduct(Vector3(0.68, 0.64, 0.55)) +
                                    Vector3(0.37, -0.22, 0.45))};
            const double sign = shade == MarkerShade::bright ? 1 : -1;
            // A background gradient that changes across a ball by a third of its contrast.
            fill(image, 0, 1, [&](const Vector3& x) {
                double value = 300 + sign * 10000 * (x - truth[0]).dot(Vector3(1, -1, 0.5));
                for (const Vector3& c : truth) value += (x - c).norm() < radius ? sign * 400 : 0;
                return value;
            });
            const auto found = find_markers(image, {.diameter = 2 * radius, .shade = shade});
            ASSERT_GE(found.size(), 2u) << g.name;
            for (const Vector3& c : truth) {
                const double off =
                    std::min((found[0].centre - c).norm(), (found[1].centre - c).norm());
                EXPECT_LT(1e3 * off, 0.02 * g.spacing_mm.maxCoeff()) << g.name;
            }
            for (int m = 0; m < 2; ++m) {
                EXPECT_NEAR(found[m].contrast, 400, 20) << g.name;
                EXPECT_GT(found[m].fit, 0.98) << g.name;
            }
            if (found.size() > 2) {
                EXPECT_LT(found[2].score(), 0.3 * found[1].score()) << g.name;
            }
        }
}

TEST(ImageMarkers, TheirUncertaintyIsTheErrorThatNoiseMakes) {
    std::vector<double> errors, told;
    for (unsigned seed = 1; seed <= 60; ++seed) {
        GreyImage image = grid({20, 20, 20}, {1.5, 1.5, 1.5}, {0, 0, 0});
        const Vector3 c = place_of(image, Vector3(9.5 + 0.01 * seed, 10.2, 9.9 - 0.007 * seed));
        fill(image, 60, seed,
             [&](const Vector3& x) { return (x - c).norm() < 0.005 ? 500.0 : 100.0; });
        const auto found = find_markers(image, {.diameter = 0.01});
        ASSERT_FALSE(found.empty());
        errors.push_back((found[0].centre - c).norm());
        told.push_back(found[0].uncertainty);
    }
    EXPECT_NEAR(rms(told), rms(errors), 0.2 * rms(errors));
    EXPECT_LT(1e3 * rms(errors), 0.2);
    EXPECT_GT(1e3 * rms(errors), 0.02);
}

TEST(ImageMarkers, AMarkerHalfInTissueIsNotPulledIntoIt) {
    GreyImage image = grid({32, 32, 32}, {1.5, 1.5, 1.5}, {0, 0, 0});
    const Vector3 c = place_of(image, {15.7, 16.2, 15.4});
    fill(image, 5, 3, [&](const Vector3& x) {
        if ((x - c).norm() < 0.005) return 900.0;
        return x.z() < c.z() ? 300.0 : 0.0;
    });
    const auto found = find_markers(image, {.diameter = 0.01});
    ASSERT_FALSE(found.empty());
    EXPECT_LT(1e3 * (found[0].centre - c).norm(),
              0.15 * 1.5);  // the centroid above a threshold would be off by 0.4 voxels
}

TEST(ImageMarkers, RanksBallsOfTheDiameterBeforeOtherShapes) {
    GreyImage image = grid({60, 40, 40}, {1, 1, 1}, {0, 0, 0});
    const Vector3 ball = place_of(image, {12.3, 20.1, 20.4}), large = place_of(image, {30, 20, 20}),
                  rod = place_of(image, {50, 20, 20});
    fill(image, 3, 4, [&](const Vector3& x) {
        if ((x - ball).norm() < 0.004) return 400.0;
        if ((x - large).norm() < 0.009) return 400.0;
        return (x - rod).head<2>().norm() < 0.003 ? 400.0 : 0.0;
    });
    const auto found = find_markers(image, {.diameter = 0.008});
    ASSERT_FALSE(found.empty());
    EXPECT_LT((found[0].centre - ball).norm(), 0.0001);
    for (std::size_t m = 1; m < found.size(); ++m) {
        EXPECT_LT(found[m].score(), 0.8 * found[0].score());
        for (std::size_t other = 0; other < m; ++other)
            EXPECT_GE((found[m].centre - found[other].centre).norm(), 0.008);
    }
    EXPECT_TRUE(
        find_markers(grid({20, 20, 20}, {1, 1, 1}, {0, 0, 0}), {.diameter = 0.008}).empty());
}

TEST(ImageMarkers, RefusesDiametersThatTheImageCannotShow) {
    const GreyImage image = grid({20, 20, 10}, {1, 1, 3}, {0, 0, 0});
    EXPECT_NE(message_of([&] {
                  find_markers(image, {.diameter = 0.005});
              }).find("at least two voxels of 1 x 1 x 3 mm"),
              std::string::npos);
    EXPECT_NE(message_of([&] {
                  find_markers(image, {.diameter = 0.011});
              }).find("at most half of the image"),
              std::string::npos);
    EXPECT_THROW(find_markers(image, {.diameter = std::nan("")}), Error);
}

}  // namespace
}  // namespace livetet
