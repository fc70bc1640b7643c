#ifdef LIVETET_IMAGES

#include "meshing/label_volume.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "base/error.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/images.hpp"
#include "meshing/interfaces.hpp"
#include "meshing/levels.hpp"
#include "meshing/shells.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {
namespace {

LabelImage cube(int n, const std::function<int(const Vector3&)>& label_mm) {
    return shapes::label_image({n, n, n}, shapes::centred_affine({n, n, n}, {1, 1, 1}),
                               [&](const Vector3& x) { return label_mm(1e3 * x); });
}

constexpr double big_mm = 16, small_mm = 8;

LabelImage ball_in_ball() {
    return cube(36, [](const Vector3& x) {
        return x.norm() < small_mm ? 2 : x.norm() < big_mm ? 1 : 0;
    });
}

double ball_m3(double radius_mm) {
    return 4 * std::numbers::pi / 3 * std::pow(1e-3 * radius_mm, 3);
}

LabelField field_of(const LabelImage& image) { return LabelField(image, {{}, 1, 1, 0.5}); }

struct Meshed {
    HierarchyResult result;
    ImageSurface image;
};

Meshed mesh(const LabelImage& image, std::int64_t tets, int levels = 2) {
    MeshingOptions options;
    options.target_tets = tets;
    options.levels = levels;
    options.voxel_mm = options.smoothing_mm = 1;
    Meshed meshed;
    meshed.image = surface_of_labels(image, options);
    const Materials materials{
        true, [&] {
            return LabelField(
                image,
                {{}, meshed.image.voxel_mm, meshed.image.smoothing_mm, meshed.image.iso_level});
        }};
    meshed.result = build_hierarchy(meshed.image.surface, options, {}, {}, materials);
    return meshed;
}

/// Expects every level to be conforming (a face belongs to two tets, or to one on the boundary; no
/// duplicate nodes), closed, with dihedral angles of at least five degrees, and with transfers that
/// reproduce linear functions.
void expect_conforming(const HierarchyResult& result, std::set<std::int32_t> labels) {
    ASSERT_GE(result.hierarchy.levels.size(), 2u);
    for (const TetMesh& level : result.hierarchy.levels) {
        check_tet_mesh(level, "level");
        ASSERT_EQ(level.regions.size(), level.tets.size());
        EXPECT_EQ(std::set<std::int32_t>(level.regions.begin(), level.regions.end()), labels);
        EXPECT_GE(measure_quality(level).min_dihedral_deg, 5);
        EXPECT_TRUE(check_topology({level.nodes, boundary_triangles(level.tets)}).closed());
        std::set<std::array<double, 3>> places;
        for (const Vector3& x : level.nodes)
            EXPECT_TRUE(places.insert({x.x(), x.y(), x.z()}).second);
        std::map<Triangle, std::vector<std::int32_t>> faces;
        for (std::size_t t = 0; t < level.tets.size(); ++t)
            for (int c = 0; c < 4; ++c) {
                Triangle f{level.tets[t][(c + 1) % 4], level.tets[t][(c + 2) % 4],
                           level.tets[t][(c + 3) % 4]};
                std::sort(f.begin(), f.end());
                faces[f].push_back(level.regions[t]);
            }
        std::size_t between = 0, found = 0;
        for (const auto& [face, regions] : faces) {
            EXPECT_LE(regions.size(), 2u);
            if (regions.size() == 2 && regions[0] != regions[1]) ++between;
        }
        for (const InterfaceTriangle& f : interface_triangles(level)) found += f.outside != 0;
        EXPECT_EQ(between, found);
        EXPECT_GT(between, 0u);
    }
    const auto& fine = result.hierarchy.levels[0];
    const auto& map = result.hierarchy.transfers[0];
    std::size_t inside = 0;
    for (std::size_t n = 0; n < fine.nodes.size(); ++n) {
        if (map.distance[n] > 0) continue;
        ++inside;
        EXPECT_LT((interpolate(map, n, result.hierarchy.levels[1].nodes) - fine.nodes[n]).norm(),
                  1e-9);
    }
    EXPECT_GT(inside, fine.nodes.size() / 2);
}

/// Expects the finest level's regions to have the volumes of their voxels.
void expect_volumes(const HierarchyResult& result, double relative) {
    const auto volumes = region_volumes(result.hierarchy.levels[0]);
    ASSERT_EQ(result.materials.size(), volumes.size());
    for (const LabelField::Material& m : result.materials)
        EXPECT_NEAR(volumes.at(m.label), m.voxels_m3, relative * m.voxels_m3)
            << "label " << m.label;
}

TEST(Materials, of_a_ball_in_a_ball_are_smooth) {
    const auto [result, image] = mesh(ball_in_ball(), 12000);
    expect_conforming(result, {1, 2});
    expect_volumes(result, 0.01);
    const TetMesh& mesh = result.hierarchy.levels[0];
    EXPECT_NEAR(static_cast<double>(mesh.tets.size()), 12000, 1200);
    const auto volumes = region_volumes(mesh);
    EXPECT_NEAR(volumes.at(2), ball_m3(small_mm), 0.02 * ball_m3(small_mm));
    EXPECT_NEAR(volumes.at(1), ball_m3(big_mm) - ball_m3(small_mm), 0.02 * ball_m3(big_mm));
    // Corners of 1 mm voxels are up to 0.87 mm off; the interface nodes must be on a sphere.
    double sum = 0, most = 0;
    int count = 0;
    for (const InterfaceTriangle& f : interface_triangles(mesh)) {
        if (f.outside == 0) continue;
        for (const std::int32_t n : f.nodes) {
            const double off = std::abs(1e3 * mesh.nodes[n].norm() - small_mm);
            most = std::max(most, off);
            sum += off;
            ++count;
        }
    }
    EXPECT_LT(sum / count, 0.12);
    EXPECT_LT(most, 0.5);
}

TEST(Materials, of_touching_balls_share_their_disc) {
    const Vector3 left(-8, 0, 0), right(8, 0, 0);
    const auto [result, image] =
        mesh(cube(48,
                  [&](const Vector3& x) {
                      return std::min((x - left).norm(), (x - right).norm()) > 11 ? 0
                             : x.x() < 0                                          ? 1
                                                                                  : 2;
                  }),
             12000);
    expect_conforming(result, {1, 2});
    expect_volumes(result, 0.02);
    const TetMesh& mesh = result.hierarchy.levels[0];
    double sum = 0, most = 0;
    int count = 0;
    for (const InterfaceTriangle& f : interface_triangles(mesh)) {
        if (f.outside == 0) continue;
        for (const std::int32_t n : f.nodes) {
            most = std::max(most, std::abs(1e3 * mesh.nodes[n].x()));
            sum += std::abs(1e3 * mesh.nodes[n].x());
            ++count;
        }
    }
    EXPECT_LT(sum / count, 0.15);
    EXPECT_LT(most, 1);  // at the groove
}

TEST(Materials, of_a_checkerboard_meet_at_edges_and_corners) {
    const auto [result, image] = mesh(cube(30,
                                           [](const Vector3& x) {
                                               if (x.cwiseAbs().maxCoeff() > 12) return 0;
                                               const Eigen::Array3i block =
                                                   ((x.array() + 12) / 8).floor().cast<int>();
                                               return 1 + (block.sum() & 1);
                                           }),
                                      15000);
    expect_conforming(result, {1, 2});
    expect_volumes(result, 0.02);
}

TEST(Materials, keep_a_sheet_of_two_voxels_between_others) {
    const auto [result, image] = mesh(cube(30,
                                           [](const Vector3& x) {
                                               if (x.cwiseAbs().maxCoeff() > 12) return 0;
                                               return std::abs(x.z()) < 1 ? 9 : x.z() < 0 ? 4 : 5;
                                           }),
                                      15000);
    expect_conforming(result, {4, 5, 9});
    expect_volumes(result, 0.03);
}

TEST(Materials, too_small_for_the_smoothing_are_noted) {
    const auto [result, image] =
        mesh(cube(30,
                  [](const Vector3& x) {
                      if (x.norm() > 12) return 0;
                      return (x - Vector3(0.5, 0.5, 0.5)).norm() < 0.1 ? 3 : x.x() < 0 ? 1 : 2;
                  }),
             4000, 2);
    expect_conforming(result, {1, 2});
    ASSERT_EQ(result.notes.size(), 1u);
    EXPECT_NE(result.notes[0].find("label 3: its 0.001 ml"), std::string::npos) << result.notes[0];
}

TEST(Materials, that_hang_together_by_a_corner_only_become_one_body) {
    const auto [result, image] = mesh(cube(30,
                                           [](const Vector3& x) {
                                               if (x.cwiseAbs().maxCoeff() > 12) return 0;
                                               const bool post =
                                                   x.head<2>().cwiseAbs().maxCoeff() < 4;
                                               const bool upper = x.z() > 0 && x.x() * x.y() > 0;
                                               return post ? 3 : x.z() < 0 ? 1 : upper ? 2 : 0;
                                           }),
                                      8000, 2);
    expect_conforming(result, {1, 2, 3});
    expect_volumes(result, 0.03);
}

TEST(LabelField, keeps_the_volumes_of_its_labels) {
    const LabelImage image = ball_in_ball();
    MeshingOptions options;
    options.voxel_mm = 1;
    options.smoothing_mm = 3;  // without weights the inner ball would lose much of its volume
    const ImageSurface cut = surface_of_labels(image, options);
    const LabelField field(image, {{}, 1, cut.smoothing_mm, cut.iso_level});
    ASSERT_EQ(field.materials().size(), 2u);
    for (const auto& m : field.materials()) {
        std::int64_t inside = 0;
        constexpr int n = 80;
        for (int i = 0; i < n * n * n; ++i)
            inside += field.label_at(
                          (Vector3(i % n, i / n % n, i / n / n) * 40 / n - Vector3(20, 20, 20)) *
                          1e-3) == m.label;
        const double sampled = static_cast<double>(inside) * std::pow(0.04 / n, 3);
        EXPECT_NEAR(sampled, m.voxels_m3, 0.02 * m.voxels_m3) << m.label;
    }
    EXPECT_EQ(field.label_at(Vector3::Zero()), 2);
    EXPECT_EQ(field.label_at({0.012, 0, 0}), 1);
    EXPECT_EQ(field.label_at({0.019, 0, 0}), 0);
    EXPECT_EQ(field.label_at({1, 0, 0}), 0);
    EXPECT_EQ(field.label_at(Vector3::Constant(std::nan(""))), 0);
}

/// A hollow ball of two halves.
TEST(Materials, of_a_hollow_body_leave_its_cavity_empty) {
    const LabelImage image = cube(36, [](const Vector3& x) {
        return x.norm() > 16 || x.norm() < 9 ? 0 : x.z() < 0 ? 1 : 2;
    });
    const auto [result, cut] = mesh(image, 12000);
    expect_conforming(result, {1, 2});
    expect_volumes(result, 0.03);
    for (const TetMesh& level : result.hierarchy.levels) {
        EXPECT_EQ(count_shells(pieces_of({level.nodes, boundary_triangles(level.tets)})),
                  (ShellCount{1, 1}));
        ASSERT_TRUE(level.node_sets.contains("cavity"));
        const TriangleMesh cavity{level.nodes, level.triangle_sets.at("cavity")};
        // Nothing holds a cavity's own volume; a coarse level cuts its corners.
        const bool is_finest = &level == &result.hierarchy.levels.front();
        EXPECT_NEAR(-signed_volume(cavity) / ball_m3(9), 1, is_finest ? 0.1 : 0.2);
        for (const std::int32_t n : level.node_sets.at("cavity"))
            EXPECT_NEAR(1e3 * level.nodes[n].norm(), 9, 2);
    }
    const auto own = static_cast<double>(cut.label_voxels.at(1));
    EXPECT_NEAR(region_volumes(result.hierarchy.levels[0]).at(1), 1e-9 * own, 0.03e-9 * own);
}

TEST(LabelField, gives_filled_holes_to_the_labels_around) {
    const LabelImage image = cube(30, [](const Vector3& x) {
        if (x.norm() < 3) return 0;
        return x.norm() > 12 ? 0 : x.x() < -6 ? 1 : 2;
    });
    EXPECT_EQ(field_of(image).label_at(Vector3::Zero()), 0);
    const LabelField field(image, {{}, 1, 1, 0.5, {.cavities = Cavities::fill}});
    EXPECT_EQ(field.label_at(Vector3::Zero()), 2);
    EXPECT_EQ(field.label_at({-0.009, 0, 0}), 1);
}

TEST(LabelField, seeds_every_piece) {
    const LabelField field = field_of(cube(30, [](const Vector3& x) {
        if (x.norm() > 13) return 0;
        return std::min((x - Vector3(6, 0, 0)).norm(), (x + Vector3(6, 0, 0)).norm()) < 3 ? 2 : 1;
    }));
    const std::vector<Vector3> places = field.interface_places(5e-3, 30, 1e-12);
    int left = 0, right = 0;
    for (const Vector3& x : places) {
        left += std::abs((1e3 * x + Vector3(6, 0, 0)).norm() - 3) < 0.5;
        right += std::abs((1e3 * x - Vector3(6, 0, 0)).norm() - 3) < 0.5;
        for (const Vector3& y : places) EXPECT_TRUE(&x == &y || (x - y).norm() > 1e-3);
    }
    EXPECT_GE(left, 4);
    EXPECT_GE(right, 4);
}

TEST(FillLabels, gives_the_same_twice) {
    const LabelField field = field_of(ball_in_ball());
    const TetMesh first = fill_labels(field, 3e-3), second = fill_labels(field, 3e-3);
    EXPECT_EQ(first.tets, second.tets);
    EXPECT_EQ(first.regions, second.regions);
    EXPECT_EQ(first.nodes, second.nodes);
}

TEST(FillLabels, that_hangs_or_crashes_is_refused_in_a_line) {
    const LabelField field = field_of(ball_in_ball());
    LabelVolumeOptions options;
    options.time_limit_s = 1e-3;
    for (const bool crash : {false, true}) {
        if (crash)
            options.run = [](const auto&, double) {
                return ChildResult{ChildResult::End::crashed, 11, {}, {}, 0};
            };
        try {
            fill_labels(field, 1e-3, options);
            ADD_FAILURE() << "no tets, and no word of it";
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find(crash ? "signal 11" : "was killed"),
                      std::string::npos)
                << error.what();
        }
    }
    EXPECT_THROW(fill_labels(field, 0), Error);
}

/// A Gmsh that never finishes.
TEST(Hierarchy, of_one_label_is_made_from_it_where_its_surface_cannot_be_filled) {
    const LabelImage image = cube(30, [](const Vector3& x) { return x.norm() < 12 ? 6 : 0; });
    MeshingOptions options;
    options.edge_lengths_mm = {2.5, 5};
    options.voxel_mm = options.smoothing_mm = 1;
    GmshOptions gmsh;
    gmsh.run = [](const auto&, double) {
        return ChildResult{ChildResult::End::failed, 1, {}, "Error   : no", 0};
    };
    const ImageSurface cut = surface_of_labels(image, options);
    EXPECT_THROW(build_hierarchy(cut.surface, options, {}, gmsh), MeshingFailure);
    const HierarchyResult result =
        build_hierarchy(cut.surface, options, {}, gmsh, {false, [&] { return field_of(image); }});
    ASSERT_EQ(result.hierarchy.levels.size(), 2u);
    for (const LevelReport& level : result.levels) {
        EXPECT_GE(level.quality.min_dihedral_deg, 5);
        EXPECT_EQ(level.filled_by, "CGAL from the labels");
    }
    EXPECT_NEAR(result.levels[0].volume_ratio, 1, 0.01);
    const auto said = [&](const char* words) {
        return std::any_of(result.notes.begin(), result.notes.end(),
                           [&](const auto& n) { return n.find(words) != n.npos; });
    };
    EXPECT_TRUE(said("not taken")) << "why its surface was not";
    EXPECT_TRUE(said("not from their surface"));
}

}  // namespace
}  // namespace livetet

#endif
