// What users bring: images of other formats, grey images, meshes of other programs.
#include <gtest/gtest.h>

#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "mesh/tet_mesh.hpp"
#include "support/program.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::write_text;

constexpr int n = 24;
constexpr double radius = 9, ball_ml = 4.0 / 3 * 3.14159265358979 * 18 * 18 * 18 / 1000;

/// A ball of radius 18 mm in voxels of 2 mm, whose first voxel lies at RAS (-10, -20, 30): `inside` in it, `outside`
/// round it; in the format's own way of saying so, LPS.
void write_ball(const std::filesystem::path& path, std::int16_t inside, std::int16_t outside) {
    std::string bytes;
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                const bool in = (Vector3(i, j, k) - Vector3::Constant(11.5)).norm() < radius;
                const std::int16_t value = in ? inside : outside;
                bytes.append(reinterpret_cast<const char*>(&value), 2);
            }
    const std::string head =
        path.extension() == ".nrrd"
            ? "NRRD0005\ntype: short\nendian: little\ndimension: 3\nsizes: 24 24 24\nencoding: raw\nspace: "
              "left-posterior-superior\nspace directions: (-2,0,0) (0,-2,0) (0,0,2)\nspace origin: (10,20,30)\n\n"
            : "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nTransformMatrix = -1 "
              "0 0 0 "
              "-1 0 0 0 1\nOffset = 10 20 30\nElementSpacing = 2 2 2\nDimSize = 24 24 24\nElementType = "
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
    EXPECT_LT((1e3 * mean_node(mesh) - Vector3(13, 3, 53)).norm(), 1.5) << "where the header places its centre";
}

TEST(Inputs, LabelMapsOfOtherFormatsAreMeshedInPlaceAndMasksHold) {
    for (const std::string format : {"nrrd", "mha"}) {
        const Folder folder;
        write_ball(folder / ("labels." + format), 3, 0);
        const auto outcome = livetet(folder, "mesh labels." + format + " --labels 3 --fix labels." + format + coarse);
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        expect_ball(folder);
        const TetMesh mesh = read_hierarchy(folder / "out.h5").levels.front();
        EXPECT_GT(mesh.node_sets.at("fixed").size(), mesh.nodes.size() / 10);
        EXPECT_EQ(mesh.regions, std::vector<std::int32_t>(mesh.tets.size(), 3));
        write_text(folder / "scene.yaml",
                   "mesh: {file: out.h5}\nfix: [{mask: labels." + format + "}]\ngravity_m_per_s2: [0, 0, -9.81]\n");
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
    write_text(folder / "scene.yaml", "mesh: {file: ct.nrrd, threshold: \"50:100\", edge_lengths_mm: [9]}\n");
    EXPECT_EQ(livetet(folder, "mesh scene.yaml -o out.h5").status, 0);
    expect_ball(folder);
}

TEST(Inputs, AGreyImageWithoutAThresholdIsToldOfIt) {
    const Folder folder;
    write_ball(folder / "ct.nrrd", 80, -900);
    expect_refused(livetet(folder, "mesh ct.nrrd -o out.h5"), {"ct.nrrd", "-900", "grey", "--threshold LOW:HIGH"});
    GreyImage grey{{2, 2, 1}, Eigen::Matrix4d::Identity(), {0, 0.5f, 1, 2}};
    write_image(folder / "f.nii.gz", grey);
    expect_refused(livetet(folder, "mesh f.nii.gz --labels 1 -o out.h5"), {"f.nii.gz", "0.5", "--threshold"});
    LabelImage many{{300, 2, 1}, Eigen::Matrix4d::Identity(), {}};
    for (int v = 0; v < 600; ++v) many.values.push_back(v / 2);
    write_image(folder / "many.nii.gz", many);
    expect_refused(livetet(folder, "mesh many.nii.gz -o out.h5"), {"200 different values", "--threshold", "--labels"});
    expect_refused(livetet(folder, "mesh ct.nrrd --threshold 500:600 -o out.h5"), {"ct.nrrd", "500:600", "-900", "80"});
    expect_refused(livetet(folder, "mesh ct.nrrd --threshold 5: --labels 1 -o out.h5"), {"labels", "threshold"});
    for (const std::string wrong : {"100", ":", "9:3", "a:b", "1:2:3", "nan:"})
        expect_refused(livetet(folder, "mesh ct.nrrd --threshold " + wrong + " -o out.h5"),
                       {"threshold", wrong, "LOW:HIGH"});
    write_text(folder / "scene.yaml", "mesh: {file: ct.nrrd, threshold: \"9:3\"}\n");
    expect_refused(livetet(folder, "mesh scene.yaml -o out.h5"), {"threshold", "9:3", "LOW:HIGH", "scene.yaml:1"});
    EXPECT_FALSE(std::filesystem::exists(folder / "out.h5"));
}

TEST(Inputs, ADamagedImageSaysSoInOneLine) {
    const Folder folder;
    write_ball(folder / "whole.mha", 1, 0);
    const std::string whole = test::text_of(folder / "whole.mha");
    write_text(folder / "cut.mha", whole.substr(0, whole.size() / 2));
    expect_refused(livetet(folder, "mesh cut.mha -o out.h5"), {"cut.mha", "truncated"});
    expect_refused(livetet(folder, "mesh whole.mha --fix cut.mha" + coarse), {"cut.mha", "truncated"});
    EXPECT_FALSE(std::filesystem::exists(folder / "out.h5"));
}

/// A pyramid stack: five points, two tets of regions 4 and 6; lengths in mm, or in whatever unit is told.
const std::string two_tets =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
    "<UnstructuredGrid><Piece NumberOfPoints=\"5\" NumberOfCells=\"2\"><Points><DataArray type=\"Float64\" "
    "NumberOfComponents=\"3\" format=\"ascii\">0 0 0  10 0 0  0 10 0  0 0 10  10 10 10</DataArray></Points>\n"
    "<Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3  1 2 3 4</DataArray>\n"
    "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4 8</DataArray>\n"
    "<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10 10</DataArray></Cells>\n<CellData>"
    "<DataArray type=\"Int32\" Name=\"region\" format=\"ascii\">4 6</DataArray></CellData>\n"
    "</Piece></UnstructuredGrid></VTKFile>\n";

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
               "mesh: {file: two.vtu}\nfix: [{nodes: [0, 1, 2]}]\ngravity_m_per_s2: [0, 0, -9.81]\n"
               "materials: [{region: 4, young_Pa: 1000}, {region: 6, young_Pa: 2000}]\n");
    const auto outcome = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    write_text(folder / "cut.vtu", two_tets.substr(0, two_tets.size() / 2));
    expect_refused(livetet(folder, "mesh cut.vtu -o gone.h5"), {"cut.vtu"});
    expect_refused(livetet(folder, "mesh two.vtu --threshold 1: -o gone.h5"), {"two.vtu", "--threshold"});
    EXPECT_FALSE(std::filesystem::exists(folder / "gone.h5"));
}

}  // namespace
}  // namespace livetet
