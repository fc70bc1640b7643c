#include "image/image_warp.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <functional>
#include <numbers>

#include "base/error.hpp"
#include "image/tet_raster.hpp"
#include "mesh/quadratic.hpp"
#include "support/points.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using Eigen::Affine3d;

/// Oblique grid with voxels of 2 x 2.5 x 3 mm, centred at the origin; optionally left-handed.
ImageGrid oblique_grid(std::array<int, 3> size, bool left_handed = false) {
    ImageGrid grid{size, Eigen::Matrix4d::Identity()};
    Eigen::Matrix3d axes =
        Eigen::AngleAxisd(0.4, Vector3(1, 2, 3).normalized()).toRotationMatrix() *
        Vector3(2e-3, 2.5e-3, 3e-3).asDiagonal();
    if (left_handed) axes.col(1) *= -1;
    grid.ras_from_voxel.topLeftCorner<3, 3>() = axes;
    grid.ras_from_voxel.topRightCorner<3, 1>() =
        -axes * (Vector3(size[0], size[1], size[2]) - Vector3::Ones()) / 2;
    return grid;
}

Vector3 place_of(const ImageGrid& grid, int i, int j, int k) {
    return Affine3d(grid.ras_from_voxel) * Vector3(i, j, k);
}

double voxel_volume(const ImageGrid& grid) {
    return std::abs(grid.ras_from_voxel.topLeftCorner<3, 3>().determinant());
}

template <class T>
Image<T> image_of(const ImageGrid& grid, const std::function<T(const Vector3&)>& value) {
    Image<T> image{grid.size, grid.ras_from_voxel, {}};
    for (int k = 0; k < grid.size[2]; ++k)
        for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i)
                image.values.push_back(value(place_of(grid, i, j, k)));
    return image;
}

/// A ball of tets around the origin: a block whose cubes of nodes become spheres.
TetMesh ball(double radius, int cells) {
    TetMesh mesh = test::block({cells, cells, cells}, {2, 2, 2});
    for (Vector3& x : mesh.nodes) {
        x -= Vector3::Ones();
        const double cube = x.cwiseAbs().maxCoeff();
        if (cube > 0) x *= radius * cube / x.norm();
    }
    return mesh;
}

/// The displacement of every node under `move`.
std::vector<Vector3> displaced(const TetMesh& mesh,
                               const std::function<Vector3(const Vector3&)>& move) {
    std::vector<Vector3> u;
    for (const Vector3& x : mesh.nodes) u.push_back(move(x) - x);
    return u;
}

double deformed_volume(const TetMesh& mesh, const std::vector<Vector3>& u) {
    TetMesh deformed = mesh;
    for (std::size_t n = 0; n < u.size(); ++n) deformed.nodes[n] += u[n];
    return volume(deformed);
}

WarpCounts last_warp;

template <class T>
Image<T> warped(const Image<T>& image, const BodyMotion& motion, Interpolation how, T empty = 0) {
    ThreadTeam team(2);
    return warp_image(image, grid_of(image), motion, how, empty, team, last_warp);
}

TEST(ImageWarp, AnAffineMotionMovesALinearImageExactly) {
    // Linear interpolation is exact on a linear image, so any error is the motion's.
    for (const bool left_handed : {false, true}) {
        const ImageGrid grid = oblique_grid({40, 36, 30}, left_handed);
        const auto value = [](const Vector3& x) {
            return static_cast<float>(1e3 * x.dot(Vector3(3, -2, 1)));
        };
        const GreyImage image = image_of<float>(grid, value);
        const TetMesh mesh = ball(0.025, 8);
        Affine3d motion = Affine3d::Identity();
        motion.linear() << 1.1, 0.1, 0, -0.05, 0.9, 0.1, 0.02, 0, 1.05;
        motion.translation() = Vector3(0.003, -0.002, 0.001);
        const auto u = displaced(mesh, [&](const Vector3& x) { return motion * x; });
        const GreyImage out = warped(image, body_motion(mesh, u, 0), Interpolation::linear, -1e6F);
        const Affine3d back = motion.inverse();
        std::size_t inside = 0;
        for (int k = 0; k < grid.size[2]; ++k)
            for (int j = 0; j < grid.size[1]; ++j)
                for (int i = 0; i < grid.size[0]; ++i) {
                    const Vector3 x = place_of(grid, i, j, k);
                    const float found = out.at(i, j, k);
                    // The ball's facets deviate by less than a millimetre.
                    if ((back * x).norm() < 0.024) {
                        EXPECT_NEAR(found, value(back * x), 2e-3) << i << ' ' << j << ' ' << k;
                        ++inside;
                    } else if ((back * x).norm() > 0.025 && x.norm() > 0.025) {
                        EXPECT_EQ(found, image.at(i, j, k));
                    } else if ((back * x).norm() > 0.025 && x.norm() < 0.024) {
                        EXPECT_EQ(found, -1e6F);  // the body has left
                    }
                }
        EXPECT_GT(inside, 3000u);
        EXPECT_EQ(last_warp.inverted, 0u);
        EXPECT_EQ(last_warp.beyond_image, 0u);
    }
}

TEST(ImageWarp, KeysCubicIsExactOnQuadraticImagesAndLinearIsNot) {
    const ImageGrid grid = oblique_grid({40, 36, 30});
    const auto value = [](const Vector3& x) {
        return static_cast<float>(1e5 * x.x() * x.y() + 1e5 * x.z() * x.z());
    };
    const GreyImage image = image_of<float>(grid, value);
    const TetMesh mesh = ball(0.02, 6);
    const Vector3 shift(0.0011, 0.0007, -0.0013);
    const BodyMotion motion =
        body_motion(mesh, displaced(mesh, [&](const Vector3& x) { return x + shift; }), 0);
    const auto worst = [&](Interpolation how) {
        const GreyImage out = warped(image, motion, how);
        double error = 0;
        for (int k = 0; k < grid.size[2]; ++k)
            for (int j = 0; j < grid.size[1]; ++j)
                for (int i = 0; i < grid.size[0]; ++i)
                    if (const Vector3 x = place_of(grid, i, j, k) - shift; x.norm() < 0.018)
                        error = std::max<double>(error, std::abs(out.at(i, j, k) - value(x)));
        return error;
    };
    EXPECT_LT(worst(Interpolation::cubic), 1e-4);
    EXPECT_GT(worst(Interpolation::linear), 0.05);
}

TEST(ImageWarp, WithoutMotionTheImageIsTheSameWhateverTheRind) {
    const ImageGrid grid = oblique_grid({30, 30, 30});
    const LabelImage labels = image_of<std::int32_t>(
        grid, [](const Vector3& x) { return x.norm() < 0.03 ? 1 + (x.x() > 0) : 7; });
    const TetMesh mesh = ball(0.025, 6);
    for (const double rind : {0.0, 0.003}) {
        const BodyMotion motion =
            body_motion(mesh, std::vector<Vector3>(mesh.nodes.size(), Vector3::Zero()), rind);
        EXPECT_EQ(warped(labels, motion, Interpolation::nearest).values, labels.values);
        EXPECT_EQ(last_warp.left_empty, 0u);
    }
}

TEST(ImageWarp, TheLabelsVolumeIsTheDeformedMeshes) {
    const ImageGrid grid = oblique_grid({80, 64, 56});
    const TetMesh mesh = ball(0.04, 10);
    // The body lies within the label, so the voxels that it carries are those of the deformed mesh.
    const LabelImage labels =
        image_of<std::int32_t>(grid, [](const Vector3& x) { return x.norm() < 0.05 ? 1 : 0; });
    const auto u = displaced(mesh, [](const Vector3& x) -> Vector3 {  // bent and compressed
        return {x.x() + 4 * x.z() * x.z(), 0.8 * x.y() + 2 * x.x() * x.z(), 1.1 * x.z() + 0.002};
    });
    warped(labels, body_motion(mesh, u, 0), Interpolation::nearest);
    const double expected = deformed_volume(mesh, u);
    EXPECT_NEAR(static_cast<double>(last_warp.carried) * voxel_volume(grid), expected,
                2e-3 * expected);

    // A label that fills the mesh fills the deformed mesh with its rind; voxels that the body has
    // left are empty.
    const LabelImage exact =
        image_of<std::int32_t>(grid, [](const Vector3& x) { return x.norm() < 0.0397 ? 3 : 0; });
    const LabelImage out = warped(exact, body_motion(mesh, u, 0.004), Interpolation::nearest);
    const auto at_rest = std::count(exact.values.begin(), exact.values.end(), 3);
    const auto deformed = std::count(out.values.begin(), out.values.end(), 3);
    const double ratio = expected / volume(mesh);
    EXPECT_NEAR(static_cast<double>(deformed) / static_cast<double>(at_rest), ratio, 0.01 * ratio);
}

TEST(ImageWarp, ARigidMotionCarriesTheRindAndLeavesNoGhost) {
    // The organ in the image is one voxel larger than its mesh.
    const ImageGrid grid = oblique_grid({60, 56, 44});
    const LabelImage labels =
        image_of<std::int32_t>(grid, [](const Vector3& x) { return x.norm() < 0.0225 ? 1 : 0; });
    const TetMesh mesh = ball(0.02, 8);
    const Affine3d motion =
        Eigen::Translation3d(0.025, 0.006, -0.01) * Eigen::AngleAxisd(0.7, Vector3::UnitY());
    const auto u = displaced(mesh, [&](const Vector3& x) { return motion * x; });
    const LabelImage out = warped(labels, body_motion(mesh, u, 0.004), Interpolation::nearest);
    std::size_t wrong = 0, right = 0;
    for (int k = 0; k < grid.size[2]; ++k)
        for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i) {
                const double r = (motion.inverse() * place_of(grid, i, j, k)).norm();
                if (std::abs(r - 0.0225) < 0.002) continue;  // half a voxel's diagonal
                const bool organ = out.at(i, j, k) == 1;
                (organ == (r < 0.0225) ? right : wrong) += organ || r < 0.0225;
            }
    EXPECT_EQ(wrong, 0u);
    EXPECT_GT(right, 2000u);
    // Without a rind the old border stays in place.
    const LabelImage bare = warped(labels, body_motion(mesh, u, 0), Interpolation::nearest);
    std::size_t ghost = 0;
    for (int k = 0; k < grid.size[2]; ++k)
        for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i) {
                const Vector3 x = place_of(grid, i, j, k);
                ghost += bare.at(i, j, k) == 1 && (motion.inverse() * x).norm() > 0.025;
            }
    EXPECT_GT(ghost, 100u);
}

TEST(ImageWarp, OnAnotherGridTakesTheSameValues) {
    const ImageGrid grid = oblique_grid({40, 36, 30});
    ImageGrid other{{25, 25, 25}, Eigen::Matrix4d::Identity()};
    other.ras_from_voxel.diagonal().head<3>().setConstant(2e-3);
    other.ras_from_voxel.topRightCorner<3, 1>().setConstant(-0.024);
    const auto value = [](const Vector3& x) {
        return static_cast<float>(1e3 * x.dot(Vector3(1, 2, 3)));
    };
    const GreyImage image = image_of<float>(grid, value);
    const TetMesh mesh = ball(0.015, 5);
    const Vector3 shift(0.004, 0, 0.002);
    const BodyMotion motion =
        body_motion(mesh, displaced(mesh, [&](const Vector3& x) { return x + shift; }), 0);
    ThreadTeam team(1);
    const GreyImage out =
        warp_image(image, other, motion, Interpolation::linear, -1e6F, team, last_warp);
    EXPECT_EQ(out.size, other.size);
    for (int n = 0; n < 25; ++n) {
        const Vector3 x = place_of(other, n, 12, 12);
        if ((x - shift).norm() < 0.014) {
            EXPECT_NEAR(out.at(n, 12, 12), value(x - shift), 1e-3);
        } else if (x.norm() > 0.015 && (x - shift).norm() > 0.015) {
            EXPECT_NEAR(out.at(n, 12, 12), value(x), 1e-3);
        }
    }
}

TEST(ImageWarp, WhatComesFromBeyondTheImageIsEmptyAndCounted) {
    ImageGrid grid{{10, 10, 10}, Eigen::Matrix4d::Identity()};
    grid.ras_from_voxel.diagonal().head<3>().setConstant(1e-2);
    const GreyImage image = image_of<float>(grid, [](const Vector3&) { return 5.0F; });
    // Spans the centres of the outermost voxels.
    const TetMesh mesh = test::block({2, 2, 2}, {0.09, 0.09, 0.09});
    const BodyMotion motion = body_motion(
        mesh, displaced(mesh, [](const Vector3& x) { return Vector3(x + Vector3(0.02, 0, 0)); }),
        0);
    const GreyImage out = warped(image, motion, Interpolation::linear, -1.0F);
    EXPECT_EQ(last_warp.beyond_image, 0u);
    EXPECT_EQ(last_warp.left_empty, 200u);  // two layers
    EXPECT_EQ(out.at(1, 5, 5), -1);
    EXPECT_FLOAT_EQ(out.at(2, 5, 5), 5);
    const GreyImage narrow{{5, 10, 10}, grid.ras_from_voxel, std::vector<float>(500, 5.0F)};
    ThreadTeam team(1);
    const GreyImage wide =
        warp_image(narrow, grid, motion, Interpolation::linear, -1.0F, team, last_warp);
    EXPECT_FLOAT_EQ(wide.at(6, 5, 5), 5);
    EXPECT_EQ(wide.at(7, 5, 5), -1);
    EXPECT_EQ(last_warp.beyond_image, 300u);  // i = 7, 8, 9 come from outside
}

/// Two separate tets that overlap after the motion.
struct Overlap {
    TetMesh mesh;
    std::vector<Vector3> u;
    Overlap() {
        mesh.nodes = {{0, 0, 0}, {8e-3, 0, 0}, {0, 8e-3, 0}, {0, 0, 8e-3}};
        for (int n = 0; n < 4; ++n) mesh.nodes.push_back(mesh.nodes[n] + Vector3(20e-3, 0, 0));
        mesh.tets = {{4, 5, 6, 7}, {0, 1, 2, 3}};
        u.assign(8, Vector3::Zero());
        for (int n = 4; n < 8; ++n) u[n] = Vector3(-20e-3, 0, 0);
    }
};

TEST(TetRaster, OfTissueOverTissueWhatMovedLeastCountsWhateverTheOrder) {
    Overlap o;
    ImageGrid grid{{32, 10, 10}, Eigen::Matrix4d::Identity()};
    grid.ras_from_voxel.diagonal().head<3>().setConstant(1e-3);
    const LabelImage labels =
        image_of<std::int32_t>(grid, [](const Vector3& x) { return x.x() < 15e-3 ? 1 : 2; });
    for (int order = 0; order < 2; ++order) {
        const LabelImage out = warped(labels, body_motion(o.mesh, o.u, 0), Interpolation::nearest);
        EXPECT_EQ(out.at(1, 1, 1), 1);
        EXPECT_EQ(out.at(21, 1, 1), 0);
        std::swap(o.mesh.tets[0], o.mesh.tets[1]);
    }
}

TEST(TetRaster, AnInvertedTetCoversOnlyWhatNoUprightOneDoes) {
    Overlap o;
    ImageGrid grid{{32, 10, 10}, Eigen::Matrix4d::Identity()};
    grid.ras_from_voxel.diagonal().head<3>().setConstant(1e-3);
    const LabelImage labels =
        image_of<std::int32_t>(grid, [](const Vector3& x) { return x.x() < 15e-3 ? 1 : 2; });
    // The tet that moves least is inverted in place by swapping two of its nodes.
    o.u[1] = o.mesh.nodes[2] - o.mesh.nodes[1];
    o.u[2] = o.mesh.nodes[1] - o.mesh.nodes[2];
    const LabelImage out = warped(labels, body_motion(o.mesh, o.u, 0), Interpolation::nearest);
    EXPECT_EQ(out.at(1, 1, 1), 2);
    EXPECT_EQ(last_warp.inverted, 0u);
    o.mesh.tets.erase(o.mesh.tets.begin());
    const LabelImage alone = warped(labels, body_motion(o.mesh, o.u, 0), Interpolation::nearest);
    EXPECT_EQ(alone.at(1, 2, 3), 1);
    EXPECT_GT(last_warp.inverted, 0u);
    EXPECT_EQ(last_warp.inverted, last_warp.carried);
}

TEST(TetRaster, TheFirstClassCountsHoweverFarItMoved) {
    const std::vector<Vector3> corners{{0, 0, 0}, {0.01, 0, 0}, {0, 0.01, 0}, {0, 0, 0.01}};
    std::vector<Vector3> nodes = corners,
                         values(4, Vector3(0.5, 0, 0));  // tissue, moved by half a metre
    nodes.insert(nodes.end(), corners.begin(), corners.end());
    values.insert(values.end(), 4, Vector3(0, 1e-3, 0));  // its surroundings, moved by a millimetre
    ImageGrid grid{{4, 4, 4}, Eigen::Matrix4d::Identity()};
    grid.ras_from_voxel.diagonal().head<3>().setConstant(1e-3);
    const std::vector<Tet> tets{{0, 1, 2, 3}, {4, 5, 6, 7}};
    for (const std::size_t first_class : {1, 2}) {
        const TetRaster raster(grid, tets, first_class, nodes, values);
        RasterSlab slab = raster.make_slab();
        raster.draw(0, slab);
        EXPECT_NEAR(slab.values[0].x(), first_class == 1 ? 0.5 : 0, 1e-6)
            << "of one class, what moved least";
    }
}

TEST(TetRaster, EveryVoxelOfABlockIsCoveredOnFacesToo) {
    // Nodes at voxel centres, so that voxels lie exactly on inner faces.
    ImageGrid grid{{13, 13, 13}, Eigen::Matrix4d::Identity()};
    grid.ras_from_voxel.diagonal().head<3>().setConstant(1e-3 / 3);
    const TetMesh mesh = test::block({4, 4, 4}, {4e-3, 4e-3, 4e-3});
    const TetRaster raster(grid, mesh.tets, mesh.tets.size(), mesh.nodes, mesh.nodes);
    RasterSlab slab = raster.make_slab();
    std::size_t covered = 0;
    for (int s = 0; s < raster.slab_count(); ++s) {
        raster.draw(s, slab);
        const std::size_t slice = 13 * 13;
        for (std::size_t n = 0; n < slab.ranks.size(); ++n) {
            if (!(slab.ranks[n] < uncovered)) continue;
            ++covered;
            const int k = slab.first + static_cast<int>(n / slice),
                      in_slice = static_cast<int>(n % slice);
            EXPECT_LT(
                (slab.values[n].cast<double>() - place_of(grid, in_slice % 13, in_slice / 13, k))
                    .norm(),
                1e-8);
        }
    }
    EXPECT_EQ(covered, 13u * 13 * 13);
}

TEST(BodyMotion, OfAQuadraticMeshFollowsItsMiddleNodes) {
    // x' = x + c z^2 e_x: ten-node tets represent it exactly; linear pieces with half an edge h
    // have an error of c h^2 / 8.
    const TetMesh linear = test::block({3, 3, 3}, {0.06, 0.06, 0.06});
    const auto bend = [](const Vector3& x) {
        return Vector3(x + Vector3(2 * x.z() * x.z(), 0, 0));
    };
    ImageGrid grid{{40, 32, 32}, Eigen::Matrix4d::Identity()};
    grid.ras_from_voxel.diagonal().head<3>().setConstant(2e-3);
    const auto worst = [&](const TetMesh& mesh) {
        ThreadTeam team(2);
        const auto field = displacement_field(grid, body_motion(mesh, displaced(mesh, bend), 0),
                                              FieldDirection::inverse, team);
        double error = 0;
        for (int k = 0; k < 30; ++k)
            for (int i = 5; i < 28; ++i) {
                const Vector3 x = place_of(grid, i, 10, k);
                error = std::max(
                    error,
                    (field.at(i, 10, k).cast<double>() - Vector3(-2 * x.z() * x.z(), 0, 0)).norm());
            }
        return error;
    };
    const double P1 = worst(linear), P2 = worst(quadratic_mesh(linear));
    EXPECT_NEAR(P1, 2 * 0.02 * 0.02 / 4, 3e-5);
    EXPECT_NEAR(P2, P1 / 4, 1e-5);
    EXPECT_NEAR(volume(linear), deformed_volume(linear, displaced(linear, bend)), 1e-9);
    double pieces = 0;
    const TetMesh quadratic = quadratic_mesh(linear);
    const BodyMotion motion = body_motion(quadratic, displaced(quadratic, bend), 0);
    EXPECT_EQ(motion.tets.size(), 8 * linear.tets.size());
    const TetMesh parts{motion.rest, {}, {}, {}, {}, {}};
    for (const Tet& t : motion.tets) {
        EXPECT_GT(signed_volume(parts, t), 0);
        pieces += signed_volume(parts, t);
    }
    EXPECT_NEAR(pieces, volume(linear), 1e-12);
}

TEST(BodyMotion, TheRindFillsTheLayerAroundABody) {
    const TetMesh mesh = ball(0.04, 8);
    const BodyMotion motion =
        body_motion(mesh, std::vector<Vector3>(mesh.nodes.size(), Vector3::Zero()), 0.002);
    TetMesh rind{motion.rest, {}, {}, {}, {}, {}};
    double layer = 0;
    for (std::size_t t = motion.own; t < motion.tets.size(); ++t) {
        EXPECT_GT(signed_volume(rind, motion.tets[t]), 0);
        layer += signed_volume(rind, motion.tets[t]);
    }
    const double ratio = std::pow(0.042 / 0.04, 3) - 1;
    EXPECT_NEAR(layer / volume(mesh), ratio, 0.02 * ratio);
    // No gaps and no overlaps: every face is shared by two tets or on the boundary.
    const auto outer = boundary_triangles(motion.tets);
    EXPECT_EQ(outer.size(), boundary_triangles(mesh.tets).size());
}

TEST(DisplacementField, ForwardAfterInverseIsTheIdentity) {
    const ImageGrid grid = oblique_grid({50, 44, 36});
    const TetMesh mesh = ball(0.03, 12);
    const auto u = displaced(mesh, [](const Vector3& x) -> Vector3 {
        return {x.x() + 5 * x.y() * x.y(), 0.9 * x.y(), x.z() + 0.004};
    });
    const BodyMotion motion = body_motion(mesh, u, 0);
    ThreadTeam team(2);
    const auto inverse = displacement_field(grid, motion, FieldDirection::inverse, team);
    const auto forward = displacement_field(grid, motion, FieldDirection::forward, team);
    const Affine3d voxel_from_ras = Affine3d(grid.ras_from_voxel).inverse();
    double worst = 0;
    std::size_t compared = 0;
    for (int k = 0; k < grid.size[2]; ++k)
        for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i) {
                const Vector3 x = place_of(grid, i, j, k),
                              rest = x + inverse.at(i, j, k).cast<double>();
                if (inverse.at(i, j, k).isZero(0) || rest.norm() > 0.02) continue;
                const Vector3 v = (voxel_from_ras * rest).array().floor();
                Vector3 there = Vector3::Zero();
                for (int corner = 0; corner < 8; ++corner) {
                    const Eigen::Vector3i c =
                        v.cast<int>() + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2);
                    const Vector3 w =
                        Vector3::Ones() - (voxel_from_ras * rest - c.cast<double>()).cwiseAbs();
                    there += w.prod() * forward.at(c[0], c[1], c[2]).cast<double>();
                }
                worst = std::max(worst, (rest + there - x).norm());
                ++compared;
            }
    EXPECT_GT(compared, 1500u);
    EXPECT_LT(worst, 1e-4);  // interpolation error for voxels of 2 to 3 mm and a curvature of 5/m
}

TEST(BodyMotion, RefusesDisplacementsThatAreNotOneANode) {
    const TetMesh mesh = ball(0.02, 2);
    EXPECT_NE(test::message_of([&] {
                  body_motion(mesh, std::vector<Vector3>(3), 0);
              }).find("has 3 displacements"),
              std::string::npos);
}

}  // namespace
}  // namespace livetet
