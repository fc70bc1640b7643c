// The shipped program on cut grids: from the scene's cuts to results, warped images and studies.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/result_file.hpp"
#include "io/surface_file.hpp"
#include "mesh/hex_grid.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/shapes.hpp"
#include "support/hex_grids.hpp"
#include "support/mpirun.hpp"
#include "support/program.hpp"
#include "support/shaken.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::text_of;
using test::write_text;

/// A bar of 80 x 16 x 16 mm from (2, 2, 2) mm on, in voxels of 1 mm, as "bar.nii.gz"; its grid of
/// 20 x 4 x 4 cells as "bar.h5"; and "grey.nii.gz" whose values are 100.5 more than the voxel's
/// number along x.
struct CutBar {
    Folder folder;

    CutBar() {
        LabelImage labels{{100, 20, 20}, Eigen::Matrix4d::Identity(), {}};
        labels.ras_from_voxel.topLeftCorner<3, 3>() *= 1e-3;
        labels.ras_from_voxel.col(3) << 0.5e-3, 0.5e-3, 0.5e-3, 1;
        GreyImage grey{labels.size, labels.ras_from_voxel, {}};
        for (int k = 0; k < 20; ++k)
            for (int j = 0; j < 20; ++j)
                for (int i = 0; i < 100; ++i) {
                    const bool inside = i >= 2 && i < 82 && j >= 2 && j < 18 && k >= 2 && k < 18;
                    labels.values.push_back(inside);
                    grey.values.push_back(inside ? 100.5F + static_cast<float>(i) : 10.F);
                }
        write_image(folder / "bar.nii.gz", labels);
        write_image(folder / "grey.nii.gz", grey);
        const auto run = livetet(folder, "mesh bar.nii.gz --cells hexahedra --tets 400 -o bar.h5");
        EXPECT_EQ(run.status, 0) << run.err;
    }

    /// Held at x = 2 mm, pulled at x = 82 mm.
    test::Outcome solve(const std::string& more, double pull_mm = 8,
                        const std::string& options = "") const {
        write_text(folder / "scene.yaml", scene(more, pull_mm));
        return livetet(folder, "solve scene.yaml --json out.json" + options);
    }
    static std::string scene(const std::string& more, double pull_mm = 8) {
        return fmt::format(R"(
mesh: {{file: bar.h5}}
image: grey.nii.gz
materials: [{{young_Pa: 5000, poisson: 0.3, model: corotated}}]
fix: [{{half_space_mm: [2.1, 0, 0, 1, 0, 0]}}]
drive: [{{half_space_mm: [81.9, 0, 0, -1, 0, 0], displacement_mm: [{}, 0, 0]}}]
solver: {{newton_tolerance: 1e-9, relative_tolerance: 1e-8}}
output: {{file: out.h5}}
{})",
                           pull_mm, more);
    }
};

/// Cut in two, either part goes with what holds it, and so does the image: between them is a gap of
/// 8 mm that has no content, and no voxel of either part is lost.
TEST(Cuts, APartedBarAndItsImageGoToBothSides) {
    const CutBar bar;
    const auto run = bar.solve("cuts: [{point_mm: [42, 0, 0], normal: [1, 0, 0]}]\n");
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_NE(run.err.find("25 nodes doubled; the body is in 2 pieces"), std::string::npos)
        << run.err;
    const ResultReader result(bar.folder / "out.h5");
    const TetMesh& mesh = result.mesh();
    const auto u = result.displacement(0);
    EXPECT_EQ(mesh.nodes.size(), 21U * 25 + 25);
    ASSERT_EQ(mesh.hexahedra.size(), 320U);
    for (const Hexahedron& cell : mesh.hexahedra)
        for (const std::int32_t n : cell) {
            const double moved = mesh.nodes[cell[0]].x() < 0.0419 ? 0 : 0.008;
            ASSERT_NEAR(u[n].x(), moved, 1e-9);
        }
    const auto warp = livetet(bar.folder, "warp out.h5 -o warped.nii.gz --empty -1");
    ASSERT_EQ(warp.status, 0) << warp.err;
    EXPECT_NE(warp.out.find("cuts         1 cut; the body is in 2 pieces: 10.24 ml, 10.24 ml\n"),
              std::string::npos)
        << warp.out;
    const GreyImage warped = grey_image(read_volume(bar.folder / "warped.nii.gz"), "warped");
    for (int i = 2; i < 90; ++i)
        for (const int j : {2, 9, 17}) {
            const double expected = i < 42 ? 100.5 + i : i < 50 ? -1 : 100.5 + i - 8;
            EXPECT_NEAR(warped.at(i, j, 9), expected, 0.01) << i << ", " << j;
        }
}

/// A slit inside opens: the gap in the image is as wide as the lips part, and the tissue above and
/// below it is whole.
TEST(Cuts, ASlitOpensInTheWarpedImage) {
    const CutBar bar;
    ASSERT_EQ(bar.solve("cuts: [{point_mm: [42, 10, 10], edges_mm: [0, 40, 0, 0, 0, 9]}]\n").status,
              0);
    const ResultReader result(bar.folder / "out.h5");
    const TetMesh& mesh = result.mesh();
    const auto u = result.displacement(0);
    // Of the lips' nodes at the middle of y, by z.
    std::map<int, std::pair<double, double>> lips;
    for (const Hexahedron& cell : mesh.hexahedra)
        for (const std::int32_t n : cell) {
            const Vector3 x = 1e3 * mesh.nodes[n];
            if (std::abs(x.x() - 42) > 0.1 || std::abs(x.y() - 10) > 0.1) continue;
            auto& [left, right] = lips[static_cast<int>(std::lround(x.z()))];
            (mesh.nodes[cell[0]].x() < 0.0419 ? left : right) = 1e3 * u[n].x();
        }
    const double gap = lips.at(10).second - lips.at(10).first;
    EXPECT_GT(gap, 0.5);
    for (const int z : {2, 6, 14, 18}) EXPECT_EQ(lips.at(z).first, lips.at(z).second) << z;
    ASSERT_EQ(livetet(bar.folder, "warp out.h5 -o warped.nii.gz --empty -1").status, 0);
    const GreyImage warped = grey_image(read_volume(bar.folder / "warped.nii.gz"), "warped");
    const auto empty_along = [&](int k) {
        int count = 0;
        for (int i = 20; i < 70; ++i) count += warped.at(i, 9, k) == -1;
        return count;
    };
    // At z = 9.5 mm, an eighth of the way from the widest place to the slit's end.
    EXPECT_NEAR(empty_along(9), 0.875 * gap, 1);
    EXPECT_GT(empty_along(9), 0);
    for (const int k : {4, 15}) EXPECT_EQ(empty_along(k), 0) << k;
}

/// A file of triangles cuts as the plane that it lies in.
TEST(Cuts, ASurfaceFileCutsAsItsPlane) {
    const CutBar bar;
    TriangleMesh plane;
    for (const double y : {-30.0, 50.0})
        for (const double z : {-30.0, 50.0})
            plane.nodes.emplace_back(0.043 + y / 2e4, y / 1e3, z / 1e3);
    plane.triangles = {{0, 1, 3}, {0, 3, 2}};
    write_surface(bar.folder / "ras.stl", plane, Space::ras);
    write_surface(bar.folder / "lps.vtk", plane, Space::lps);
    const auto cells = [&](const std::string& cut) {
        const auto run = bar.solve(cut);
        EXPECT_EQ(run.status, 0) << run.err;
        return ResultReader(bar.folder / "out.h5").mesh().hexahedra;
    };
    const auto expected = cells("cuts: [{point_mm: [43, 0, 0], normal: [1, -0.05, 0]}]\n");
    EXPECT_EQ(cells("cuts: [{file: ras.stl}]\n"), expected);
    EXPECT_EQ(cells("cuts: [{file: lps.vtk, space: lps}]\n"), expected);
    EXPECT_NE(cells("cuts: [{point_mm: [51, 0, 0], normal: [1, 0, 0]}]\n"), expected);
}

constexpr const char* end_cut = "cuts: [{point_mm: [42, 0, 0], normal: [1, 0, 0]}]\n";

/// A bar that is held at one end and not pulled: what becomes of the other end.
std::string held_alone(const std::string& more) {
    return fmt::format(R"(
mesh: {{file: bar.h5}}
materials: [{{young_Pa: 5000, poisson: 0.3, density_kg_per_m3: 1000}}]
fix: [{{half_space_mm: [2.1, 0, 0, 1, 0, 0]}}]
gravity_m_per_s2: [0, 0, -1]
output: {{file: out.h5}}
{}{})",
                       end_cut, more);
}

/// A tumour with a material of its own that is cut off with its piece.
TEST(Cuts, AMaterialMayGoWithAPieceThatIsLeftOut) {
    const CutBar bar;
    MeshHierarchy grid = read_hierarchy(bar.folder / "bar.h5");
    TetMesh& mesh = grid.levels.front();
    mesh.regions.clear();
    for (const Tet& tet : mesh.tets) mesh.regions.push_back(mesh.nodes[tet[0]].x() > 0.06 ? 2 : 1);
    write_hierarchy(bar.folder / "bar.h5", grid);
    const auto scene = [](int region, const std::string& more) {
        const std::string own = fmt::format(
            "density_kg_per_m3: 1000, region: 1}}, {{young_Pa: 9000, poisson: 0.3, region: {}}}]",
            region);
        std::string text = held_alone(more);
        return text.replace(text.find("density_kg_per_m3: 1000}]"), 25, own);
    };
    write_text(bar.folder / "scene.yaml", scene(2, "free_pieces: leave_out\n"));
    const auto run = livetet(bar.folder, "solve scene.yaml");
    EXPECT_EQ(run.status, 0) << run.err;
    EXPECT_NE(run.err.find("materials[1].region = 2: the mesh has no cell of that region any more"),
              std::string::npos)
        << run.err;
    write_text(bar.folder / "scene.yaml", scene(3, "free_pieces: keep\n"));
    const auto refused = livetet(bar.folder, "solve scene.yaml");
    EXPECT_EQ(refused.status, 2);
    EXPECT_NE(refused.err.find("materials[1].region = 3: the mesh has no cell of that region\n"),
              std::string::npos)
        << refused.err;
}

TEST(Cuts, AFreePieceIsRefusedLeftOutOrKeptAtRest) {
    const CutBar bar;
    write_text(bar.folder / "scene.yaml", held_alone(""));
    expect_refused(livetet(bar.folder, "solve scene.yaml"),
                   {"cuts: free 1 piece", "10.24 ml at (62.0, 10.0, 10.0) mm",
                    "free_pieces: leave_out or keep"});
    EXPECT_FALSE(std::filesystem::exists(bar.folder / "out.h5"));

    write_text(bar.folder / "scene.yaml", held_alone("free_pieces: leave_out\n"));
    auto run = livetet(bar.folder, "solve scene.yaml --json out.json");
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_NE(run.err.find("10.24 ml"), std::string::npos) << run.err;
    EXPECT_EQ(nlohmann::json::parse(text_of(bar.folder / "out.json"))["hexahedra"], 160);
    const ResultReader left(bar.folder / "out.h5");
    const auto alone = left.displacement(0);
    EXPECT_EQ(alone.size(), 11U * 25);
    const auto report = livetet(bar.folder, "report out.h5");
    EXPECT_NE(report.out.find("cuts                  1 cut; the body is in one piece; pieces that "
                              "nothing holds are left out"),
              std::string::npos)
        << report.out;

    write_text(bar.folder / "scene.yaml", held_alone("free_pieces: keep\n"));
    run = livetet(bar.folder, "solve scene.yaml --json out.json");
    ASSERT_EQ(run.status, 0) << run.err;
    EXPECT_NE(run.err.find("keep their place at rest"), std::string::npos) << run.err;
    const ResultReader kept(bar.folder / "out.h5");
    const auto u = kept.displacement(0);
    double largest = 0;
    for (std::size_t e = 0; e < kept.mesh().hexahedra.size(); ++e)
        for (const std::int32_t n : kept.mesh().hexahedra[e]) {
            const bool is_kept = kept.mesh().nodes[kept.mesh().hexahedra[e][0]].x() > 0.0419;
            ASSERT_TRUE(!is_kept || u[n].norm() == 0);
            largest = std::max(largest, u[n].norm());
        }
    double largest_alone = 0;
    for (const Vector3& x : alone) largest_alone = std::max(largest_alone, x.norm());
    EXPECT_NEAR(largest, largest_alone, 1e-3 * largest);
    EXPECT_GT(largest, 1e-4);
    // The weight of half the bar, 10.24 g, that nothing carries.
    const auto forces = nlohmann::json::parse(text_of(bar.folder / "out.json"))["reactions_N"];
    EXPECT_NEAR(forces["free_pieces"][2].get<double>(), 0.01024, 1e-6) << forces;
}

/// In a dynamic scene a piece that is kept falls: by g t^2 / 2, whole.
TEST(Cuts, AKeptPieceFallsInADynamicScene) {
    const CutBar bar;
    write_text(bar.folder / "scene.yaml",
               held_alone("free_pieces: keep\n"
                          "time: {scheme: newmark, step_s: 0.01, duration_s: 0.1}\n"));
    const auto run = livetet(bar.folder, "solve scene.yaml");
    ASSERT_EQ(run.status, 0) << run.err;
    const ResultReader result(bar.folder / "out.h5");
    const auto u = result.displacement(result.frame_count() - 1);
    for (const Hexahedron& cell : result.mesh().hexahedra)
        for (const std::int32_t n : cell)
            if (result.mesh().nodes[cell[0]].x() > 0.0419) {
                ASSERT_LT((u[n] - Vector3(0, 0, -0.005)).norm(), 1e-5);
            }
}

TEST(Cuts, BadInputIsOneLineAndWritesNothing) {
    const CutBar bar;
    struct Case {
        const char* cuts;
        std::initializer_list<std::string> parts;
    };
    const Case cases[] = {
        {"cuts: [{point_mm: [200, 0, 0], normal: [1, 0, 0]}]\n",
         {"cuts[0]: crosses no pair", "a cut through the body", "(82.0, 18.0, 18.0) mm",
          "4 x 4 x 4 mm"}},
        {"cuts: [{point_mm: [42, 10, 10], normal: [1, 0, 0], radius_mm: 0.5}]\n",
         {"cuts[0]: crosses no pair", "more than a cell's width of it within the body"}},
        {"cuts: [{point_mm: [42, 8, 8], normal: [1, 0, 0], radius_mm: 0.5}]\n",
         {"cuts: separate only 1 pair", "too few to open a gap"}},
        {"cuts: [{point_mm: [42, 8, 8], normal: [1, 0, 0], radius_mm: 0}]\n",
         {"radius_mm", "greater than 0"}},
        {"cuts: [{point_mm: [42, 8, 8], normal: [0, 0, 0]}]\n",
         {"cuts[0].normal = (0, 0, 0) has no direction", "scene.yaml:"}},
        {"cuts: [{point_mm: [42, 8, 8], edges_mm: [1, 0, 0, 2, 0, 0]}]\n",
         {"cuts[0].edges_mm", "span no area"}},
        {"cuts: [{point_mm: [42, 8, 8], edges_mm: [1, 0, 0]}]\n",
         {"cuts[0].edges_mm has 3 numbers, expected 6"}},
        {"cuts: [{point_mm: [42, 8, 8]}]\n", {"cuts[0] names neither of normal and edges_mm"}},
        {"cuts: [{normal: [1, 0, 0]}]\n", {"cuts[0].point_mm is missing"}},
        {"cuts: [{}]\n", {"cuts[0] is empty, expected point_mm"}},
        {"cuts: [{file: nothing.stl}]\n", {"nothing.stl"}},
        {"free_pieces: keep\n", {"free_pieces: applies to what cuts free"}},
        {"cuts: [{point_mm: [42, 0, 0], normal: [1, 0, 0]}]\nfree_pieces: leave_out\n"
         "loads: [{nodes: [3], force_N: [1, 0, 0]}]\n",
         {"loads[0].nodes", "free_pieces: leave_out", "place, mask or group"}},
        {"cuts: [{point_mm: [42, 0, 0], normal: [1, 0, 0]}]\nfix: []\ndrive: []\n",
         {"the body is not held: 12 rigid motions"}},
        {"cuts: [{point_mm: [42, 0, 0], normal: [1, 0, 0]}]\nfree_pieces: keep\nfix: []\ndrive: "
         "[]\n",
         {"the body is not held: 12 rigid motions"}},
    };
    for (const Case& c : cases) {
        std::string text = CutBar::scene(c.cuts);
        if (std::string(c.cuts).find("drive: []") != std::string::npos)
            for (const char* key : {"fix", "drive"}) {  // the first of each
                const auto at = text.find(fmt::format("\n{}:", key));
                text.erase(at, text.find('\n', at + 1) - at);
            }
        write_text(bar.folder / "scene.yaml", text);
        expect_refused(livetet(bar.folder, "solve scene.yaml"), c.parts);
        EXPECT_FALSE(std::filesystem::exists(bar.folder / "out.h5")) << c.cuts;
    }
}

/// A bar of tetrahedra parts as one of hexahedra does: each end keeps its place, and stays
/// undeformed. The same on two ranks, and refined.
TEST(Cuts, ABarOfTetrahedraIsParted) {
    const Folder folder;
    std::vector<TetMesh> levels{shapes::box({0.08, 0.016, 0.016}, {15, 4, 4}),
                                shapes::box({0.08, 0.016, 0.016}, {8, 2, 2})};
    for (TetMesh& level : levels)
        for (Vector3& x : level.nodes) x += Vector3::Constant(0.002);
    write_hierarchy(folder / "bar.h5", make_hierarchy(levels, "boxes"));
    for (const auto& [more, ranks] : {std::pair{"mesh: {file: bar.h5}", 1},
                                      {"mesh: {file: bar.h5}", 2},
                                      {"mesh: {file: bar.h5, refine: 1}", 1},
                                      {"mesh: {file: bar.h5}\nelements: P2", 1}}) {
        std::string text = CutBar::scene("cuts: [{point_mm: [41, 2, 2], normal: [1, 0.2, 0.1]}]\n");
        text.replace(text.find("mesh: {file: bar.h5}"), 20, more);
        text.erase(text.find("image: grey.nii.gz"), 18);
        write_text(folder / "scene.yaml", text);
        const auto run = livetet(folder, "solve scene.yaml", test::mpirun(ranks));
        ASSERT_EQ(run.status, 0) << more << "\n" << run.err;
        EXPECT_NE(run.err.find("the body is in 2 pieces"), std::string::npos) << run.err;
        const ResultReader result(folder / "out.h5");
        const TetMesh& mesh = result.mesh();
        const auto u = result.displacement(result.frame_count() - 1);
        int held = 0, pulled = 0;
        for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
            const double at = u[n].x();
            EXPECT_TRUE(std::abs(at) < 1e-7 || std::abs(at - 0.008) < 1e-7) << more << ": " << at;
            ++(at > 0.004 ? pulled : held);
        }
        EXPECT_GT(held, 100);
        EXPECT_GT(pulled, 100);
    }
}

/// A patch on the surface across which a cut goes drives no node of the cut's walls.
TEST(Cuts, TheWallsOfACutAreNotPartOfAPatchOnTheSurface) {
    const CutBar bar;
    std::vector<TetMesh> levels{shapes::box({0.08, 0.016, 0.016}, {20, 4, 4})};
    for (Vector3& x : levels.front().nodes) x += Vector3::Constant(0.002);
    write_hierarchy(bar.folder / "tets.h5", make_hierarchy(std::move(levels), "a box"));
    for (const auto& [mesh, ranks] : {std::pair{"bar.h5}", 1},
                                      {"tets.h5}", 1},
                                      {"tets.h5}", 2},
                                      {"tets.h5, refine: 1}", 1},
                                      {"tets.h5}\nelements: P2", 1}}) {
        write_text(bar.folder / "scene.yaml", fmt::format(R"(
mesh: {{file: {}
materials: [{{young_Pa: 5000, poisson: 0.3}}]
fix: [{{half_space_mm: [2.1, 0, 0, 1, 0, 0]}}]
drive: [{{sphere_mm: [43, 10, 18, 9], where: surface, displacement_mm: [0, 0, 1.5]}}]
cuts: [{{point_mm: [43, 10, 18], edges_mm: [0, 40, 0, 0, 0, 16]}}]
output: {{file: out.h5}}
)",
                                                          mesh));
        const auto run = livetet(bar.folder, "solve scene.yaml", test::mpirun(ranks));
        ASSERT_EQ(run.status, 0) << mesh << "\n" << run.err;
        const ResultReader result(bar.folder / "out.h5");
        const auto u = result.displacement(result.frame_count() - 1);
        int outside = 0, inside = 0;
        for (std::size_t n = 0; n < u.size(); ++n) {
            if ((u[n] - Vector3(0, 0, 0.0015)).norm() > 1e-9) continue;
            const Vector3 x = 1e3 * result.mesh().nodes[n];
            const bool is_outside = (x - Vector3(2, 2, 2)).minCoeff() < 1e-6 ||
                                    (Vector3(82, 18, 18) - x).minCoeff() < 1e-6;
            ++(is_outside ? outside : inside);
        }
        EXPECT_GT(outside, 15) << mesh;
        EXPECT_EQ(inside, 0) << mesh;
    }
}

/// A block of 120 x 60 x 60 mm, held at x = 0 and moved at x = 120 mm, with a cut down to its
/// middle height: one made with the cut in its mesh, whose faces at that plane have nodes of their
/// own on both sides, to compare with.
struct NotchedBlock {
    static constexpr double cut_at = 0.057, tip = 0.03;
    static TetMesh tets(int cells_along) {
        return shapes::box({0.12, 0.06, 0.06}, {cells_along, cells_along / 2, cells_along / 2});
    }
    /// With a plane of nodes where the cut is to be, in place of the middle one.
    static TetMesh made_with_the_cut(int cells_along, double at) {
        TetMesh mesh = tets(cells_along);
        for (Vector3& x : mesh.nodes)
            x.x() = x.x() <= 0.06 ? x.x() * at / 0.06 : 0.12 - (0.12 - x.x()) * (0.12 - at) / 0.06;
        const std::size_t loaded = mesh.nodes.size();
        std::vector<std::int32_t> copy(loaded, -1);
        for (Tet& t : mesh.tets) {
            double middle = 0;
            for (const std::int32_t n : t) middle += mesh.nodes[n].x() / 4;
            if (middle < at) continue;
            for (std::int32_t& n : t) {
                const Vector3 x = mesh.nodes[n];
                if (std::abs(x.x() - at) > 1e-9 || x.z() < tip + 1e-9) continue;
                if (copy[n] < 0) {
                    copy[n] = static_cast<std::int32_t>(mesh.nodes.size());
                    mesh.nodes.push_back(x);
                }
                n = copy[n];
            }
        }
        return mesh;
    }
    static std::string scene(const std::string& mesh, const std::string& more,
                             const std::string& solver = "automatic") {
        return fmt::format(R"(
mesh: {{file: {}}}
materials: [{{young_Pa: 5000, poisson: 0.3, model: linear}}]
fix: [{{half_space_mm: [0.1, 0, 0, 1, 0, 0]}}]
drive: [{{half_space_mm: [119.9, 0, 0, -1, 0, 0], displacement_mm: [4, 0, -3]}}]
solver: {{kind: {}, newton_tolerance: 1e-8, relative_tolerance: 1e-8}}
output: {{file: out.h5}}
{})",
                           mesh, solver, more);
    }
    /// The cut of a scene at that plane.
    static std::string cut(double at) {
        return fmt::format("cuts: [{{point_mm: [{}, 30, 60], edges_mm: [0, 120, 0, 0, 0, 60]}}]\n",
                           1e3 * at);
    }
};

/// The displacement of a result at places of its body.
std::vector<Vector3> solved_at(const Folder& folder, const std::string& scene,
                               const std::vector<Vector3>& places) {
    write_text(folder / "scene.yaml", scene);
    const auto run = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(run.status, 0) << run.err;
    const ResultReader result(folder / "out.h5");
    return PointSampler(result.mesh(), places)
        .sample(result.displacement(result.frame_count() - 1));
}

/// Every node of a mesh, those of the border moved a little to the inside: each is on its own side.
std::vector<Vector3> places_beside_nodes(const TetMesh& mesh) {
    std::vector<Vector3> midst(mesh.nodes.size(), Vector3::Zero());
    std::vector<double> tets(mesh.nodes.size(), 0);
    for (const Tet& t : mesh.tets)
        for (const std::int32_t n : t) {
            for (const std::int32_t m : t) midst[n] += mesh.nodes[m] / 4;
            ++tets[n];
        }
    std::vector<Vector3> places = mesh.nodes;
    for (std::size_t n = 0; n < places.size(); ++n)
        places[n] += 0.02 * (midst[n] / tets[n] - places[n]);
    return places;
}

double farthest_apart(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
    double distance = 0;
    for (std::size_t i = 0; i < a.size(); ++i) distance = std::max(distance, (a[i] - b[i]).norm());
    return distance;
}

/// Ten-node tets that a plane cuts anywhere, or along their faces where the cut ends amid them, and
/// a grid along faces of its cells, answer as a mesh that was made with the cut in it: within 1 %
/// of the largest displacement, 5 mm, at every node.
TEST(Cuts, ACutMeshAnswersAsOneMadeWithTheCut) {
    const Folder folder;
    for (const auto& [at, cells] : {std::pair{0.057, 22}, {0.06, 30}}) {
        const TetMesh made = NotchedBlock::made_with_the_cut(28, at);
        const std::vector<Vector3> places = places_beside_nodes(made);
        const auto solved = [&](const TetMesh& mesh, const std::string& more) {
            write_hierarchy(folder / "mesh.h5", make_hierarchy({mesh}, "a notched block"));
            return solved_at(folder, NotchedBlock::scene("mesh.h5", more), places);
        };
        const std::string p2 = "elements: P2\n";
        const auto expected = solved(made, p2);
        const TetMesh tets = NotchedBlock::tets(cells);
        EXPECT_LT(farthest_apart(solved(tets, p2 + NotchedBlock::cut(at)), expected), 5e-5) << at;
        EXPECT_GT(farthest_apart(solved(tets, p2), expected), 2.5e-3) << "the cut opens";
        if (at != 0.06) continue;
        const TetMesh grid = test::hex_grid({48, 24, 24}, {0.12, 0.06, 0.06});
        EXPECT_LT(farthest_apart(solved(grid, NotchedBlock::cut(at)), expected), 5e-5) << "grid";
    }
}

/// A cut that ends in a bar of tets, once and listed twice.
TEST(Cuts, ACutThatIsListedAgainCutsNothing) {
    const Folder folder;
    TetMesh bar = test::shaken(shapes::box({0.08, 0.016, 0.016}, {20, 4, 4}), 0.001);
    write_hierarchy(folder / "bar.h5", make_hierarchy({std::move(bar)}, "a box"));
    const std::string cut = "{point_mm: [41, 8, 16], edges_mm: [0, 40, 0, 4, 0, 18]}";
    std::vector<std::vector<Vector3>> nodes;
    for (const std::string& cuts : {"[" + cut + "]", "[" + cut + ", " + cut + "]"}) {
        write_text(folder / "scene.yaml", NotchedBlock::scene("bar.h5", "cuts: " + cuts + "\n"));
        std::string text = text_of(folder / "scene.yaml");
        text.replace(text.find("119.9"), 5, "79.9");
        write_text(folder / "scene.yaml", text);
        const auto run = livetet(folder, "solve scene.yaml");
        ASSERT_EQ(run.status, 0) << run.err;
        nodes.push_back(ResultReader(folder / "out.h5").mesh().nodes);
    }
    EXPECT_EQ(nodes[0], nodes[1]);
    EXPECT_GT(nodes[0].size(), 21U * 5 * 5) << "it opens";
}

/// Iterations of a bar, whole and cut to an eighth of its height.
std::array<int, 2> iterations_of_bar(const std::vector<TetMesh>& levels,
                                     const std::string& solver) {
    const Folder folder;
    write_hierarchy(folder / "bar.h5", make_hierarchy(levels, "boxes"));
    std::array<int, 2> iterations{};
    for (const bool is_cut : {false, true}) {
        const std::string cuts =
            is_cut ? "cuts: [{point_mm: [58, 30, 60], edges_mm: [0, 120, 0, 0, 0, 105]}]\n" : "";
        write_text(folder / "scene.yaml", NotchedBlock::scene("bar.h5", cuts, solver));
        const auto run = livetet(folder, "solve scene.yaml --json out.json");
        EXPECT_EQ(run.status, 0) << run.err;
        iterations[is_cut] =
            nlohmann::json::parse(text_of(folder / "out.json"))["iterations"].get<int>();
    }
    EXPECT_GT(iterations[0], 5);
    return iterations;
}

/// Also where the levels do not fit each other, and coarse walls pass the cut by other ways.
TEST(Cuts, ABarCutNearlyThroughTakesAtMostTwiceTheIterations) {
    const Vector3 size(0.12, 0.06, 0.06);
    std::vector<TetMesh> in_rows, shaken;
    for (const int cells : {20, 10, 5}) {
        in_rows.push_back(shapes::box(size, {2 * cells, cells, cells}));
        shaken.push_back(test::shaken(in_rows.back(), 0.012 / cells));
    }
    for (const std::string solver : {"multigrid", "live"})
        for (const auto& levels : {in_rows, shaken}) {
            const auto [whole, cut] = iterations_of_bar(levels, solver);
            EXPECT_LE(cut, 2 * whole) << solver;
        }
}

/// A study over the radius of a disc: the deeper the cut, the less energy the pull takes.
TEST(Cuts, AStudyVariesACut) {
    const CutBar bar;
    write_text(bar.folder / "scene.yaml",
               CutBar::scene("cuts: [{point_mm: [42, 2, 2], normal: [1, 0, 0], radius_mm: 6}]\n"));
    write_text(bar.folder / "study.yaml",
               "scene: scene.yaml\noutput: study.h5\n"
               "vary: [{key: \"cuts[0].radius_mm\", values: [6, 10, 14]}]\n");
    const auto run = livetet(bar.folder, "study study.yaml");
    ASSERT_EQ(run.status, 0) << run.err;
    std::istringstream table(text_of(bar.folder / "study.csv"));
    std::string header, line;
    std::getline(table, header);
    const auto column = std::count(
        header.begin(),
        header.begin() + static_cast<std::ptrdiff_t>(header.find("strain_energy_mJ")), ',');
    std::vector<double> energies;
    while (std::getline(table, line)) {
        std::istringstream cells(line);
        std::string cell;
        for (std::ptrdiff_t c = 0; c <= column; ++c) std::getline(cells, cell, ',');
        energies.push_back(std::stod(cell));
    }
    ASSERT_EQ(energies.size(), 3U);
    EXPECT_GT(energies[0], energies[1]);
    EXPECT_GT(energies[1], energies[2]);
}

}  // namespace
}  // namespace livetet
