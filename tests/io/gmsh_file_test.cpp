#include "io/gmsh_file.hpp"

#include <Eigen/Geometry>

#include <numeric>

#include "base/file.hpp"
#include "files.hpp"
#include "mesh/hex_grid.hpp"
#include "meshes.hpp"

namespace livetet {
namespace {

using namespace testing_files;
using namespace testing_meshes;

/// One tet in mm with sparse, unordered tags, an unused node and an unnamed surface wound inwards.
const std::string small = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
0 9 "tip"
$EndPhysicalNames
$Nodes
5
70 0 0 10
3 0 0 0
1000 10 0 0
12 5 5 5
40 0 10 0
$EndNodes
$Elements
3
5 15 2 9 1 70
8 2 2 3 1 3 1000 40
2 4 2 6 1 3 1000 40 70
$EndElements
)";

std::string with(std::string text, const std::string& from, const std::string& to) {
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
}

TetMesh read_gmsh_text(const std::string& text) {
    return read_gmsh(write_bytes(fresh_folder() / "m.msh", text), 1e-3);
}

/// Two boxes of 10 x 20 x 30 mm in groups 6 and 7, with a named face.
const std::string boxes = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
2 9 "end"
$EndPhysicalNames
$Nodes
12
1 0 0 0
2 10 0 0
3 20 0 0
4 0 20 0
5 10 20 0
6 20 20 0
7 0 0 30
8 10 0 30
9 20 0 30
10 0 20 30
11 10 20 30
12 20 20 30
$EndNodes
$Elements
3
1 3 2 9 1 1 4 10 7
2 5 2 6 1 1 2 5 4 7 8 11 10
3 5 2 7 2 2 3 6 5 8 9 12 11
$EndElements
)";

TEST(GmshFile, AGridOfHexahedraIsRead) {
    const TetMesh mesh = read_gmsh_text(boxes);
    ASSERT_EQ(mesh.hexahedra.size(), 2u);
    EXPECT_EQ(hex_level_of(mesh, "boxes").links.size(), 1u);
    EXPECT_NEAR(volume(mesh), 2 * 6e-6, 1e-15);
    ASSERT_EQ(mesh.regions.size(), 12u);
    EXPECT_EQ(mesh.regions.front(), 6);
    EXPECT_EQ(mesh.regions.back(), 7);
    EXPECT_TRUE(mesh.triangle_sets.empty());
    const auto& end = mesh.node_sets.at("end");
    ASSERT_EQ(end.size(), 4u);
    for (const std::int32_t n : end) EXPECT_EQ(mesh.nodes[n].x(), 0);
    EXPECT_NE(error_of([] {
                  read_gmsh_text(with(boxes, "1 2 5 4 7 8 11 10", "1 2 5 4 1 2 5 4"));
              }).find("expected a positive one"),
              std::string::npos);
    EXPECT_NE(error_of([] {
                  read_gmsh_text(with(boxes, "3 5 2 7 2 2 3 6 5 8 9 12 11", "3 4 2 7 2 2 3 6 9"));
              }).find("expected hexahedra of 8 nodes, as others are in this file"),
              std::string::npos);
}

TEST(GmshFile, HexahedraThatAreNoGridGetMiddleNodes) {
    const TetMesh mesh = read_gmsh_text(with(boxes, "12 20 20 30", "12 20 20 33"));
    EXPECT_TRUE(mesh.hexahedra.empty());
    ASSERT_EQ(mesh.quadratic_hexahedra.size(), 2u);
    EXPECT_EQ(mesh.nodes.size(), 45u);
    ASSERT_EQ(mesh.regions.size(), 2 * tets_per_quadratic_hexahedron);
    EXPECT_EQ(mesh.regions.front(), 6);
    EXPECT_EQ(mesh.regions.back(), 7);
    EXPECT_EQ(mesh.node_sets.at("end").size(), 9u);
    EXPECT_EQ(mesh.triangle_sets.at("end").size(), 8u);
    EXPECT_NEAR(volume(mesh), 2 * 6e-6 + 1e-2 * 2e-2 * 3e-3 / 4, 1e-12);
}

/// Gmsh's order of nodes: corners, edges, faces, the middle.
TEST(GmshFile, BentHexahedraOf20And27NodesAreRead) {
    constexpr int edges[12][2] = {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3},
                                  {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}};
    constexpr int faces[6][4] = {{0, 3, 2, 1}, {0, 1, 5, 4}, {0, 4, 7, 3},
                                 {1, 2, 6, 5}, {2, 3, 7, 6}, {4, 5, 6, 7}};
    const std::vector<Vector3> at = places_of_27(edges, faces);
    for (const int nodes : {20, 27}) {
        std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
        text += fmt::format("$Nodes\n{}\n", nodes);
        std::string element = fmt::format("1 {} 2 3 3", nodes == 20 ? 17 : 12);
        for (int n = 0; n < nodes; ++n) {
            const Vector3 x = bent(at[n]);
            text += fmt::format("{} {} {} {}\n", n + 1, x.x(), x.y(), x.z());
            element += fmt::format(" {}", n + 1);
        }
        text += "$EndNodes\n$Elements\n1\n" + element + "\n$EndElements\n";
        const TetMesh mesh = read_gmsh_text(text);
        expect_bent_cell(mesh);
    }
}

TEST(GmshFile, SparseTagsUnusedNodesAndUnitsAreUndone) {
    const TetMesh mesh = read_gmsh_text(small);
    ASSERT_EQ(mesh.nodes.size(), 4u);
    ASSERT_EQ(mesh.tets.size(), 1u);
    EXPECT_NEAR(volume(mesh), 1e-6 / 6, 1e-18);
    EXPECT_EQ(mesh.regions, std::vector<std::int32_t>{6});
    ASSERT_EQ(mesh.node_sets.at("tip").size(), 1u);
    EXPECT_LT((mesh.nodes[mesh.node_sets.at("tip")[0]] - Vector3(0, 0, 0.010)).norm(), 1e-15);
    EXPECT_EQ(mesh.node_sets.at("surface_3").size(), 3u);
}

TEST(GmshFile, PhysicalSurfacesAreWoundOutwards) {
    const TetMesh mesh = read_gmsh_text(small);  // the file's triangle is wound inwards
    const Triangle t = mesh.triangle_sets.at("surface_3").at(0);
    const Vector3 normal =
        (mesh.nodes[t[1]] - mesh.nodes[t[0]]).cross(mesh.nodes[t[2]] - mesh.nodes[t[0]]);
    EXPECT_LT(normal.z(), 0);
}

TEST(GmshFile, WhatIsWrittenIsReadBack) {
    const auto path = fresh_folder() / "m.msh";
    TetMesh mesh = cube();
    mesh.node_sets.erase("a/b.%2f");
    mesh.node_sets["corner"] = {5, 7};
    write_gmsh(path, mesh, 1e-3);
    const TetMesh back = read_gmsh(path, 1e-3);
    EXPECT_EQ(back.tets.size(), 6u);
    EXPECT_NEAR(volume(back), 1e-6, 1e-18);
    EXPECT_EQ(std::accumulate(back.regions.begin(), back.regions.end(), 0), 9);
    for (const auto& [name, height] : {std::pair{"bottom", 0.0}, {"corner", 0.01}}) {
        ASSERT_EQ(back.node_sets.at(name).size(), mesh.node_sets[name].size());
        for (const auto n : back.node_sets.at(name)) EXPECT_NEAR(back.nodes[n].z(), height, 1e-15);
    }
    EXPECT_EQ(back.triangle_sets.at("bottom").size(), 2u);
}

TEST(GmshFile, MalformedMeshesAreRefused) {
    const auto refuses = [](const std::string& text, std::initializer_list<const char*> words) {
        EXPECT_TRUE(says(error_of([&] { read_gmsh_text(text); }), words)) << text;
    };
    refuses("", {"m.msh:1", "expected $MeshFormat"});
    refuses("SystemCall \"true\";\nPoint(1) = {0,0,0};\n",
            {"m.msh:1", "SystemCall", "expected $MeshFormat"});
    refuses(with(small, "2.2 0 8", "3.7 0 8"), {"m.msh:2", "'3.7'", "2.2"});
    refuses(with(small, "2 4 2 6 1 3 1000 40 70", "2 4 2 6 1 3 40 1000 70"), {"tet 0", "inverted"});
    refuses(with(small, "2 4 2 6 1 3 1000 40 70", "2 2 2 3 1 3 1000 40"), {"no tetrahedra"});
    refuses(with(small, "3 1000 40 70", "3 1000 40 71"), {"m.msh"});
    refuses(with(small, "0 0 10", "0 0 nan"), {"m.msh"});
    refuses(with(small, "5 15 2 9 1 70", "5 15 2 9 1 12"), {"'tip'", "no node"});
    refuses(with(small, "2 4 2 6 1 3 1000 40 70", "2 6 2 6 1 3 1000 40 70 12 12"),
            {"type Prism", "4-node tetrahedra"});
    refuses(with(small, "2 4 2 6 1 3 1000 40 70", "2 11 2 6 1 3 1000 40 70 12 12 12 12 12 12"),
            {"Tetrahedron", "order 2"});
}

TEST(GmshFile, WhatGmshsReaderDoesNotSurviveIsAnError) {
    // The file announces seven partitions and has two.
    const std::string partitioned =
        with(small, "2 4 2 6 1 3 1000 40 70", "2 4 5 6 1 7 4 2 3 1000 40 70");
    EXPECT_TRUE(says(error_of([&] { read_gmsh_text(partitioned); }), {"m.msh", "Gmsh crashed"}));
}

TEST(GmshFile, TruncationIsAnError) {
    for (std::size_t n = 0; n + 2 < small.size(); n += 5)
        EXPECT_TRUE(says(error_of([&] { read_gmsh_text(small.substr(0, n)); }), {"m.msh"})) << n;
}

TEST(GmshFile, WrongNamesAreErrors) {
    EXPECT_TRUE(says(error_of([] { read_gmsh(fresh_folder() / "a.geo", 1); }), {"'.geo'", ".msh"}));
    EXPECT_TRUE(
        says(error_of([] { read_gmsh(fresh_folder() / "a.msh", 1); }), {"a.msh", "no such file"}));
}

TEST(GmshFile, RealMeshesOfBothVersionsAreTheSameBody) {
    LIVETET_DATA_OR_SKIP(data);
    // Two meshes of one shape with curved walls, without physical groups.
    const TetMesh ascii = read_gmsh(data / "meshes" / "mfem_piece.asc.v41.msh", 1);
    const TetMesh binary = read_gmsh(data / "meshes" / "mfem_piece.bin.v22.msh", 1);
    EXPECT_EQ(ascii.tets.size(), 13370u);
    EXPECT_EQ(binary.tets.size(), 13179u);
    EXPECT_NEAR(volume(ascii), volume(binary), 1e-3 * volume(ascii));
    EXPECT_TRUE(ascii.regions.empty() && ascii.triangle_sets.empty());
}

TEST(GmshFile, Msh41WithNamedGroupsIsRead) {
    // A tet with unit edges: volume 1 in group 4, its face z = 0 in the group "wall".
    const TetMesh mesh = read_gmsh_text(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n2\n2 2 \"wall\"\n3 4 "
        "\"body\"\n$EndPhysicalNames\n"
        "$Entities\n0 0 1 1\n5 0 0 0 1 1 0 1 2 0\n1 0 0 0 1 1 1 1 4 1 5\n$EndEntities\n"
        "$Nodes\n1 4 10 13\n3 1 0 4\n10\n11\n12\n13\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n"
        "$Elements\n2 2 1 2\n2 5 2 1\n1 10 11 12\n3 1 4 1\n2 10 11 12 13\n$EndElements\n");
    EXPECT_NEAR(volume(mesh), 1e-9 / 6, 1e-21);
    EXPECT_EQ(mesh.regions, std::vector<std::int32_t>{4});
    EXPECT_EQ(mesh.triangle_sets.at("wall").size(), 1u);
    EXPECT_EQ(mesh.node_sets.at("wall").size(), 3u);
}

TEST(GmshFile, ATruncatedRealBinaryMeshIsAnError) {
    LIVETET_DATA_OR_SKIP(data);
    const std::string whole = read_text_file(data / "meshes" / "mfem_piece.bin.v22.msh");
    for (const double part : {0.01, 0.2, 0.6, 0.99})
        EXPECT_FALSE(
            error_of([&] { read_gmsh_text(whole.substr(0, whole.size() * part)); }).empty())
            << part;
}

}  // namespace
}  // namespace livetet
