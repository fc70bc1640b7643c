#include "io/vtu_file.hpp"

#include <fmt/format.h>

#include <cmath>

#include "base/file.hpp"
#include "files.hpp"
#include "mesh/hex_grid.hpp"
#include "meshes.hpp"

namespace livetet {
namespace {

using namespace testing_files;
using namespace testing_meshes;

/// A text file, in mm: two tets with a common face, a triangle of their surface, and an unused
/// point.
struct Grid {
    std::string connectivity = "0 1 2 3  1 2 3 4  0 1 2", offsets = "4 8 11", types = "10 10 5";
    std::string array =
        "<DataArray type=\"Int32\" Name=\"region\" format=\"ascii\">7 9 0</DataArray>";
    int cells = 3;

    std::string text() const {
        return "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" "
               "byte_order=\"LittleEndian\">\n"
               "<UnstructuredGrid><Piece NumberOfPoints=\"6\" NumberOfCells=\"" +
               std::to_string(cells) +
               "\">\n<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
               "format=\"ascii\">\n"
               "0 0 0  10 0 0  0 10 0  0 0 10  10 10 10  50 50 50\n</DataArray></Points>\n"
               "<Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">" +
               connectivity +
               "</DataArray>\n<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">" +
               offsets +
               "</DataArray>\n<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">" + types +
               "</DataArray></Cells>\n<CellData>" + array +
               "</CellData>\n</Piece></UnstructuredGrid></VTKFile>\n";
    }
};

TetMesh read(const std::string& text) {
    static int count = 0;
    return read_vtu(write_bytes(fresh_folder() / ("m" + std::to_string(count++) + ".vtu"), text),
                    1e-3);
}

TEST(VtuFile, TetsAndRegionsAreRead) {
    const TetMesh mesh = read(Grid{}.text());
    ASSERT_EQ(mesh.tets.size(), 2u);
    EXPECT_EQ(mesh.nodes.size(), 5u) << "the point of no tet is left out";
    EXPECT_EQ(mesh.regions, (std::vector<std::int32_t>{7, 9}));
    EXPECT_NEAR(volume(mesh), 1e-9 * (1000.0 / 6 + 2 * 1000.0 / 6), 1e-18);
    EXPECT_LT((mesh.nodes[4] - Vector3(0.01, 0.01, 0.01)).norm(), 1e-15);
}

/// Two boxes of 10 x 20 x 30 mm, a hexahedron that begins with another corner and a voxel.
struct BoxGrid {
    std::string points =
        "0 0 0  10 0 0  20 0 0  0 20 0  10 20 0  20 20 0 "
        "0 0 30  10 0 30  20 0 30  0 20 30  10 20 30  20 20 30";
    std::string connectivity = "1 4 3 0 7 10 9 6  1 2 4 5 7 8 10 11";
    std::string text() const {
        return "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" "
               "byte_order=\"LittleEndian\">\n"
               "<UnstructuredGrid><Piece NumberOfPoints=\"12\" NumberOfCells=\"2\">\n"
               "<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">" +
               points +
               "</DataArray></Points>\n"
               "<Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">" +
               connectivity +
               "</DataArray>\n<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">8 16"
               "</DataArray>\n<DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">12 11"
               "</DataArray></Cells>\n<CellData><DataArray type=\"Int32\" Name=\"region\" "
               "format=\"ascii\">7 9</DataArray></CellData>\n</Piece></UnstructuredGrid></VTKFile>"
               "\n";
    }
};

TEST(VtuFile, AGridOfHexahedraAndVoxelsIsRead) {
    const TetMesh mesh = read(BoxGrid{}.text());
    ASSERT_EQ(mesh.hexahedra.size(), 2u);
    EXPECT_EQ(mesh.nodes.size(), 12u);
    EXPECT_EQ(mesh.shares, (std::vector<double>{1, 1}));
    ASSERT_EQ(mesh.regions.size(), 12u);
    EXPECT_EQ(mesh.regions.front(), 7);
    EXPECT_EQ(mesh.regions.back(), 9);
    EXPECT_NEAR(volume(mesh), 2 * 6e-6, 1e-15);
    const HexLevel level = hex_level_of(mesh, "grid");
    ASSERT_EQ(level.links.size(), 1u) << "they share a face";
    for (const Hexahedron& cell : mesh.hexahedra)  // all along the same axes
        for (int c = 0; c < 8; ++c) {
            Vector3 offset = mesh.nodes[cell[c]] - mesh.nodes[cell[0]];
            for (int d = 0; d < 3; ++d)
                EXPECT_EQ(std::abs(offset.dot(mesh.nodes[cell[1 << d]] - mesh.nodes[cell[0]])) > 0,
                          (c >> d & 1) == 1);
        }
}

/// A row of 300 cells of 0.7 mm far from the origin, whose points are rounded to single precision.
TEST(VtuFile, AGridInSinglePrecisionIsRead) {
    BoxGrid row;
    row.points.clear();
    row.connectivity.clear();
    std::string offsets, types, regions;
    constexpr int cells = 300;
    for (int i = 0; i <= cells; ++i)
        for (int k = 0; k < 4; ++k)
            row.points += fmt::format("{} {} {} ", static_cast<float>(-123.4 + 0.7 * i),
                                      static_cast<float>(-87.3 + 0.7 * (k & 1)),
                                      static_cast<float>(55.1 + 0.7 * (k >> 1)));
    for (int i = 0; i < cells; ++i) {
        const int a = 4 * i, b = a + 4;
        row.connectivity +=
            fmt::format("{} {} {} {} {} {} {} {} ", a, b, b + 1, a + 1, a + 2, b + 2, b + 3, a + 3);
        offsets += fmt::format("{} ", 8 * (i + 1));
        types += "12 ";
        regions += "1 ";
    }
    const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
        return text.replace(text.find(from), from.size(), to);
    };
    std::string text =
        replaced(row.text(), "NumberOfPoints=\"12\" NumberOfCells=\"2\"",
                 fmt::format("NumberOfPoints=\"{}\" NumberOfCells=\"{}\"", 4 * (cells + 1), cells));
    text = replaced(text, ">8 16<", ">" + offsets + "<");
    text = replaced(text, ">12 11<", ">" + types + "<");
    const TetMesh mesh = read(replaced(text, ">7 9<", ">" + regions + "<"));
    EXPECT_EQ(hex_level_of(mesh, "row").links.size(), cells - 1U);
    EXPECT_NEAR(volume(mesh), cells * std::pow(0.7e-3, 3), 1e-5 * volume(mesh));
}

/// VTK's order of nodes: corners, edges, faces, the middle.
TEST(VtuFile, BentHexahedraOf20And27NodesAreRead) {
    constexpr int edges[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                  {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
    constexpr int faces[6][4] = {{0, 4, 7, 3}, {1, 2, 6, 5}, {0, 1, 5, 4},
                                 {3, 7, 6, 2}, {0, 3, 2, 1}, {4, 5, 6, 7}};
    const std::vector<Vector3> at = places_of_27(edges, faces);
    for (const int nodes : {20, 27}) {
        std::string points, numbers;
        for (int n = 0; n < nodes; ++n) {
            const Vector3 x = bent(at[n]);
            points += fmt::format("{} {} {} ", x.x(), x.y(), x.z());
            numbers += fmt::format("{} ", n);
        }
        const TetMesh mesh = read(fmt::format(
            R"(<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
<UnstructuredGrid><Piece NumberOfPoints="{0}" NumberOfCells="1">
<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">{1}</DataArray></Points>
<Cells><DataArray type="Int64" Name="connectivity" format="ascii">{2}</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">{0}</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">{3}</DataArray></Cells>
</Piece></UnstructuredGrid></VTKFile>
)",
            nodes, points, numbers, nodes == 20 ? 25 : 29));
        expect_bent_cell(mesh);
    }
}

TEST(VtuFile, HexahedraThatAreNoGridGetMiddleNodes) {
    for (const char* corner : {"20 21 30", "20 20 31"}) {
        BoxGrid grid;
        grid.points.replace(grid.points.find("20 20 30"), 8, corner);
        const TetMesh mesh = read(grid.text());
        EXPECT_TRUE(mesh.hexahedra.empty());
        ASSERT_EQ(mesh.quadratic_hexahedra.size(), 2u);
        EXPECT_EQ(mesh.nodes.size(), 45u);
        EXPECT_EQ(mesh.regions.front(), 7);
        EXPECT_EQ(mesh.regions.back(), 9);
    }
}

TEST(VtuFile, HexahedraOfNoMeshAreRefused) {
    const auto refused = [](const std::string& from, const std::string& to,
                            const std::string& expected) {
        BoxGrid grid;
        std::string& text =
            grid.points.find(from) != std::string::npos ? grid.points : grid.connectivity;
        text.replace(text.find(from), from.size(), to);
        EXPECT_NE(error_of([&] { read(grid.text()); }).find(expected), std::string::npos)
            << error_of([&] { read(grid.text()); });
    };
    refused("20 20 30", "20 20 -5", "hexahedron 1 is flat or turned over at (20, 20,");
    refused("1 4 3 0 7 10 9 6", "7 10 9 6 1 4 3 0", "expected a positive one");  // inside out
    refused("1 4 3 0 7 10 9 6", "1 4 3 0 1 4 3 0", "expected a positive one");   // flat
    refused("1 2 4 5 7 8 10 11", "0 1 3 4 6 7 9 10", "two hexahedra are at one place");
    Grid mixed;
    mixed.types = "10 10 12";
    EXPECT_NE(error_of([&] { read(mixed.text()); }).find("expected"), std::string::npos);
}

TEST(VtuFile, RegionArraysHaveSeveralNames) {
    for (const char* name : {"gmsh:physical", "medit:ref", "Label", "CellEntityIds"}) {
        Grid grid;
        grid.array.replace(grid.array.find("region"), 6, name);
        EXPECT_EQ(read(grid.text()).regions, (std::vector<std::int32_t>{7, 9})) << name;
    }
    Grid grid;
    grid.array.replace(grid.array.find("region"), 6, "quality");
    EXPECT_TRUE(read(grid.text()).regions.empty());
    grid.array = "<DataArray type=\"Float32\" Name=\"region\" format=\"ascii\">7 9.5 0</DataArray>";
    EXPECT_TRUE(says(error_of([&] { read(grid.text()); }),
                     {".vtu", "'region' of cell 1 is 9.5", "whole number"}));
}

TEST(VtuFile, OtherCellsThatFillSpaceAreCounted) {
    Grid hexahedron;
    hexahedron.connectivity = "0 1 2 3  0 1 2 3 4 5 0 1  0 1 2 3 4 5";
    hexahedron.offsets = "4 12 18";
    hexahedron.types = "10 12 13";
    EXPECT_TRUE(says(error_of([&] { read(hexahedron.text()); }),
                     {"1 vtkHexahedron", "1 vtkWedge", "1 vtkTetra", "four-node"}));
    Grid quadratic;
    quadratic.cells = 1;
    quadratic.connectivity = "0 1 2 3 4 5 0 1 2 3";
    quadratic.offsets = "10";
    quadratic.types = "24";
    quadratic.array.clear();
    EXPECT_TRUE(
        says(error_of([&] { read(quadratic.text()); }), {"1 vtkQuadraticTetra", "linear", "P2"}));
}

TEST(VtuFile, DamagedFilesAreErrors) {
    const auto refuses = [](const Grid& grid, std::initializer_list<const char*> words) {
        const std::string error = error_of([&] { read(grid.text()); });
        EXPECT_TRUE(says(error, {".vtu"}));
        EXPECT_TRUE(says(error, words));
    };
    Grid inverted;
    inverted.connectivity = "0 2 1 3  1 2 3 4  0 1 2";
    refuses(inverted, {"inverted"});
    Grid absent;
    absent.connectivity = "0 1 2 300  1 2 3 4  0 1 2";
    refuses(absent, {"300"});
    Grid flat;
    flat.cells = 1;
    flat.connectivity = "0 1 2";
    flat.offsets = "3";
    flat.types = "5";
    flat.array.clear();
    refuses(flat, {"no tet"});
    Grid beyond;
    beyond.offsets = "4 8 110000";
    refuses(beyond, {});
    Grid backwards;
    backwards.offsets = "4 -8 11";
    refuses(backwards, {});
    Grid few;
    few.types = "10 10";
    refuses(few, {});
    const std::string whole = Grid{}.text();
    for (std::size_t n = 0; n < whole.size() - 3; n += 3)
        EXPECT_TRUE(says(error_of([&] { read(whole.substr(0, n)); }), {".vtu"})) << n;
    EXPECT_TRUE(says(error_of([] { read_vtu(fresh_folder() / "a.vtp", 1); }), {"'.vtp'", ".vtu"}));
    EXPECT_TRUE(
        says(error_of([] { read_vtu(fresh_folder() / "a.vtu", 1); }), {"a.vtu", "no such file"}));
}

TEST(VtuFile, HostileCountsAreErrors) {
    testing::internal::CaptureStderr();
    std::string text = Grid{}.text();
    text.replace(text.find("NumberOfPoints=\"6\""), 18, "NumberOfPoints=\"600000000000\"");
    EXPECT_TRUE(says(error_of([&] { read(text); }), {".vtu"}));
    text = Grid{}.text();
    text.replace(text.find("NumberOfCells=\"3\""), 17, "NumberOfCells=\"300000000000\"");
    EXPECT_TRUE(says(error_of([&] { read(text); }), {".vtu"}));
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << "the error is all there is to say";
}

TEST(VtuFile, AFileThatVtkDoesNotEndOnIsAnErrorWithinItsTime) {
    std::string text = Grid{}.text();
    text.replace(text.find("NumberOfComponents=\"3\""), 22, "NumberOfComponents=\"4294967296\"");
    EXPECT_TRUE(
        says(error_of([&] { read(text); }), {".vtu", "VTK took more processor time than it may"}));
}

}  // namespace
}  // namespace livetet
