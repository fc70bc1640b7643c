#include "image/image_slice.hpp"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>

#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A block of 60 x 50 x 40 mm in the middle of an image of 80 x 70 x 60 mm with oblique voxels. The
/// values are linear in space, so linear interpolation is exact.
struct Imaged {
    TetMesh mesh = test::block({6, 5, 4}, {0.06, 0.05, 0.04});
    GreyImage image;
    Imaged() {
        const Eigen::AngleAxisd turn(0.3, Vector3(1, 2, 3).normalized());
        image.size = {60, 70, 55};
        image.ras_from_voxel.topLeftCorner<3, 3>() =
            turn.toRotationMatrix() * Vector3(0.002, 0.0018, 0.0022).asDiagonal();
        const Vector3 middle(0.03, 0.025, 0.02);
        image.ras_from_voxel.topRightCorner<3, 1>() =
            middle - image.ras_from_voxel.topLeftCorner<3, 3>() * (0.5 * Vector3(59, 69, 54));
        for (int k = 0; k < image.size[2]; ++k)
            for (int j = 0; j < image.size[1]; ++j)
                for (int i = 0; i < image.size[0]; ++i)
                    image.values.push_back(
                        value((image.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>()));
    }
    static float value(const Vector3& x) {
        return static_cast<float>(100 + 1000 * x.x() - 2000 * x.y() + 3000 * x.z());
    }
    std::vector<Vector3> moved(const Eigen::Affine3d& motion) const {
        std::vector<Vector3> u;
        for (const Vector3& x : mesh.nodes) u.push_back(motion * x - x);
        return u;
    }
};

/// No pixel is on the block's border, where rounding decides.
SlicePlane plane_at(double z) {
    return {{-0.0053, -0.0052, z}, {0.001, 0, 0}, {0, 0.001, 0}, 70, 60};
}

Eigen::Affine3d some_motion() {
    Eigen::Affine3d motion = Eigen::Affine3d::Identity();
    motion.translate(Vector3(0.004, -0.003, 0.002))
        .rotate(Eigen::AngleAxisd(0.1, Vector3(0, 0.6, 0.8)));
    motion.linear() *= Vector3(1.05, 0.9, 1.02).asDiagonal();
    return motion;
}

TEST(ImageSlice, AnAffineMotionShowsTheImageAtTheInversePlace) {
    const Imaged imaged;
    const Eigen::Affine3d motion = some_motion();
    const SlicePlane plane = plane_at(0.0213);
    BodySlice rest, now;
    slice_body(imaged.mesh, imaged.moved(Eigen::Affine3d::Identity()), plane, rest);
    slice_body(imaged.mesh, imaged.moved(motion), plane, now);
    std::vector<float> values(plane.size());
    sample_slice(ImageSampler(imaged.image), plane, rest, now, values);
    int inside = 0, left = 0, outside = 0;
    for (int j = 0; j < plane.height; ++j)
        for (int i = 0; i < plane.width; ++i) {
            const Vector3 x = plane.at(i, j), before = motion.inverse() * x;
            const std::size_t p = i + static_cast<std::size_t>(plane.width) * j;
            const auto in_block = [](const Vector3& y) {
                return (y.array() >= 0).all() && y.x() <= 0.06 && y.y() <= 0.05 && y.z() <= 0.04;
            };
            ASSERT_EQ(now.covers(p), in_block(before)) << i << " " << j;
            if (in_block(before)) {
                EXPECT_NEAR((now.rest[p] - before).norm(), 0, 1e-12);
                EXPECT_NEAR(values[p], Imaged::value(before), 2e-3);
                ++inside;
            } else if (in_block(x)) {
                EXPECT_TRUE(std::isnan(values[p]));
                ++left;
            } else {
                EXPECT_NEAR(values[p], Imaged::value(x), 2e-3);
                ++outside;
            }
        }
    EXPECT_GT(inside, 1000);
    EXPECT_GT(left, 50);
    EXPECT_GT(outside, 500);
}

TEST(ImageSlice, TheAreaCoveredIsTheSectionsAndItsOutlineIsAsLong) {
    const Imaged imaged;
    const Eigen::Affine3d stretched(Vector3(1.5, 0.8, 1).asDiagonal());
    SlicePlane plane{{-0.01, -0.01, 0.0123}, {0.0005, 0, 0}, {0, 0.0005, 0}, 240, 120};
    BodySlice now;
    const std::vector<Vector3> u = imaged.moved(stretched);
    slice_body(imaged.mesh, u, plane, now);
    double covered = 0;
    for (std::size_t p = 0; p < plane.size(); ++p) covered += now.covers(p) * 0.0005 * 0.0005;
    EXPECT_NEAR(covered, 0.09 * 0.04, 0.02 * 0.09 * 0.04);
    std::vector<OutlinePiece> outline;
    slice_outline(imaged.mesh.nodes, u, boundary_triangles(imaged.mesh.tets), plane, outline);
    double length = 0;
    for (const auto& [a, b] : outline) length += 0.0005 * (b - a).norm();
    EXPECT_NEAR(length, 2 * (0.09 + 0.04), 1e-9);
}

TEST(ImageSlice, APlaneThroughNodesAndFacesLeavesNoGap) {
    const Imaged imaged;
    const std::vector<Vector3> u = imaged.moved(Eigen::Affine3d::Identity());
    const SlicePlane plane{{0, 0, 0.02}, {0.001, 0, 0}, {0, 0.001, 0}, 61, 51};
    BodySlice slice;
    slice_body(imaged.mesh, u, plane, slice);
    for (std::size_t p = 0; p < plane.size(); ++p) ASSERT_TRUE(slice.covers(p)) << p;
}

TEST(ImageSlice, AnInvertedTetShowsNothing) {
    TetMesh tet;
    tet.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    tet.tets = {{0, 1, 2, 3}};
    std::vector<Vector3> u(4, Vector3::Zero());
    const SlicePlane plane{{0, 0, 0.25}, {0.1, 0, 0}, {0, 0.1, 0}, 11, 11};
    BodySlice slice;
    const auto covered = [&] {
        slice_body(tet, u, plane, slice);
        return std::count_if(slice.tet.begin(), slice.tet.end(),
                             [](std::int32_t t) { return t >= 0; });
    };
    EXPECT_EQ(covered(), 36);  // i + j <= 7.5
    u[1] = Vector3(-1, 1, 0);  // swaps nodes 1 and 2
    u[2] = Vector3(1, -1, 0);
    EXPECT_EQ(covered(), 0);
}

TEST(ImageSampler, ReachesTheOutermostVoxelsAndNoFarther) {
    const Imaged imaged;
    const ImageSampler sample(imaged.image);
    const auto at = [&](double i, double j, double k) {
        return sample((imaged.image.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>());
    };
    EXPECT_NEAR(at(0, 0, 0), imaged.image.at(0, 0, 0), 1e-3);
    EXPECT_NEAR(at(59, 69, 54), imaged.image.at(59, 69, 54), 1e-3);
    EXPECT_NEAR(at(58.5, 69, 54), 0.5 * (imaged.image.at(58, 69, 54) + imaged.image.at(59, 69, 54)),
                1e-3);
    EXPECT_TRUE(std::isnan(at(-0.01, 5, 5)));
    EXPECT_TRUE(std::isnan(at(5, 69.01, 5)));
    GreyImage flat{{1, 1, 1}, Eigen::Matrix4d::Identity(), {7}};
    EXPECT_EQ(ImageSampler(flat)(Vector3::Zero()), 7);
}

}  // namespace
}  // namespace livetet
