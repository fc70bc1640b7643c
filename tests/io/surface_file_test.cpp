#include "io/surface_file.hpp"

#include <Eigen/Geometry>

#include "base/file.hpp"
#include "files.hpp"
#include "meshes.hpp"

namespace livetet {
namespace {

using namespace testing_files;

double enclosed_volume(const TriangleMesh& s) {
    double sum = 0;
    for (const Triangle& t : s.triangles)
        sum += s.nodes[t[0]].dot(s.nodes[t[1]].cross(s.nodes[t[2]])) / 6;
    return sum;
}

TriangleMesh cube_surface() {
    const TetMesh cube = testing_meshes::cube();
    return {cube.nodes, boundary_triangles(cube.tets)};
}

TEST(SurfaceFile, SurfacesComeBackInMetresWithSharedNodes) {
    const auto folder = fresh_folder();
    for (const char* name : {"a.stl", "a.vtk", "a.ply"})
        for (const Space space : {Space::ras, Space::lps}) {
            write_surface(folder / name, cube_surface(), space);
            const TriangleMesh back = read_surface(folder / name, space);
            EXPECT_EQ(back.nodes.size(), 8u) << name;
            EXPECT_EQ(back.triangles.size(), 12u) << name;
            EXPECT_NEAR(enclosed_volume(back), 1e-6, 1e-11) << name;
        }
}

TEST(SurfaceFile, LpsIsTurnedRoundTheVerticalAxis) {
    const std::string off = "OFF # a comment\n3 1 0\n0 0 0\n10 0 0\n0 20 5\n3 0 1 2\n";
    const auto path = write_bytes(fresh_folder() / "a.off", off);
    EXPECT_LT((read_surface(path, Space::ras).nodes[2] - Vector3(0, 0.020, 0.005)).norm(), 1e-15);
    EXPECT_LT((read_surface(path, Space::lps).nodes[2] - Vector3(0, -0.020, 0.005)).norm(), 1e-15);
    EXPECT_LT((read_surface(path, Space::lps).nodes[1] - Vector3(-0.010, 0, 0)).norm(), 1e-15);
}

TEST(SurfaceFile, PolygonsAreCutAndStrayPointsLeftOut) {
    const auto folder = fresh_folder();
    write_bytes(folder / "a.obj", "v 0 0 0\nv 9 9 9\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 3 4 5\n");
    EXPECT_EQ(read_surface(folder / "a.obj", Space::ras).nodes.size(), 4u);
    EXPECT_EQ(read_surface(folder / "a.obj", Space::ras).triangles.size(), 2u);
    write_bytes(folder / "a.off",
                "OFF\n5 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 -0\n4 0 1 2 3\n3 0 4 1\n");
    EXPECT_EQ(read_surface(folder / "a.off", Space::ras).triangles.size(), 2u)
        << "a collapsed triangle is none";
}

const std::string vtp =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
    "byte_order=\"LittleEndian\"><PolyData>\n"
    "<Piece NumberOfPoints=\"4\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
    "NumberOfPolys=\"4\">\n"
    "<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 10 0 0 0 "
    "10 0 0 0 "
    "10</DataArray>"
    "</Points>\n<Polys><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 2 1 0 1 "
    "3 1 2 3 0 3 "
    "2</DataArray>"
    "<DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">3 6 9 12</DataArray></Polys>\n"
    "</Piece></PolyData></VTKFile>\n";

TEST(SurfaceFile, VtksXmlSurfacesAreReadWholeOrNotAtAll) {
    const auto path = write_bytes(fresh_folder() / "a.vtp", vtp);
    EXPECT_NEAR(enclosed_volume(read_surface(path, Space::ras)), 1e-6 / 6, 1e-15);
    for (std::size_t n = 0; n < vtp.size() - 3; n += 3) {
        write_bytes(path, vtp.substr(0, n));
        EXPECT_TRUE(says(error_of([&] { read_surface(path, Space::ras); }), {"a.vtp"})) << n;
    }
    std::string absent = vtp;
    write_bytes(path, absent.replace(absent.find("0 3 2<"), 5, "0 3 9"));
    EXPECT_TRUE(says(error_of([&] { read_surface(path, Space::ras); }), {"a.vtp", "9"}));
}

TEST(SurfaceFile, MalformedSurfacesAreErrors) {
    const auto folder = fresh_folder();
    const auto refuses = [&](const char* name, const std::string& text,
                             std::initializer_list<const char*> words) {
        write_bytes(folder / name, text);
        EXPECT_TRUE(says(error_of([&] { read_surface(folder / name, Space::ras); }), words))
            << name << "\n"
            << text;
    };
    refuses("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 nan\n3 0 1 2\n",
            {"a.off", "point 2", "finite"});
    refuses("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", {"a.off", "found 3", "below 3"});
    refuses("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1\n", {"a.off", "truncated"});
    refuses("a.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", {"no triangle"});
    refuses("a.off", "OFF\n-3 1 0\n", {"found -3"});
    refuses("a.off", "PLY\n", {"OFF"});
    refuses("a.obj", "v 0 0 0\n", {"a.obj"});
    refuses("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n", {"a.obj"});
    refuses("a.vtk", "nothing of VTK's", {"a.vtk"});
    refuses("a.ply", "nothing of PLY's", {"a.ply"});
    refuses("a.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n",
            {"a.stl", "truncated"});
    refuses("a.stl", "short", {"a.stl", "truncated"});
    refuses("a.stl", "solid a\nendsolid a\n", {"a.stl", "no facet"});
    refuses("a.step", "x", {"'.step'", ".stl"});
    EXPECT_TRUE(says(error_of([&] { read_surface(folder / "none.stl", Space::ras); }),
                     {"none.stl", "no such file"}));
    EXPECT_TRUE(says(error_of([&] { write_surface(folder / "a.x", cube_surface(), Space::ras); }),
                     {"'.x'"}));
}

TEST(SurfaceFile, WhatVtksReadersDoNotSurviveIsAnError) {
    const auto folder = fresh_folder();
    const auto error = [&](const char* name, const std::string& text) {
        write_bytes(folder / name, text);
        return error_of([&] { read_surface(folder / name, Space::ras); });
    };
    EXPECT_TRUE(says(error("a.obj", "f 1 2 3 4\n"), {"a.obj", "names point 0"}));
    EXPECT_TRUE(says(error("a.ply", "ply\nformat ascii 1.0\nelement\nend_header\n"),
                     {"a.ply:3", "PLY header"}));
    EXPECT_TRUE(says(error("a.ply", "ply\nformat ascii 1.0\nend_header\n"), {"a.ply"}));
    const std::string triangle =
        "# vtk DataFile Version 5.1\n-\nASCII\nDATASET POLYDATA\nPOINTS 3 double\n0 0 0 1 0 0 0 1 "
        "0\nPOLYGONS 2 3\n"
        "OFFSETS vtktypeint64\n0 3\nCONNECTIVITY vtktypeint64\n0 1 2\n";
    EXPECT_EQ(error("a.vtk", triangle), "");
    for (const char* end : {"4611686018427387904", "1000000000000", "4", "-3"}) {
        std::string changed = triangle;
        changed.replace(changed.find("0 3\n"), 3, std::string("0 ") + end);
        EXPECT_TRUE(says(error("a.vtk", changed), {"a.vtk", "offsets"})) << end;
    }
}

TEST(SurfaceFile, ATruncatedPlyIsAnError) {
    const auto folder = fresh_folder();
    for (const double part : {0.2, 0.5, 0.6, 0.7, 0.8, 0.9, 0.97, 0.999}) {
        write_surface(folder / "a.ply", cube_surface(), Space::ras);
        truncate_to(folder / "a.ply", part);
        EXPECT_TRUE(says(error_of([&] { read_surface(folder / "a.ply", Space::ras); }),
                         {"a.ply", "truncated"}));
    }
    const std::string ascii =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 "
        "0\n3 0 1 2\n";
    const auto path = write_bytes(folder / "b.ply", ascii);
    EXPECT_EQ(read_surface(path, Space::ras).triangles.size(), 1u);
    for (std::size_t n = 0; n < ascii.size() - 2; n += 2) {
        write_bytes(path, ascii.substr(0, n));
        EXPECT_TRUE(says(error_of([&] { read_surface(path, Space::ras); }), {"b.ply"})) << n;
    }
}

TEST(SurfaceFile, ATruncatedStlIsAnError) {
    const auto path = fresh_folder() / "a.stl";
    write_surface(path, cube_surface(), Space::ras);
    truncate_to(path, 0.9);
    EXPECT_TRUE(says(error_of([&] { read_surface(path, Space::ras); }),
                     {"a.stl", "12 triangles", "truncated"}));
}

TEST(SurfaceFile, RealLiverHasItsKnownSizeAndVolume) {
    LIVETET_DATA_OR_SKIP(data);
    const TriangleMesh liver = read_surface(data / "liver" / "OpenHELP_Liver.stl", Space::ras);
    EXPECT_EQ(liver.nodes.size(), 15365u);
    EXPECT_EQ(liver.triangles.size(), 30726u);
    EXPECT_NEAR(enclosed_volume(liver) * 1e6, 1817.7, 0.1);
    EXPECT_GT(read_surface(data / "surfaces" / "elephant.off", Space::ras).triangles.size(), 1000u);
}

}  // namespace
}  // namespace livetet
