#ifdef LIVETET_IMAGES

#include "meshing/image_surface.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "base/error.hpp"
#include "meshing/images.hpp"
#include "meshing/remesh.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {
namespace {

using shapes::centred_affine;
using shapes::label_image;

constexpr double radius = 0.03;
constexpr double ball_volume = 4.0 / 3 * std::numbers::pi * radius * radius * radius;

int in_ball(const Vector3& x, const Vector3& centre = Vector3::Zero(), double r = radius) {
    return (x - centre).norm() < r ? 1 : 0;
}

/// Closed, free of cuts, one part, and every triangle of a ball about `centre` looks outwards.
void expect_ball(const ImageSurface& result, const Vector3& centre = Vector3::Zero()) {
    const TriangleMesh& s = result.surface;
    EXPECT_TRUE(check_topology(s).closed());
    EXPECT_EQ(find_self_intersections(s).pairs, 0);
    EXPECT_NEAR(signed_volume(s), ball_volume, 0.01 * ball_volume);
    EXPECT_NEAR(result.surface_volume_m3, result.body_volume_m3, 0.002 * result.body_volume_m3);
    for (const auto& [a, b, c] : s.triangles) {
        const Vector3 normal = (s.nodes[b] - s.nodes[a]).cross(s.nodes[c] - s.nodes[a]);
        const Vector3 out = (s.nodes[a] + s.nodes[b] + s.nodes[c]) / 3 - centre;
        ASSERT_GE(normal.dot(out), 0);
        ASSERT_NEAR(out.norm(), radius, 1.5e-3);
    }
}

TEST(ImageSurface, of_a_ball_keeps_its_volume) {
    const std::array<int, 3> size{48, 48, 48};
    const LabelImage image =
        label_image(size, centred_affine(size, {1.5, 1.5, 1.5}), [](const Vector3& x) { return in_ball(x); });
    expect_ball(surface_of_labels(image, {}));
}

TEST(ImageSurface, looks_outwards_whatever_the_affine) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
    const Eigen::Matrix3d mirrored = turn * Vector3(-1, 1, 1).asDiagonal();
    const Eigen::Matrix3d swapped = (Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, 1).finished();
    const std::array<int, 3> size{84, 70, 34};
    for (const Eigen::Matrix3d& axes : {turn, mirrored, swapped}) {
        const LabelImage image =
            label_image(size, centred_affine(size, {0.8, 1.0, 2.2}, axes), [](const Vector3& x) { return in_ball(x); });
        expect_ball(surface_of_labels(image, {}));
    }
}

TEST(ImageSurface, keeps_the_largest_of_two_blobs) {
    const std::array<int, 3> size{100, 48, 48};
    const Vector3 small(0.05, 0, 0), large(-0.03, 0, 0);
    const LabelImage image = label_image(size, centred_affine(size, {1.5, 1.5, 1.5}), [&](const Vector3& x) {
        return in_ball(x, small, 0.015) + in_ball(x, large);
    });
    const ImageSurface result = surface_of_labels(image, {});
    expect_ball(result, large);
    EXPECT_NEAR(result.label_volume_m3, 1.125 * ball_volume, 0.01 * ball_volume);
}

TEST(ImageSurface, fills_holes) {
    const std::array<int, 3> size{48, 48, 48};
    const LabelImage image = label_image(size, centred_affine(size, {1.5, 1.5, 1.5}), [](const Vector3& x) {
        return in_ball(x) - in_ball(x, {0.005, 0, 0}, 0.012);
    });
    const ImageSurface result = surface_of_labels(image, {});
    expect_ball(result);
    EXPECT_LT(result.label_volume_m3, 0.95 * ball_volume);
}

TEST(ImageSurface, closes_a_body_that_the_border_cuts) {
    const std::array<int, 3> size{48, 48, 24};
    Eigen::Matrix4d affine = centred_affine(size, {1.5, 1.5, 1.5});
    affine(2, 3) = 0.75e-3;  // the first slice starts at z = 0: half of the ball
    const LabelImage image = label_image(size, affine, [](const Vector3& x) { return in_ball(x); });
    const ImageSurface result = surface_of_labels(image, {});
    EXPECT_TRUE(check_topology(result.surface).closed());
    EXPECT_NEAR(signed_volume(result.surface), 0.5 * ball_volume, 0.01 * ball_volume);
}

TEST(ImageSurface, joins_the_labels_asked_for) {
    const std::array<int, 3> size{48, 48, 48};
    const LabelImage image = label_image(size, centred_affine(size, {1.5, 1.5, 1.5}), [](const Vector3& x) {
        return in_ball(x) * (x.x() < 0 ? 2 : x.y() < 0 ? 3 : 7);
    });
    MeshingOptions options;
    expect_ball(surface_of_labels(image, options));
    options.labels = {2};
    EXPECT_NEAR(surface_of_labels(image, options).surface_volume_m3, ball_volume / 2, 0.02 * ball_volume);
    options.labels = {2, 3};
    EXPECT_NEAR(surface_of_labels(image, options).surface_volume_m3, 0.75 * ball_volume, 0.02 * ball_volume);
}

TEST(ImageSurface, names_the_labels_there_when_one_is_missing) {
    const std::array<int, 3> size{8, 8, 8};
    const LabelImage image = label_image(size, centred_affine(size, {10, 10, 10}),
                                         [](const Vector3& x) { return in_ball(x) * (x.x() < 0 ? 4 : 11); });
    MeshingOptions options;
    options.labels = {4, 5};
    try {
        surface_of_labels(image, options);
        FAIL() << "label 5 is not there";
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("label 5"), std::string::npos) << error.what();
        EXPECT_NE(std::string(error.what()).find("4, 11"), std::string::npos) << error.what();
    }
}

TEST(ImageSurface, refuses_images_without_a_body_or_with_a_singular_affine) {
    LabelImage image{{4, 4, 4}, Eigen::Matrix4d::Identity(), std::vector<std::int32_t>(64, 0)};
    EXPECT_THROW(surface_of_labels(image, {}), Error);
    image.values[21] = 1;
    image.ras_from_voxel.col(1) = image.ras_from_voxel.col(0);
    EXPECT_THROW(surface_of_labels(image, {}), Error);
    image.values.pop_back();
    EXPECT_THROW(surface_of_labels(image, {}), Error);
}

TEST(ImageSurface, of_a_single_voxel_is_a_surface_of_its_volume_or_an_error) {
    LabelImage image{{3, 3, 3}, 1e-3 * Eigen::Matrix4d::Identity(), std::vector<std::int32_t>(27, 0)};
    image.ras_from_voxel(3, 3) = 1;
    image.values[13] = 1;
    try {
        const ImageSurface result = surface_of_labels(image, {});
        EXPECT_NEAR(result.surface_volume_m3, 1e-9, 1e-11);
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("too small"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace livetet

#endif
