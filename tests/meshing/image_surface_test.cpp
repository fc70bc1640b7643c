#ifdef LIVETET_IMAGES

#include "meshing/image_surface.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "base/error.hpp"
#include "meshing/body_mask.hpp"
#include "meshing/images.hpp"
#include "meshing/remesh.hpp"
#include "meshing/shells.hpp"
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

/// Expects a closed, connected surface without self-intersections, every triangle facing outwards
/// from the ball's `centre`.
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
    const LabelImage image = label_image(size, centred_affine(size, {1.5, 1.5, 1.5}),
                                         [](const Vector3& x) { return in_ball(x); });
    expect_ball(surface_of_labels(image, {}));
}

TEST(ImageSurface, looks_outwards_whatever_the_affine) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
    const Eigen::Matrix3d mirrored = turn * Vector3(-1, 1, 1).asDiagonal();
    const Eigen::Matrix3d swapped = (Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, 1).finished();
    const std::array<int, 3> size{84, 70, 34};
    for (const Eigen::Matrix3d& axes : {turn, mirrored, swapped}) {
        const LabelImage image = label_image(size, centred_affine(size, {0.8, 1.0, 2.2}, axes),
                                             [](const Vector3& x) { return in_ball(x); });
        expect_ball(surface_of_labels(image, {}));
    }
}

TEST(ImageSurface, keeps_the_largest_of_two_blobs) {
    const std::array<int, 3> size{100, 48, 48};
    const Vector3 small(0.05, 0, 0), large(-0.03, 0, 0);
    const LabelImage image =
        label_image(size, centred_affine(size, {1.5, 1.5, 1.5}),
                    [&](const Vector3& x) { return in_ball(x, small, 0.015) + in_ball(x, large); });
    const ImageSurface result = surface_of_labels(image, {});
    expect_ball(result, large);
    EXPECT_NEAR(result.label_volume_m3, 1.125 * ball_volume, 0.01 * ball_volume);
}

constexpr double hollow_radius = 0.012;

/// A ball with a hollow that holds a core of another label, which touches nothing.
LabelImage hollow_ball() {
    const std::array<int, 3> size{48, 48, 48};
    return label_image(size, centred_affine(size, {1.5, 1.5, 1.5}), [](const Vector3& x) {
        const Vector3 hollow(0.005, 0, 0);
        return in_ball(x, hollow, 0.006) ? 2 : in_ball(x) - in_ball(x, hollow, hollow_radius);
    });
}

double voxels_m3(const LabelImage& image, std::int32_t label) {
    return std::pow(1.5e-3, 3) *
           static_cast<double>(std::count(image.values.begin(), image.values.end(), label));
}

TEST(ImageSurface, keeps_a_cavity_as_a_shell_of_its_own) {
    const LabelImage image = hollow_ball();
    const ImageSurface result = surface_of_labels(image, {});
    EXPECT_NEAR(result.body_volume_m3, voxels_m3(image, 1), 1e-12);
    EXPECT_NEAR(signed_volume(result.surface), result.body_volume_m3, 0.01 * result.body_volume_m3);
    EXPECT_EQ(result.filled_volume_m3, 0);
    ASSERT_EQ(result.cavities_m3.size(), 1u);
    const std::vector<BodyPiece> pieces = pieces_of(result.surface);
    ASSERT_EQ(count_shells(pieces), (ShellCount{1, 1}));
    EXPECT_NEAR(-signed_volume(pieces[0].cavities[0]), result.cavities_m3[0],
                0.03 * result.cavities_m3[0]);
    EXPECT_EQ(result.left_out.at(2), std::count(image.values.begin(), image.values.end(), 2))
        << "the space of a part that is left out is its neighbour's no more";
}

TEST(ImageSurface, fills_a_cavity_where_it_is_asked_to) {
    const LabelImage image = hollow_ball();
    MeshingOptions options;
    options.body.cavities = Cavities::fill;
    const ImageSurface result = surface_of_labels(image, options);
    expect_ball(result);
    EXPECT_EQ(result.label_voxels.at(2), std::count(image.values.begin(), image.values.end(), 2));
    EXPECT_NEAR(result.filled_volume_m3, result.body_volume_m3 - voxels_m3(image, 1), 1e-12);
    ASSERT_EQ(result.notes.size(), 1u);
    EXPECT_NE(result.notes[0].find("1 cavity filled"), std::string::npos) << result.notes[0];
    options.labels = {1};
    EXPECT_FALSE(surface_of_labels(image, options).label_voxels.contains(2));
}

TEST(ImageSurface, has_all_parts_where_it_is_asked_to) {
    const LabelImage image = hollow_ball();
    MeshingOptions options;
    options.body.parts = Parts::all;
    const ImageSurface result = surface_of_labels(image, options);
    EXPECT_EQ(count_shells(pieces_of(result.surface)), (ShellCount{2, 1}));
    EXPECT_NEAR(result.body_volume_m3, voxels_m3(image, 1) + voxels_m3(image, 2), 1e-12);
}

/// Two voxels in a hundred have the wrong value.
TEST(ImageSurface, drops_specks_and_pores_and_counts_them) {
    const std::array<int, 3> size{48, 48, 48};
    LabelImage image = label_image(size, centred_affine(size, {1.5, 1.5, 1.5}),
                                   [](const Vector3& x) { return in_ball(x); });
    std::mt19937 random(1);
    for (std::int32_t& v : image.values)
        if (random() % 100 < 2) v = 1 - v;
    const ImageSurface result = surface_of_labels(image, {});
    EXPECT_NEAR(signed_volume(result.surface), ball_volume, 0.02 * ball_volume);
    EXPECT_EQ(count_shells(pieces_of(result.surface)), (ShellCount{1, 0}));
    ASSERT_EQ(result.notes.size(), 2u);
    EXPECT_NE(result.notes[0].find("specks of"), std::string::npos) << result.notes[0];
    EXPECT_NE(result.notes[1].find("cavities filled, by"), std::string::npos) << result.notes[1];
    EXPECT_NE(result.notes[1].find("--speck-ml"), std::string::npos) << result.notes[1];
    MeshingOptions options;
    options.body.speck_ml = 0;
    options.body.parts = Parts::all;
    EXPECT_GT(body_mask(image, {}, options.body).parts.size(), 100u);
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
    const LabelImage image =
        label_image(size, centred_affine(size, {1.5, 1.5, 1.5}), [](const Vector3& x) {
            return in_ball(x) * (x.x() < 0 ? 2 : x.y() < 0 ? 3 : 7);
        });
    MeshingOptions options;
    expect_ball(surface_of_labels(image, options));
    options.labels = {2};
    EXPECT_NEAR(surface_of_labels(image, options).surface_volume_m3, ball_volume / 2,
                0.02 * ball_volume);
    options.labels = {2, 3};
    EXPECT_NEAR(surface_of_labels(image, options).surface_volume_m3, 0.75 * ball_volume,
                0.02 * ball_volume);
}

TEST(ImageSurface, names_the_labels_there_when_one_is_missing) {
    const std::array<int, 3> size{8, 8, 8};
    const LabelImage image =
        label_image(size, centred_affine(size, {10, 10, 10}),
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

/// Default spacing and smoothing come from the sizes of the voxels and the body.
TEST(ImageSurface, takes_grid_and_smoothing_from_the_image) {
    const auto of_ball = [](double spacing_mm, double radius_voxels,
                            const MeshingOptions& options = {}) {
        const int n = static_cast<int>(2 * radius_voxels) + 4;
        const std::array<int, 3> size{n, n, n};
        return surface_of_labels(
            label_image(
                size, centred_affine(size, Vector3::Constant(spacing_mm)),
                [&](const Vector3& x) { return 1e3 * x.norm() < radius_voxels * spacing_mm; }),
            options);
    };
    const ImageSurface organ = of_ball(1.5, 40), mouse = of_ball(0.1, 40), coarse = of_ball(3, 20);
    EXPECT_EQ(organ.voxel_mm, 1.5);
    EXPECT_EQ(organ.smoothing_mm, 1.5);
    EXPECT_LT(mouse.voxel_mm, 0.15);
    EXPECT_LT(mouse.smoothing_mm, 0.15);
    EXPECT_EQ(coarse.voxel_mm, 1.5);
    EXPECT_EQ(coarse.smoothing_mm, 1.5);
    MeshingOptions options;
    options.voxel_mm = 0.8;
    options.smoothing_mm = 2.5;
    EXPECT_EQ(of_ball(1, 20, options).voxel_mm, 0.8);
    EXPECT_EQ(of_ball(1, 20, options).smoothing_mm, 2.5);
}

TEST(ImageSurface, smooths_a_plate_of_one_voxel_less_unless_told_otherwise) {
    const std::array<int, 3> size{40, 40, 5};
    const LabelImage plate = label_image(size, centred_affine(size, {1.5, 1.5, 1.5}),
                                         [](const Vector3& x) { return std::abs(x.z()) < 1e-4; });
    const ImageSurface surface = surface_of_labels(plate, {});
    EXPECT_NEAR(surface.surface_volume_m3, surface.body_volume_m3, 0.01 * surface.body_volume_m3);
    MeshingOptions options;
    options.voxel_mm = 5;
    options.smoothing_mm = 30;
    try {
        surface_of_labels(plate, options);
        FAIL() << "smoothed away";
    } catch (const Error& error) {
        for (const char* word : {"--smoothing-mm", "mesh.voxel_mm"})
            EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
}

void expect_refused(const LabelImage& image, const MeshingOptions& options,
                    std::initializer_list<const char*> words) {
    try {
        surface_of_labels(image, options);
        FAIL();
    } catch (const Error& error) {
        for (const char* word : words)
            EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
}

/// Millimetres in a file that states metres; a grid too large for memory; disconnected labels.
TEST(ImageSurface, refuses_what_cannot_have_been_meant) {
    const std::array<int, 3> size{20, 20, 20};
    const auto ball = [&](double spacing_mm) {
        return label_image(size, centred_affine(size, Vector3::Constant(spacing_mm)),
                           [&](const Vector3& x) { return 1e3 * x.norm() < 8 * spacing_mm; });
    };
    expect_refused(ball(1000), {}, {"16000 x 16000 x 16000 mm", "1000 x 1000 x 1000 mm", "unit"});
    MeshingOptions options;
    options.voxel_mm = 1e-3;
    expect_refused(ball(1), options, {"1e+08", "--voxel-mm", "mesh.voxel_mm"});
    expect_refused(
        label_image(size, centred_affine(size, {1, 1, 1}),
                    [](const Vector3& x) {
                        return static_cast<int>((1e3 * x.array() + 100.5).round().sum()) % 2;
                    }),
        {}, {"4000 voxels", "hangs together"});
}

TEST(ImageSurface, counts_the_labels_of_the_body_alone) {
    const std::array<int, 3> size{20, 20, 20};
    LabelImage image = label_image(size, centred_affine(size, {1, 1, 1}), [](const Vector3& x) {
        return 1e3 * x.norm() < 6 ? (x.x() < 0 ? 3 : 5) : 0;
    });
    image.at(0, 0, 0) = 9;
    const auto labels = surface_of_labels(image, {}).label_voxels;
    EXPECT_EQ(labels.size(), 2u);
    EXPECT_EQ(labels.at(3), std::count(image.values.begin(), image.values.end(), 3));
    EXPECT_EQ(labels.at(5), std::count(image.values.begin(), image.values.end(), 5));
}

TEST(ImageSurface, of_a_single_voxel_is_a_surface_of_its_volume_or_an_error) {
    LabelImage image{
        {3, 3, 3}, 1e-3 * Eigen::Matrix4d::Identity(), std::vector<std::int32_t>(27, 0)};
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
