// The shipped program on grids of hexahedra: from a label map to a result.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <nlohmann/json.hpp>

#include "apps/verification/meshes.hpp"
#include "io/hdf5.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"
#include "mesh/hex_grid.hpp"
#include "support/hex_grids.hpp"
#include "support/program.hpp"

namespace livetet {
namespace {

using test::Folder;
using test::livetet;
using test::text_of;
using test::write_text;

/// A bar of 80 x 16 x 16 mm in voxels of 1 mm.
void write_bar(const std::filesystem::path& path) {
    LabelImage image{{84, 20, 20}, Eigen::Matrix4d::Identity(), {}};
    image.ras_from_voxel.topLeftCorner<3, 3>() *= 1e-3;
    image.ras_from_voxel.col(3) << 0.5e-3, 0.5e-3, 0.5e-3, 1;
    for (int k = 0; k < 20; ++k)
        for (int j = 0; j < 20; ++j)
            for (int i = 0; i < 84; ++i)
                image.values.push_back(i >= 2 && i < 82 && j >= 2 && j < 18 && k >= 2 && k < 18);
    write_image(path, image);
}

const std::string pulled = R"(
mesh: {{file: bar.h5}}
materials: [{{young_Pa: 5000, poisson: 0.3, model: {}}}]
fix: [{{half_space_mm: [2.1, 0, 0, 1, 0, 0], components: x}},
      {{sphere_mm: [2, 2, 2, 0.1]}}, {{sphere_mm: [2, 18, 2, 0.1], components: z}}]
loads: [{{half_space_mm: [81.9, 0, 0, -1, 0, 0], pressure_Pa: -250}}]
solver: {{newton_tolerance: 1e-10, relative_tolerance: 1e-8}}
output: {{file: out.h5, fields: [stress, von_mises]}}
)";

/// Uniaxial tension, exact on any grid: 250 Pa by 5000 Pa lengthens 80 mm by 4 mm.
TEST(Hexahedra, ABarIsPulledAsItsLawSays) {
    const Folder folder;
    write_bar(folder / "bar.nii.gz");
    ASSERT_EQ(livetet(folder, "mesh bar.nii.gz --cells hexahedra --tets 400 -o bar.h5").status, 0);
    const TetMesh mesh = read_hierarchy(folder / "bar.h5").levels.front();
    EXPECT_EQ(mesh.hexahedra.size(), 20U * 4 * 4);
    write_text(folder / "scene.yaml", fmt::format(fmt::runtime(pulled), "linear"));
    const auto run = livetet(folder, "solve scene.yaml --json out.json");
    ASSERT_EQ(run.status, 0) << run.err;
    const ResultReader result(folder / "out.h5");
    const auto u = result.displacement(0);
    for (std::size_t n = 0; n < u.size(); ++n)
        EXPECT_NEAR(u[n].x(), 0.05 * (mesh.nodes[n].x() - 2e-3), 1e-8);
    const auto stress = result.field("stress", 0, 9);
    ASSERT_EQ(stress.size(), 9 * mesh.tets.size());
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) EXPECT_NEAR(stress[9 * e], 250, 1e-3);
    const auto about = nlohmann::json::parse(text_of(folder / "out.json"));
    EXPECT_EQ(about["hexahedra"], 320);
    EXPECT_NE(text_of(folder / "out.xdmf").find("Hexahedron"), std::string::npos);
}

/// The same in hexahedra of 27 nodes, by displacements and, nearly incompressible, in the mixed
/// form.
TEST(Hexahedra, AGridIsPulledInElementsOfOrderTwo) {
    const Folder folder;
    write_bar(folder / "bar.nii.gz");
    ASSERT_EQ(livetet(folder, "mesh bar.nii.gz --cells hexahedra --tets 100 -o bar.h5").status, 0);
    for (const double nu : {0.3, 0.4999}) {
        std::string scene = fmt::format(fmt::runtime(pulled), "linear") + "elements: P2\n";
        scene.replace(scene.find("poisson: 0.3"), 12, fmt::format("poisson: {}", nu));
        write_text(folder / "scene.yaml", scene);
        const auto run = livetet(folder, "solve scene.yaml");
        ASSERT_EQ(run.status, 0) << run.err;
        EXPECT_NE(run.out.find("hexahedra of 27 nodes"), std::string::npos) << run.out;
        const ResultReader result(folder / "out.h5");
        const TetMesh& mesh = result.mesh();
        EXPECT_EQ(mesh.quadratic_hexahedra.size(),
                  read_hierarchy(folder / "bar.h5").levels.front().hexahedra.size());
        const auto u = result.displacement(0);
        for (std::size_t n = 0; n < u.size(); ++n)
            EXPECT_NEAR(u[n].x(), 0.05 * (mesh.nodes[n].x() - 2e-3), 1e-8);
        const auto stress = result.field("stress", 0, 9);
        ASSERT_EQ(stress.size(), 9 * mesh.tets.size());
        for (std::size_t e = 0; e < mesh.tets.size(); ++e) EXPECT_NEAR(stress[9 * e], 250, 2e-2);
        EXPECT_NE(text_of(folder / "out.xdmf").find("TopologyType=\"Tetrahedron\""),
                  std::string::npos);
    }
}

/// A study's pictures are of the tables that its file has.
TEST(Hexahedra, AStudyNamesTheTablesOfItsMesh) {
    const Folder folder;
    write_bar(folder / "bar.nii.gz");
    ASSERT_EQ(livetet(folder, "mesh bar.nii.gz --cells hexahedra --tets 100 -o bar.h5").status, 0);
    write_text(folder / "scene.yaml", fmt::format(fmt::runtime(pulled), "linear"));
    write_text(folder / "study.yaml",
               "scene: scene.yaml\nvary: [{key: elements, values: [P1, P2]}]\n"
               "plots: []\n");
    const auto run = livetet(folder, "study study.yaml");
    ASSERT_EQ(run.status, 0) << run.err;
    const std::string xdmf = text_of(folder / "study.xdmf");
    const hdf5::File file = hdf5::File::open(folder / "study.h5");
    for (const char* table : {"meshes/0/hexahedra", "meshes/1/tets"}) {
        EXPECT_NE(xdmf.find(std::string("study.h5:/") + table), std::string::npos) << xdmf;
        EXPECT_TRUE(file.has(table)) << table;
    }
    EXPECT_EQ(xdmf.find("meshes/0/tets"), std::string::npos);
}

/// A quarter of a tube under pressure from within, its ends held: 0.05 <= r <= 0.1 m.
const std::string tube = R"(
mesh: {{file: tube.h5}}
strain: linear
materials: [{{young_Pa: 5000, poisson: {}}}]
fix: [{{group: x0, components: x}}, {{group: y0, components: y}},
      {{group: z0, components: z}}, {{group: z1, components: z}}]
loads: [{{group: inner, pressure_Pa: 100}}]
output: {{file: out.h5}}
)";

TetMesh bent_tube() {
    return verification::bent_hexahedra(verification::cylinder_quarter(0.05, 0.1, 0.02, 4, 8, 2),
                                        {4, 8, 2});
}

/// Lame: u_r = (1 + nu) p a^2 / (E (b^2 - a^2)) ((1 - 2 nu) r + b^2 / r), on 8 hexahedra.
TEST(Hexahedra, ABentTubeWidensAsLameSays) {
    const Folder folder;
    write_hierarchy(folder / "tube.h5", make_hierarchy({bent_tube()}, "tube"));
    for (const double nu : {0.3, 0.4999}) {
        write_text(folder / "scene.yaml", fmt::format(fmt::runtime(tube), nu));
        const auto run = livetet(folder, "solve scene.yaml");
        ASSERT_EQ(run.status, 0) << run.err;
        const ResultReader result(folder / "out.h5");
        const auto u = result.displacement(0);
        const double a = 0.05, b = 0.1, scale = (1 + nu) * 100 * a * a / (5000 * (b * b - a * a));
        for (std::size_t n = 0; n < u.size(); ++n) {
            const Vector3& x = result.mesh().nodes[n];
            const double r = x.head<2>().norm();
            const Vector3 exact =
                scale * ((1 - 2 * nu) + b * b / (r * r)) * Vector3(x.x(), x.y(), 0);
            EXPECT_LT((u[n] - exact).norm(), 3e-3 * scale * 3 * a) << nu << " " << x.transpose();
        }
    }
}

TEST(Hexahedra, WhatBentOnesCannotHaveIsRefused) {
    const Folder folder;
    TetMesh mesh = bent_tube();
    write_hierarchy(folder / "tube.h5", make_hierarchy({mesh}, "tube"));
    const std::string scene = fmt::format(fmt::runtime(tube), 0.3);
    const auto refused = [&](const std::string& command, const std::string& more,
                             std::initializer_list<std::string> words) {
        write_text(folder / "scene.yaml", scene + more);
        test::expect_refused(livetet(folder, command), words);
    };
    refused("solve scene.yaml", "cuts: [{point_mm: [75, 0, 10], normal: [0, 0, 1]}]\n",
            {"cuts: found hexahedra that are no grid"});
    refused("solve scene.yaml", "solver: {kind: live}\n",
            {"solver.kind: found live and hexahedra of 27 nodes"});
    refused("explain scene.yaml", "", {"found a mesh of hexahedra"});
    // A file whose cells are turned over, and one whose tets are not theirs.
    std::swap(mesh.quadratic_hexahedra[2][0], mesh.quadratic_hexahedra[2][2]);
    write_hierarchy(folder / "tube.h5", make_hierarchy({mesh}, "tube"));
    test::expect_refused(livetet(folder, "solve scene.yaml"),
                         {"tube.h5: levels/0: hexahedron 2 is flat or turned over"});
    std::swap(mesh.quadratic_hexahedra[2][0], mesh.quadratic_hexahedra[2][2]);
    std::swap(mesh.quadratic_hexahedra[1], mesh.quadratic_hexahedra[2]);
    write_hierarchy(folder / "tube.h5", make_hierarchy({mesh}, "tube"));
    test::expect_refused(livetet(folder, "solve scene.yaml"), {"expected 48 of each"});
}

/// A grid in Gmsh's text format, mm.
void write_msh(const std::filesystem::path& path, const TetMesh& grid) {
    std::string text =
        fmt::format("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", grid.nodes.size());
    for (std::size_t n = 0; n < grid.nodes.size(); ++n) {
        const Vector3 x = 1e3 * grid.nodes[n];
        text += fmt::format("{} {} {} {}\n", n + 1, x.x(), x.y(), x.z());
    }
    text += fmt::format("$EndNodes\n$Elements\n{}\n", grid.hexahedra.size());
    for (std::size_t e = 0; e < grid.hexahedra.size(); ++e) {
        text += fmt::format("{} 5 2 1 1", e + 1);
        for (const int c : {0, 1, 3, 2, 4, 5, 7, 6})
            text += fmt::format(" {}", grid.hexahedra[e][c] + 1);
        text += "\n";
    }
    write_text(path, text + "$EndElements\n");
}

/// A grid from another program is solved as the same one of ours, as it is and once `mesh` has
/// written it; what it cannot have is refused.
TEST(Hexahedra, AGridOfAnotherProgramIsSolved) {
    const Folder folder;
    write_bar(folder / "bar.nii.gz");
    ASSERT_EQ(livetet(folder, "mesh bar.nii.gz --cells hexahedra --tets 400 -o bar.h5").status, 0);
    write_msh(folder / "bar.msh", read_hierarchy(folder / "bar.h5").levels.front());
    ASSERT_EQ(livetet(folder, "mesh bar.msh -o meshed.h5").status, 0);
    const auto solved = [&](const std::string& mesh) {
        std::string scene = fmt::format(fmt::runtime(pulled), "neohookean");
        scene.replace(scene.find("bar.h5"), 6, mesh);
        write_text(folder / "scene.yaml", scene);
        const auto run = livetet(folder, "solve scene.yaml");
        EXPECT_EQ(run.status, 0) << run.err;
        EXPECT_NE(run.out.find("320 hexahedra"), std::string::npos) << run.out;
        const ResultReader result(folder / "out.h5");
        std::map<std::array<long, 3>, Vector3> u;  // by place, as nodes are numbered anew
        const auto values = result.displacement(0);
        for (std::size_t n = 0; n < values.size(); ++n) {
            const Vector3 x = 1e6 * result.mesh().nodes[n];
            u[{std::lround(x.x()), std::lround(x.y()), std::lround(x.z())}] = values[n];
        }
        return u;
    };
    const auto expected = solved("bar.h5");
    for (const char* mesh : {"bar.msh", "meshed.h5"}) {
        const auto found = solved(mesh);
        ASSERT_EQ(found.size(), expected.size());
        for (const auto& [place, u] : expected)
            EXPECT_LT((found.at(place) - u).norm(), 1e-9) << mesh;
    }
    write_text(folder / "scene.yaml", "mesh: {file: bar.msh, levels: 2}\n" + std::string(R"(
materials: [{young_Pa: 5000, poisson: 0.3}]
fix: [{half_space_mm: [2.1, 0, 0, 1, 0, 0]}]
)"));
    test::expect_refused(livetet(folder, "solve scene.yaml"),
                         {"mesh.levels = 2", "found a mesh of hexahedra"});
}

TEST(Hexahedra, OtherCommandsRefuseThemInOneLine) {
    const Folder folder;
    write_bar(folder / "bar.nii.gz");
    ASSERT_EQ(livetet(folder, "mesh bar.nii.gz --cells hexahedra --tets 400 -o bar.h5").status, 0);
    write_text(folder / "scene.yaml", fmt::format(fmt::runtime(pulled), "linear"));
    for (const char* command : {"explain scene.yaml", "tune scene.yaml --error 1mm",
                                "mesh bar.nii.gz --cells hexahedra --levels 3 -o o.h5",
                                "mesh bar.nii.gz --cells hexahedra --inside-growth 2 -o o.h5"}) {
        const auto run = livetet(folder, command);
        EXPECT_EQ(run.status, 2) << command;
        EXPECT_EQ(std::count(run.err.begin(), run.err.end(), '\n'), 1) << run.err;
        EXPECT_NE(run.err.find("hexahedra"), std::string::npos) << run.err;
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "o.h5"));
}

TEST(Hexahedra, GalerkinOperatorsAreRefused) {
    const Folder folder;
    write_bar(folder / "bar.nii.gz");
    ASSERT_EQ(livetet(folder, "mesh bar.nii.gz --cells hexahedra --tets 400 -o bar.h5").status, 0);
    write_text(folder / "scene.yaml", fmt::format(fmt::runtime(pulled), "linear"));
    ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    std::string scene = text_of(folder / "scene.yaml");
    scene.replace(scene.find("solver: {"), 9, "solver: {coarse: galerkin, ");
    write_text(folder / "scene.yaml", scene);
    test::expect_refused(livetet(folder, "solve scene.yaml"), {"solver.coarse", "galerkin"});
}

/// A study over a grid that its scene makes from the image.
TEST(Hexahedra, AStudyMakesItsGridFromTheImage) {
    const Folder folder;
    write_bar(folder / "bar.nii.gz");
    std::string scene = fmt::format(fmt::runtime(pulled), "linear");
    scene.replace(scene.find("{file: bar.h5}"), 14,
                  "{file: bar.nii.gz, cells: hexahedra, tets: 400}");
    write_text(folder / "scene.yaml", scene);
    write_text(
        folder / "study.yaml",
        "scene: scene.yaml\nvary: [{key: \"materials[0].young_Pa\", values: [5000, 10000]}]\n"
        "plots: []\n");
    const auto run = livetet(folder, "study study.yaml");
    ASSERT_EQ(run.status, 0) << run.err;
    const hdf5::File file = hdf5::File::open(folder / "study.h5");
    EXPECT_TRUE(file.has("meshes/0/hexahedra"));
    EXPECT_NE(run.out.find("2, 2 converged"), std::string::npos) << run.out;
}

/// Nearly incompressible, at rest beside a sensor whose pose differs by rounding alone: frames end
/// once what is left is rounding, too, and all count as converged.
TEST(Hexahedra, ARestingGridWithPressuresIsFollowed) {
    const Folder folder;
    write_hierarchy(folder / "bar.h5",
                    make_hierarchy({test::hex_grid({10, 10, 40}, {0.02, 0.02, 0.08})}, "a grid"));
    FiducialRegistration registration;
    registration.reference_tool = "Reference";
    registration.image_from_base = {1, Eigen::Matrix3d::Identity(), Vector3::Zero()};
    for (const Vector3& x :
         {Vector3(0, 0, 0), Vector3(0.2, 0, 0), Vector3(0, 0.1, 0), Vector3(0, 0, 0.1)})
        registration.fiducials.push_back({"F", x, x, x, 0, 0});
    write_registration(folder / "registration.json", registration);
    write_text(folder / "script.yaml", R"(
rate_Hz: 20
duration_s: 4
organ: {at_mm: [200, 50, -100], turn_deg: [10, 20, 30]}
tools:
  - {tool: Reference, at_mm: [0, 0, 0]}
  - {tool: Sensor, at_mm: [10, 10, 80], moves: [{at_s: 3}, {at_s: 4, by_mm: [0, -6, 4]}]}
)");
    write_text(folder / "scene.yaml", R"(
mesh: {file: bar.h5}
materials: [{young_Pa: 3000, poisson: 0.4999}]
strain: neohookean
fix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}]
time: {scheme: static}
track:
  registration: registration.json
  source: script.yaml
  pace: every-sample
  position_noise_mm: 0.05
  rotation_noise_deg: 0.02
  sensors: [{tool: Sensor, may_slip: false, patch_radius_mm: 15}]
output: {file: out.h5}
)");
    const auto run = livetet(folder, "track scene.yaml");
    EXPECT_EQ(run.status, 0) << run.err;
    const ResultReader result(folder / "out.h5");
    ASSERT_GT(result.frame_count(), 70U);
    double press_mm = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k) {
        EXPECT_LT(result.values("iterations", k, 1)[0], 150) << k;
        EXPECT_EQ(result.values("converged", k, 1)[0], 1) << k;
        press_mm = std::max(press_mm, result.values("press_mm", k, 1)[0]);
    }
    EXPECT_NEAR(press_mm, 7.2, 0.6) << "6 mm to the side and 4 up";
}

}  // namespace
}  // namespace livetet
