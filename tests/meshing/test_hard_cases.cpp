#ifdef LIVETET_IMAGES

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "base/error.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/images.hpp"
#include "meshing/levels.hpp"
#include "meshing/remesh.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {
namespace {

using shapes::centred_affine;
using shapes::label_image;

/// Options for a small and fast hierarchy.
MeshingOptions small_hierarchy(std::int64_t tets) {
    MeshingOptions options;
    options.target_tets = tets;
    options.levels = 2;
    options.voxel_mm = options.smoothing_mm = 1;
    options.target_tries = 3;
    return options;
}

/// A hierarchy of which every level is closed, manifold, positive and without flat tets, the finest of the volume of
/// the body's voxels.
void expect_valid(const HierarchyResult& result, const ImageSurface& image) {
    ASSERT_GE(result.hierarchy.levels.size(), 1u);
    for (const TetMesh& mesh : result.hierarchy.levels) {
        check_tet_mesh(mesh, "level");
        EXPECT_GE(measure_quality(mesh).min_dihedral_deg, 5);
        const TriangleMesh boundary{mesh.nodes, boundary_triangles(mesh.tets)};
        EXPECT_TRUE(check_topology(boundary).closed());
        EXPECT_EQ(find_self_intersections(largest_part(boundary)).pairs, 0);
    }
    EXPECT_NEAR(volume(result.hierarchy.levels.front()), image.body_volume_m3, 0.01 * image.body_volume_m3);
}

enum class Outcome { meshed, refused };

/// Meshes the image. Either outcome must be whole: a valid hierarchy, or one line that says what is wrong.
Outcome mesh(const LabelImage& image, const MeshingOptions& options) {
    try {
        const ImageSurface cut = surface_of_labels(image, options);
        expect_valid(build_hierarchy(cut.surface, options), cut);
        return Outcome::meshed;
    } catch (const Error& error) {
        const std::string text = error.what();
        EXPECT_EQ(text.find('\n'), std::string::npos) << text;
        EXPECT_TRUE(text.find("mm") != std::string::npos || text.find("ml") != std::string::npos) << text;
        std::printf("refused: %s\n", text.c_str());
        return Outcome::refused;
    }
}

double norm_mm(const Vector3& x, const Vector3& centre_mm = Vector3::Zero()) { return (1e3 * x - centre_mm).norm(); }

LabelImage cube_of_voxels(int n, const Vector3& spacing_mm, const std::function<int(const Vector3&)>& label) {
    const std::array<int, 3> size{n, n, n};
    return label_image(size, centred_affine(size, spacing_mm), label);
}

TEST(HardCase, hemispherical_shell_two_voxels_thick) {
    const LabelImage image = cube_of_voxels(
        36, {1, 1, 1}, [](const Vector3& x) { return norm_mm(x) < 15 && norm_mm(x) > 13 && x.z() < 0 ? 1 : 0; });
    MeshingOptions options = small_hierarchy(12000);
    options.voxel_mm = options.smoothing_mm = 0.5;
    EXPECT_EQ(mesh(image, options), Outcome::meshed);
}

TEST(HardCase, plate_one_voxel_thick) {
    const LabelImage image = cube_of_voxels(
        28, {1, 1, 1}, [](const Vector3& x) { return std::abs(x.z() - 0.5e-3) < 0.5e-3 && norm_mm(x) < 12 ? 1 : 0; });
    MeshingOptions options = small_hierarchy(12000);
    options.voxel_mm = options.smoothing_mm = 0.3;
    EXPECT_EQ(mesh(image, options), Outcome::meshed);
}

TEST(HardCase, closed_shell_is_filled) {
    const LabelImage image =
        cube_of_voxels(36, {1, 1, 1}, [](const Vector3& x) { return norm_mm(x) < 15 && norm_mm(x) > 13 ? 1 : 0; });
    EXPECT_EQ(mesh(image, small_hierarchy(4000)), Outcome::meshed);
}

TEST(HardCase, touching_spheres) {
    const LabelImage image = cube_of_voxels(60, {1, 1, 1}, [](const Vector3& x) {
        return norm_mm(x, {-12, 0, 0}) < 12.3 || norm_mm(x, {12, 0, 0}) < 12.3 ? 1 : 0;
    });
    EXPECT_EQ(mesh(image, small_hierarchy(6000)), Outcome::meshed);
}

/// Two cubes that share one voxel's edge, or one corner: by faces they are two bodies.
TEST(HardCase, cubes_that_touch_at_an_edge_or_a_corner) {
    for (const int corner : {0, 1}) {
        const LabelImage image = cube_of_voxels(32, {1, 1, 1}, [&](const Vector3& x) {
            const Vector3 p = 1e3 * x;
            const bool first = p.minCoeff() > 0 && p.maxCoeff() < 12;
            const Vector3 q(-p.x(), -p.y(), corner ? -p.z() : p.z());
            return first || (q.minCoeff() > 0 && q.maxCoeff() < 11) ? 1 : 0;
        });
        EXPECT_EQ(mesh(image, small_hierarchy(3000)), Outcome::meshed);
    }
}

/// The two voxels' edge closes a ring, so that one body by faces touches itself there.
TEST(HardCase, ring_that_touches_itself_at_an_edge) {
    const LabelImage image = cube_of_voxels(40, {1, 1, 1}, [](const Vector3& x) {
        const Vector3 p = 1e3 * x;
        if (std::abs(p.z()) > 5) return 0;
        const bool one = p.x() > 0 && p.y() > 0 && p.x() < 12 && p.y() < 12;
        const bool two = p.x() < 0 && p.y() < 0 && p.x() > -12 && p.y() > -12;
        const bool way = (p.x() >= 12 && p.x() < 17 && p.y() > -17 && p.y() < 12) ||
                         (p.y() <= -12 && p.y() > -17 && p.x() > -12 && p.x() < 17);
        return one || two || way ? 1 : 0;
    });
    EXPECT_EQ(mesh(image, small_hierarchy(6000)), Outcome::meshed);
}

TEST(HardCase, checkerboard_is_refused) {
    const LabelImage image = cube_of_voxels(12, {1, 1, 1}, [](const Vector3& x) {
        const Eigen::Array3d p = (1e3 * x.array() + 100.5).round();
        return static_cast<int>(p.sum()) % 2;
    });
    EXPECT_EQ(mesh(image, small_hierarchy(1000)), Outcome::refused);
}

/// A checkerboard of which the empty voxels are tunnels: half of a lattice of bars.
TEST(HardCase, lattice_of_bars) {
    const LabelImage image = cube_of_voxels(36, {1, 1, 1}, [](const Vector3& x) {
        const Eigen::Array3i p = (1e3 * x.array() + 18).floor().cast<int>();
        const auto bar = [&](int d) { return p[d] % 12 < 4; };
        return p.minCoeff() >= 0 && p.maxCoeff() < 28 && bar(0) + bar(1) + bar(2) >= 2 ? 1 : 0;
    });
    EXPECT_EQ(mesh(image, small_hierarchy(20000)), Outcome::meshed);
}

TEST(HardCase, one_voxel_organ) {
    const auto organ = [](double spacing_mm) {
        return cube_of_voxels(3, Vector3::Constant(spacing_mm),
                              [](const Vector3& x) { return x.norm() < 1e-9 ? 1 : 0; });
    };
    EXPECT_EQ(mesh(organ(2), small_hierarchy(1000)), Outcome::meshed);
    EXPECT_EQ(mesh(organ(0.5), small_hierarchy(1000)), Outcome::refused);
}

TEST(HardCase, noise_about_a_body) {
    std::mt19937 random(7);
    const LabelImage image = cube_of_voxels(48, {1, 1, 1}, [&](const Vector3& x) {
        const bool inside = norm_mm(x) < 16;
        return (random() % 100 < 10) != inside ? 1 : 0;
    });
    EXPECT_EQ(mesh(image, small_hierarchy(10000)), Outcome::meshed);
}

TEST(HardCase, trefoil_knot) {
    const LabelImage image = cube_of_voxels(64, {1, 1, 1}, [](const Vector3& x) {
        double nearest = 1e9;
        for (int i = 0; i < 200; ++i) {
            const double t = 2 * std::numbers::pi * i / 200;
            const double r = 15 + 7 * std::cos(3 * t);
            nearest = std::min(nearest, norm_mm(x, {r * std::cos(2 * t), r * std::sin(2 * t), 9 * std::sin(3 * t)}));
        }
        return nearest < 4 ? 1 : 0;
    });
    EXPECT_EQ(mesh(image, small_hierarchy(8000)), Outcome::meshed);
}

TEST(HardCase, body_with_a_tunnel) {
    const LabelImage image = cube_of_voxels(
        44, {1, 1, 1}, [](const Vector3& x) { return norm_mm(x) < 18 && std::hypot(x.x(), x.y()) > 3e-3 ? 1 : 0; });
    MeshingOptions options = small_hierarchy(8000);
    EXPECT_EQ(mesh(image, options), Outcome::meshed);
}

TEST(HardCase, thick_slices) {
    const std::array<int, 3> size{84, 64, 12};
    const LabelImage image = label_image(size, centred_affine(size, {0.6, 0.6, 5}), [](const Vector3& x) {
        const Vector3 p = 1e3 * x;
        return p.cwiseQuotient(Vector3(22, 16, 25)).norm() < 1 ? 1 : 0;
    });
    EXPECT_EQ(mesh(image, small_hierarchy(6000)), Outcome::meshed);
}

TEST(HardCase, label_at_the_border_of_the_image) {
    const LabelImage image = cube_of_voxels(20, {1, 1, 1}, [](const Vector3& x) {
        return norm_mm(x, {10, 10, 10}) < 16 ? 1 : 0;
    });
    EXPECT_EQ(mesh(image, small_hierarchy(4000)), Outcome::meshed);
}

TEST(HardCase, whole_image_is_one_label) {
    EXPECT_EQ(mesh(cube_of_voxels(16, {1, 1, 1}, [](const Vector3&) { return 3; }), small_hierarchy(4000)),
              Outcome::meshed);
}

}  // namespace
}  // namespace livetet

#endif
