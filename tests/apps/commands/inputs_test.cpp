// What users bring: images of other formats, grey images, meshes of other programs.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <random>

#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "mesh/shapes.hpp"
#include "mesh/tet_mesh.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::write_text;

constexpr int n = 24;
constexpr double radius = 9, ball_ml = 4.0 / 3 * 3.14159265358979 * 18 * 18 * 18 / 1000;

/// A ball of radius 18 mm in voxels of 2 mm, whose first voxel lies at RAS (-10, -20, 30): `inside`
/// in it, `outside` round it; in the format's own way of saying so, LPS.
void write_ball(const std::filesystem::path& path, std::int16_t inside, std::int16_t outside) {
    std::string bytes;
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const bool in = (Vector3(i, j, k) - Vector3::Constant(11.5)).norm() < radius;
                const std::int16_t value = in ? inside : outside;
                bytes.append(reinterpret_cast<const char*>(&value), 2);
            }
    const std::string head = path.extension() == ".nrrd"
                                 ? "NRRD0005\ntype: short\nendian: little\ndimension: 3\nsizes: 24 "
                                   "24 24\nencoding: raw\nspace: "
                                   "left-posterior-superior\nspace directions: (-2,0,0) (0,-2,0) "
                                   "(0,0,2)\nspace origin: (10,20,30)\n\n"
                                 : "ObjectType = Image\nNDims = 3\nBinaryData = "
                                   "True\nBinaryDataByteOrderMSB = False\nTransformMatrix = -1 "
                                   "0 0 0 "
                                   "-1 0 0 0 1\nOffset = 10 20 30\nElementSpacing = 2 2 2\nDimSize "
                                   "= 24 24 24\nElementType = "
                                   "MET_SHORT\nElementDataFile = LOCAL\n";
    write_text(path, head + bytes);
}

Vector3 mean_node(const TetMesh& mesh) {
    Vector3 sum = Vector3::Zero();
    for (const Vector3& x : mesh.nodes) sum += x;
    return sum / static_cast<double>(mesh.nodes.size());
}

const std::string coarse = " --edge-lengths-mm 9 -o out.h5";

void expect_ball(const Folder& folder) {
    const TetMesh mesh = read_hierarchy(folder / "out.h5").levels.front();
    EXPECT_NEAR(1e6 * volume(mesh), ball_ml, 0.12 * ball_ml);
    EXPECT_LT((1e3 * mean_node(mesh) - Vector3(13, 3, 53)).norm(), 1.5)
        << "where the header places its centre";
}

TEST(Inputs, LabelMapsOfOtherFormatsAreMeshedInPlaceAndMasksHold) {
    for (const std::string format : {"nrrd", "mha"}) {
        const Folder folder;
        write_ball(folder / ("labels." + format), 3, 0);
        const auto outcome = livetet(
            folder, "mesh labels." + format + " --labels 3 --fix labels." + format + coarse);
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        expect_ball(folder);
        const TetMesh mesh = read_hierarchy(folder / "out.h5").levels.front();
        EXPECT_GT(mesh.node_sets.at("fixed").size(), mesh.nodes.size() / 10);
        EXPECT_EQ(mesh.regions, std::vector<std::int32_t>(mesh.tets.size(), 3));
        write_text(folder / "scene.yaml", "mesh: {file: out.h5}\nfix: [{mask: labels." + format +
                                              "}]\ngravity_m_per_s2: [0, 0, -9.81]\n");
        EXPECT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    }
}

TEST(Inputs, AGreyImageIsMeshedBetweenThresholds) {
    const Folder folder;
    write_ball(folder / "ct.nrrd", 80, -900);
    for (const std::string range : {"50:100", "80:", "-100:80"}) {
        const auto outcome = livetet(folder, "mesh ct.nrrd --threshold " + range + coarse);
        ASSERT_EQ(outcome.status, 0) << range << outcome.err;
        expect_ball(folder);
        EXPECT_TRUE(read_hierarchy(folder / "out.h5").levels.front().regions.empty());
    }
    write_ball(folder / "dark.mha", -900, 80);
    EXPECT_EQ(livetet(folder, "mesh dark.mha --threshold :-500" + coarse).status, 0);
    expect_ball(folder);
    write_text(folder / "scene.yaml",
               "mesh: {file: ct.nrrd, threshold: \"50:100\", edge_lengths_mm: [9]}\n");
    EXPECT_EQ(livetet(folder, "mesh scene.yaml -o out.h5").status, 0);
    expect_ball(folder);
}

TEST(Inputs, AGreyImageWithoutAThresholdIsToldOfIt) {
    const Folder folder;
    write_ball(folder / "ct.nrrd", 80, -900);
    expect_refused(livetet(folder, "mesh ct.nrrd -o out.h5"),
                   {"ct.nrrd", "-900", "grey", "--threshold LOW:HIGH"});
    GreyImage grey{{2, 2, 1}, Eigen::Matrix4d::Identity(), {0, 0.5f, 1, 2}};
    write_image(folder / "f.nii.gz", grey);
    expect_refused(livetet(folder, "mesh f.nii.gz --labels 1 -o out.h5"),
                   {"f.nii.gz", "0.5", "--threshold"});
    LabelImage many{{300, 2, 1}, Eigen::Matrix4d::Identity(), {}};
    for (int v = 0; v < 600; ++v) many.values.push_back(v / 2);
    write_image(folder / "many.nii.gz", many);
    expect_refused(livetet(folder, "mesh many.nii.gz -o out.h5"),
                   {"200 different values", "--threshold", "--labels"});
    expect_refused(livetet(folder, "mesh ct.nrrd --threshold 500:600 -o out.h5"),
                   {"ct.nrrd", "500:600", "-900", "80"});
    expect_refused(livetet(folder, "mesh ct.nrrd --threshold 5: --labels 1 -o out.h5"),
                   {"labels", "threshold"});
    for (const std::string wrong : {"100", ":", "9:3", "a:b", "1:2:3", "nan:"})
        expect_refused(livetet(folder, "mesh ct.nrrd --threshold " + wrong + " -o out.h5"),
                       {"threshold", wrong, "LOW:HIGH"});
    write_text(folder / "scene.yaml", "mesh: {file: ct.nrrd, threshold: \"9:3\"}\n");
    expect_refused(livetet(folder, "mesh scene.yaml -o out.h5"),
                   {"threshold", "9:3", "LOW:HIGH", "scene.yaml:1"});
    EXPECT_FALSE(std::filesystem::exists(folder / "out.h5"));
}

/// A scanner writes NaN where it saw nothing.
TEST(Inputs, NaNIsOutsideOfAThresholdAndCounted) {
    const Folder folder;
    GreyImage image{{24, 24, 24}, Eigen::Matrix4d::Identity(), {}};
    image.ras_from_voxel.diagonal() << 2e-3, 2e-3, 2e-3, 1;
    for (int v = 0; v < 24 * 24 * 24; ++v) {
        const Vector3 x(v % 24, v / 24 % 24, v / 576);
        image.values.push_back(v < 10 ? std::nanf("") : (x.array() - 11.5).matrix().norm() < 9);
    }
    write_image(folder / "ct.nii.gz", image);
    const auto outcome = livetet(folder, "mesh ct.nii.gz --threshold 0.5:" + coarse);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("10 of 13824 voxels are not finite"), std::string::npos)
        << outcome.out;
}

TEST(Inputs, NamesOfOtherFormatsAreToldWhichThereAre) {
    const Folder folder;
    for (const std::string name : {"brain.img", "brain.mgz"}) {
        write_text(folder / name, "x");
        expect_refused(livetet(folder, "mesh " + name + " -o out.h5"),
                       {name, "expected an image (.nii", "a surface (.stl", "DICOM"});
    }
    write_text(folder / "slice.dcm", "x");
    expect_refused(livetet(folder, "mesh slice.dcm -o out.h5"),
                   {"slice.dcm", "damaged, expected a DICOM file"});
    std::filesystem::create_directory(folder / "empty");
    for (const std::string name : {"empty", "empty/", "empty#3"})
        expect_refused(livetet(folder, "mesh " + name + " -o out.h5"),
                       {"empty: holds no DICOM image"});
}

TEST(Inputs, MessagesAreWholeAndWithoutAddresses) {
    const Folder folder;
    write_text(folder / "nul.off", std::string("OFF\n1\0 2 3\n", 11));
    expect_refused(livetet(folder, "mesh nul.off -o out.h5"),
                   {"nul.off", "found '1\\x00'", "expected the number of points"});
    write_text(
        folder / "bad.vtk",
        "# vtk DataFile Version 3.0\nt\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 x 1 0 0 0 1 "
        "0\nPOLYGONS 1 4\n3 0 1 2\n");
    const auto outcome = livetet(folder, "mesh bad.vtk -o out.h5");
    expect_refused(outcome, {"bad.vtk", "cannot be read: vtkPolyDataReader: "});
    EXPECT_EQ(outcome.err.find("(0x"), std::string::npos) << outcome.err;
    write_text(folder / "large.nrrd",
               "NRRD0005\ntype: uint\ndimension: 3\nsizes: 1 1 2\nspace: "
               "left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: "
               "(0,0,0)\nencoding: text\n\n0 4000000000\n");
    expect_refused(livetet(folder, "mesh large.nrrd -o out.h5"), {"large.nrrd", "of 32 bits"});
}

TEST(Inputs, AMaskThatCoversNothingIsRefusedBeforeMeshing) {
    const Folder folder;
    write_ball(folder / "labels.nrrd", 3, 0);
    LabelImage mask{
        {4, 4, 4}, 1e-3 * Eigen::Matrix4d::Identity(), std::vector<std::int32_t>(64, 0)};
    mask.ras_from_voxel(3, 3) = 1;
    write_image(folder / "mask.nii.gz", mask);
    expect_refused(livetet(folder, "mesh labels.nrrd --fix mask.nii.gz" + coarse),
                   {"mask.nii.gz", "every voxel is 0"});
    mask.values[0] = 1;
    mask.ras_from_voxel.topRightCorner<3, 1>() << 1, 2, 3;
    write_image(folder / "mask.nii.gz", mask);
    const auto start = std::chrono::steady_clock::now();
    expect_refused(livetet(folder, "mesh labels.nrrd --tets 2000000 --fix mask.nii.gz -o out.h5"),
                   {"mask.nii.gz", "(1000.0, 2000.0, 3000.0)", "same world"});
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(Inputs, ABodyInMetresThatIsTakenForMillimetresIsRefused) {
    const Folder folder;
    TriangleMesh spleen = shapes::sphere(0.08, 3);
    for (Vector3& x : spleen.nodes) x *= 1e-3;
    write_surface(folder / "spleen.stl", spleen, Space::ras);  // 0.16: metres
    expect_refused(livetet(folder, "mesh spleen.stl -o out.h5"),
                   {"spleen.stl", "0.16 x 0.16 x 0.16 mm", "--metres"});
    EXPECT_EQ(livetet(folder, "mesh spleen.stl --metres --edge-lengths-mm 40 -o out.h5").status, 0);
}

/// What `solve` would refuse is not kept.
TEST(Inputs, ADamagedHierarchyIsMadeAgain) {
    const Folder folder;
    write_surface(folder / "ball.stl", shapes::sphere(0.08, 3), Space::ras);
    const std::string command = "mesh ball.stl --edge-lengths-mm 40 -o out.h5";
    EXPECT_EQ(livetet(folder, command).status, 0);
    EXPECT_NE(livetet(folder, command).out.find("unchanged"), std::string::npos);
    std::string bytes = test::text_of(folder / "out.h5");
    const double x = read_hierarchy(folder / "out.h5").levels.front().nodes.front().x(),
                 no_number = std::nan("");
    const std::size_t at = bytes.find(std::string(reinterpret_cast<const char*>(&x), sizeof x));
    ASSERT_NE(at, std::string::npos);
    std::memcpy(bytes.data() + at, &no_number, sizeof x);
    write_text(folder / "out.h5", bytes);
    EXPECT_EQ(livetet(folder, command).out.find("unchanged"), std::string::npos);
    EXPECT_EQ(livetet(folder, "mesh out.h5 -o copy.h5").status, 0);
}

TEST(Inputs, ACrossingOpenSurfaceIsRefusedOrWrapped) {
    const Folder folder;
    TriangleMesh surface = shapes::sphere(0.05, 5);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> push(-0.004, 0.004);
    for (Vector3& x : surface.nodes) x += Vector3(push(random), push(random), push(random));
    write_surface(folder / "crumpled.stl", surface, Space::ras);
    expect_refused(livetet(folder, "mesh crumpled.stl --tets 2000 -o out.h5"),
                   {"crumpled.stl", "cut each other", "--wrap"});
    const auto outcome = livetet(folder, "mesh crumpled.stl --wrap 10 --tets 2000 -o out.h5");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("mm at most from the wrap"), std::string::npos) << outcome.out;
}

TEST(Inputs, LegacyVtkTetrahedraAreRead) {
    const Folder folder;
    write_text(folder / "tets.vtk",
               "# vtk DataFile Version 3.0\ntets\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 "
               "float\n0 0 0 10 0 0 0 10 0 0 0 10 10 10 10\nCELLS 2 10\n4 0 1 2 3\n4 1 2 3 "
               "4\nCELL_TYPES 2\n10\n10\nCELL_DATA 2\nSCALARS region int 1\nLOOKUP_TABLE "
               "default\n4\n6\n");
    const auto outcome = livetet(folder, "mesh tets.vtk -o out.h5");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const TetMesh mesh = read_hierarchy(folder / "out.h5").levels.front();
    EXPECT_EQ(mesh.tets.size(), 2u);
    EXPECT_EQ(mesh.regions, (std::vector<std::int32_t>{4, 6}));
    EXPECT_NEAR(1e9 * volume(mesh), 1000 / 6. + 1000 / 3., 1e-6);
}

TEST(Inputs, ADamagedImageSaysSoInOneLine) {
    const Folder folder;
    write_ball(folder / "whole.mha", 1, 0);
    const std::string whole = test::text_of(folder / "whole.mha");
    write_text(folder / "cut.mha", whole.substr(0, whole.size() / 2));
    expect_refused(livetet(folder, "mesh cut.mha -o out.h5"), {"cut.mha", "truncated"});
    expect_refused(livetet(folder, "mesh whole.mha --fix cut.mha" + coarse),
                   {"cut.mha", "truncated"});
    EXPECT_FALSE(std::filesystem::exists(folder / "out.h5"));
}

/// A pyramid stack: five points, two tets of regions 4 and 6; lengths in mm, or in whatever unit is
/// told.
const std::string two_tets =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" "
    "byte_order=\"LittleEndian\">\n"
    "<UnstructuredGrid><Piece NumberOfPoints=\"5\" NumberOfCells=\"2\"><Points><DataArray "
    "type=\"Float64\" "
    "NumberOfComponents=\"3\" format=\"ascii\">0 0 0  10 0 0  0 10 0  0 0 10  10 10 "
    "10</DataArray></Points>\n"
    "<Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3  1 2 3 "
    "4</DataArray>\n"
    "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 8</DataArray>\n"
    "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 "
    "10</DataArray></Cells>\n<CellData>"
    "<DataArray type=\"Int32\" Name=\"region\" format=\"ascii\">4 6</DataArray></CellData>\n"
    "</Piece></UnstructuredGrid></VTKFile>\n";

Vector3 centre_of(const TetMesh& mesh, const Tet& t) {
    Vector3 centre = Vector3::Zero();
    for (const std::int32_t n : t) centre += mesh.nodes[n] / 4;
    return centre;
}

/// Tets of a mesh in mm as a .msh file, each of the region that `region_of` gives its centre.
template <class RegionOf>
std::string msh_of(const TetMesh& mesh, RegionOf&& region_of) {
    std::string text =
        fmt::format("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", mesh.nodes.size());
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        text += fmt::format("{} {} {} {}\n", n + 1, mesh.nodes[n].x(), mesh.nodes[n].y(),
                            mesh.nodes[n].z());
    text += fmt::format("$EndNodes\n$Elements\n{}\n", mesh.tets.size());
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        const Tet& t = mesh.tets[e];
        const int region = region_of(centre_of(mesh, t));
        text += fmt::format("{} 4 2 {} {} {} {} {} {}\n", e + 1, region, region, t[0] + 1, t[1] + 1,
                            t[2] + 1, t[3] + 1);
    }
    return text + "$EndElements\n";
}

/// A bar of two materials, its left half 3, its right half 8, as another program would mesh it.
std::string bar_msh() {
    return msh_of(test::block({12, 6, 6}, {120, 60, 60}),
                  [](const Vector3& x) { return x.x() < 60 ? 3 : 8; });
}

TEST(Inputs, TetsOfOthersGetLevelsBelowThem) {
    const Folder folder;
    write_text(folder / "bar.msh", bar_msh());
    const auto outcome = livetet(folder, "mesh bar.msh --levels 3 -o bar.h5");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const MeshHierarchy bar = read_hierarchy(folder / "bar.h5");
    ASSERT_EQ(bar.levels.size(), 3u) << outcome.out;
    EXPECT_EQ(bar.levels.front().tets.size(), 12u * 6 * 6 * 6) << "the file's own";
    for (std::size_t l = 1; l < 3; ++l) {
        const TetMesh& level = bar.levels[l];
        EXPECT_LT(level.tets.size(), bar.levels[l - 1].tets.size() / 3);
        EXPECT_NEAR(volume(level), 0.12 * 0.06 * 0.06, 0.02 * 0.12 * 0.06 * 0.06);
        ASSERT_EQ(level.regions.size(), level.tets.size());
        for (std::size_t e = 0; e < level.tets.size(); ++e) {
            double x = 0;
            for (const std::int32_t n : level.tets[e]) x += level.nodes[n].x() / 4;
            if (std::abs(x - 0.06) > 0.011) {  // farther off than a tet of the file is wide
                EXPECT_EQ(level.regions[e], x < 0.06 ? 3 : 8) << "level " << l << ", x " << x;
            }
        }
    }
    // The scene that names the file may ask for them too, and multigrid has them.
    write_text(folder / "scene.yaml",
               "mesh: {file: bar.msh, levels: 3}\nmaterials: [{region: 3}, {region: 8}]\nfix: "
               "[{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n"
               "gravity_m_per_s2: [0, 0, -9.81]\n");
    const auto solved = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(solved.status, 0) << solved.err;
    EXPECT_NE(solved.out.find(", 3 levels\n"), std::string::npos) << solved.out;
    EXPECT_NE(solved.out.find("mg, 3 levels"), std::string::npos) << solved.out;
    const auto two_ranks = livetet(folder, "solve scene.yaml", "mpirun --oversubscribe -n 2");
    EXPECT_EQ(two_ranks.status, 2);
    EXPECT_NE(two_ranks.err.find("bar.msh: coarser levels are meshed on one rank only"),
              std::string::npos)
        << two_ranks.err;
    // One tet has nothing below it.
    write_text(folder / "two.vtu", two_tets);
    const auto two = livetet(folder, "mesh two.vtu --levels 2 -o two.h5");
    ASSERT_EQ(two.status, 0) << two.err;
    EXPECT_NE(two.err.find("no level below"), std::string::npos) << two.err;
    EXPECT_EQ(read_hierarchy(folder / "two.h5").levels.size(), 1u);
}

TEST(Inputs, TetsThatNoCoarserLevelCanBeMadeOfAreSolvedAllTheSame) {
    // Two bars that meet along an edge: no surface mesher takes such a boundary.
    const Folder folder;
    TetMesh bars = test::block({8, 2, 2}, {80, 20, 20});
    std::erase_if(bars.tets, [&](const Tet& t) {
        const Vector3 x = centre_of(bars, t);
        return (x.y() < 10) != (x.z() < 10);
    });
    write_text(folder / "bars.msh", msh_of(bars, [](const Vector3&) { return 0; }));
    for (const char* kind : {"automatic", "multigrid"}) {
        write_text(folder / "scene.yaml",
                   fmt::format("mesh: {{file: bars.msh, levels: 3}}\nfix: [{{half_space_mm: [1, 0, "
                               "0, 1, 0, 0]}}]\ngravity_m_per_s2: [0, 0, -9.81]\n"
                               "solver: {{kind: {}}}\n",
                               kind));
        const auto solved = livetet(folder, "solve scene.yaml");
        EXPECT_EQ(solved.status, 0) << kind << solved.err;
        EXPECT_NE(solved.err.find("no level below that of the file"), std::string::npos)
            << solved.err;
        EXPECT_NE(solved.out.find(", 1 level\n"), std::string::npos) << solved.out;
        EXPECT_NE(solved.out.find("cg + cholesky"), std::string::npos) << solved.out;
    }
}

TEST(Inputs, AVtuIsTakenWhereAMshIs) {
    const Folder folder;
    write_text(folder / "two.vtu", two_tets);
    ASSERT_EQ(livetet(folder, "mesh two.vtu -o out.h5").status, 0);
    TetMesh mesh = read_hierarchy(folder / "out.h5").levels.front();
    EXPECT_EQ(mesh.regions, (std::vector<std::int32_t>{4, 6}));
    EXPECT_NEAR(volume(mesh), 0.5e-6, 1e-12);
    ASSERT_EQ(livetet(folder, "mesh two.vtu --metres --space lps -o out.h5").status, 0);
    mesh = read_hierarchy(folder / "out.h5").levels.front();
    EXPECT_NEAR(volume(mesh), 500, 1e-6);
    EXPECT_NEAR(mean_node(mesh).x(), -4, 1e-9);
    write_text(folder / "scene.yaml",
               "mesh: {file: two.vtu}\nfix: [{half_space_mm: [0, 0, 0, 0, 0, 1]}]\n"
               "gravity_m_per_s2: [0, 0, -9.81]\n"
               "materials: [{region: 4, young_Pa: 1000}, {region: 6, young_Pa: 2000}]\n");
    const auto outcome = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    write_text(folder / "cut.vtu", two_tets.substr(0, two_tets.size() / 2));
    expect_refused(livetet(folder, "mesh cut.vtu -o gone.h5"), {"cut.vtu"});
    expect_refused(livetet(folder, "mesh two.vtu --threshold 1: -o gone.h5"),
                   {"two.vtu", "--threshold"});
    EXPECT_FALSE(std::filesystem::exists(folder / "gone.h5"));
}

}  // namespace
}  // namespace livetet
