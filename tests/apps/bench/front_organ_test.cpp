#ifdef LIVETET_IMAGES
#include "apps/bench/front_organ.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/error.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "meshing/image_surface.hpp"
#include "support/program.hpp"

namespace livetet {
namespace {

const Vector3 half_axes(0.06, 0.045, 0.05);  // m

/// A label map with an ellipsoid of label 3 about the origin, beside a block of label 1.
LabelImage ellipsoid_labels() {
    constexpr double spacing = 0.003;
    LabelImage labels{{50, 40, 40}, Eigen::Matrix4d::Identity(), {}};
    labels.ras_from_voxel.topLeftCorner<3, 3>() *= spacing;
    labels.ras_from_voxel.topRightCorner<3, 1>() = Vector3(-0.072, -0.06, -0.06);
    for (int k = 0; k < 40; ++k)
        for (int j = 0; j < 40; ++j)
            for (int i = 0; i < 50; ++i) {
                const Vector3 x = (labels.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>();
                const bool is_in = x.cwiseQuotient(half_axes).norm() < 1;
                labels.values.push_back(is_in ? 3 : i > 46);
            }
    return labels;
}

void expect_ellipsoid(const FrontOrgan& organ) {
    const Vector3& sensor = organ.tracker.image_from_sensor_at_rest.translation;
    EXPECT_LT((sensor - Vector3(0, half_axes.y(), 0)).norm(), 0.006) << sensor.transpose();
    EXPECT_LT(organ.tracker.press_direction.normalized().y(), -0.97);
    EXPECT_EQ(organ.tracker.position_rms_mm, 0);
    EXPECT_EQ(organ.targets.size(), 30U);
    for (const NamedPoint& target : organ.targets) {
        EXPECT_LT((target.position - sensor).norm(), 0.045) << target.name;
        EXPECT_LT(target.position.cwiseQuotient(half_axes).norm(), 0.9) << target.name;
    }
    const LabelImage &labels = organ.images.labels, &fixed = organ.images.fixed_mask;
    double volume = 0;
    const double voxel = grid_of(labels).spacing().prod();
    for (int k = 0; k < labels.size[2]; ++k)
        for (int j = 0; j < labels.size[1]; ++j)
            for (int i = 0; i < labels.size[0]; ++i) {
                volume += labels.at(i, j, k) * voxel;
                const double y = (labels.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).y();
                if (std::abs(y + 0.6 * half_axes.y()) > 0.002) {
                    ASSERT_EQ(fixed.at(i, j, k), y < -0.6 * half_axes.y()) << y;
                }
            }
    const double expected = 4.0 / 3 * std::numbers::pi * half_axes.prod();
    EXPECT_NEAR(volume, expected, 0.03 * expected);
}

TEST(FrontOrgan, IsPressedAtTheFrontAndHeldAtTheBackOfALabelMapOrASurface) {
    const test::Folder folder;
    const LabelImage labels = ellipsoid_labels();
    write_image(folder.path() / "labels.nii.gz", labels);
    MeshingOptions options;
    options.labels = {3};
    write_surface(folder.path() / "organ.stl", surface_of_labels(labels, options).surface,
                  Space::ras);
    for (const char* file : {"labels.nii.gz", "organ.stl"}) {
        SCOPED_TRACE(file);
        expect_ellipsoid(read_front_organ(folder.path() / file, 3, {}));
    }
    EXPECT_THROW((void)read_front_organ(folder.path() / "labels.nii.gz", 7, {}), Error);
}

}  // namespace
}  // namespace livetet
#endif
