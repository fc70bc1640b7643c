#include "io/hierarchy_file.hpp"

#include <cmath>

#include "base/file.hpp"
#include "files.hpp"
#include "meshes.hpp"

namespace livetet {
namespace {

using namespace testing_files;
using namespace testing_meshes;

/// Two levels: the cube, and its first tet, into which every node is mapped.
MeshHierarchy example() {
    MeshHierarchy h;
    h.levels.push_back(cube());
    TetMesh& coarse = h.levels.emplace_back();
    coarse.nodes = {{0, 0, 0}, {0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.1}};
    coarse.tets = {{0, 1, 2, 3}};
    BarycentricMap map;
    for (const Vector3& x : h.levels[0].nodes) {
        map.nodes.push_back({0, 1, 2, 3});
        map.weights.push_back({1 - 10 * x.sum(), 10 * x[0], 10 * x[1], 10 * x[2]});
        map.distance.push_back(0.5 * x[0]);
    }
    h.transfers.push_back(map);
    h.provenance = "made by a test, with \"quotes\", " + std::string(100000, 'x');
    return h;
}

TEST(HierarchyFile, WhatIsWrittenIsReadBack) {
    const auto path = fresh_folder() / "h.h5";
    const MeshHierarchy h = example();
    write_hierarchy(path, h);
    const MeshHierarchy back = read_hierarchy(path);
    ASSERT_EQ(back.levels.size(), 2u);
    for (int l = 0; l < 2; ++l) expect_same(back.levels[l], h.levels[l]);
    ASSERT_EQ(back.transfers.size(), 1u);
    EXPECT_EQ(back.transfers[0].nodes, h.transfers[0].nodes);
    EXPECT_EQ(back.transfers[0].weights, h.transfers[0].weights);
    EXPECT_EQ(back.transfers[0].distance, h.transfers[0].distance);
    EXPECT_EQ(back.provenance, h.provenance);
}

TEST(HierarchyFile, KnowsWhereTheImagesVoxelsLie) {
    const auto path = fresh_folder() / "h.h5";
    ImageGrid grid{{512, 511, 40}, Eigen::Matrix4d::Identity()};
    grid.ras_from_voxel << 6e-4, -1.6e-3, 0, 0.01, 8e-4, 1.2e-3, 0, 0.02, 0, 0, -3e-3, 0.03, 0, 0,
        0, 1;
    write_hierarchy(path, example(), grid);
    const std::optional<ImageGrid> back = read_image_grid(path);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->size, grid.size);
    EXPECT_EQ(back->ras_from_voxel, grid.ras_from_voxel);
    const auto spacing = hdf5::File::open(path).read<double>("image/spacing", 3).values;
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(spacing[axis], 1e-3 * (axis + 1), 1e-15);
    EXPECT_EQ(read_hierarchy(path).levels.size(), 2u);
    write_hierarchy(path, example());  // as in files of older versions
    EXPECT_FALSE(read_image_grid(path));
    for (const int spoilt : {0, 1, 2}) {
        ImageGrid wrong = grid;
        if (spoilt == 0) wrong.size[1] = 0;
        if (spoilt == 1) wrong.ras_from_voxel.col(0).setZero();
        if (spoilt == 2) wrong.ras_from_voxel(3, 0) = 1;
        write_hierarchy(path, example(), wrong);
        EXPECT_TRUE(says(error_of([&] { read_image_grid(path); }),
                         {"h.h5", spoilt == 0 ? "image/size" : "image/ras_from_voxel"}));
    }
}

TEST(HierarchyFile, HostileNumbersAreRefusedWithTheirTable) {
    const auto path = fresh_folder() / "h.h5";
    const auto refuses = [&](const std::function<void(MeshHierarchy&)>& spoil,
                             std::initializer_list<const char*> words) {
        MeshHierarchy h = example();
        spoil(h);
        write_hierarchy(path, h);
        EXPECT_TRUE(says(error_of([&] { read_hierarchy(path); }), words));
    };
    refuses([](auto& h) { h.levels[0].tets[2][1] = 99; }, {"h.h5: levels/0", "tet 2", "99"});
    refuses([](auto& h) { h.levels[0].tets[2][1] = -1; }, {"h.h5: levels/0", "tet 2", "-1"});
    refuses([](auto& h) { std::swap(h.levels[0].tets[3][0], h.levels[0].tets[3][1]); },
            {"tet 3", "inverted"});
    refuses([](auto& h) { h.levels[0].nodes[4].x() = NAN; }, {"levels/0", "node 4", "finite"});
    refuses([](auto& h) { h.levels[0].regions.pop_back(); }, {"levels/0", "5 region"});
    refuses([](auto& h) { h.levels[0].node_sets["bottom"][3] = 8; },
            {"levels/0/node_sets/bottom", "node 8", "0 to 7"});
    refuses([](auto& h) { h.levels[0].node_sets["bottom"][3] = 1; },
            {"levels/0/node_sets/bottom", "order"});
    refuses([](auto& h) { h.levels[0].triangle_sets["bottom"][1][2] = -7; },
            {"triangle_sets/bottom", "node -7"});
    refuses([](auto& h) { h.transfers[0].nodes[5][0] = 4; },
            {"transfers/0/nodes", "node 4", "0 to 3"});
    refuses([](auto& h) { h.transfers[0].weights[5][0] = NAN; }, {"transfers/0/weights", "row 5"});
    refuses(
        [](auto& h) {
            h.transfers[0].weights[5] = {1, 1, 0, 0};
        },
        {"transfers/0/weights", "row 5"});
    refuses([](auto& h) { h.transfers[0].distance[5] = -1; }, {"transfers/0/distance", "row 5"});
    refuses([](auto& h) { h.transfers[0].weights.pop_back(); }, {"transfers/0", "7 weights"});
    refuses([](auto& h) { h.transfers.clear(); }, {"no table transfers/0/nodes"});
    refuses([](auto& h) { h.levels.clear(); }, {"no levels"});
}

TEST(HierarchyFile, OtherFilesAreErrors) {
    const auto folder = fresh_folder();
    EXPECT_TRUE(
        says(error_of([&] { read_hierarchy(folder / "none.h5"); }), {"none.h5", "no such file"}));
    EXPECT_TRUE(says(error_of([&] { read_hierarchy(folder); }), {"is a folder, expected a file"}));
    write_bytes(folder / "text.h5", "not HDF5 at all");
    EXPECT_TRUE(says(error_of([&] { read_hierarchy(folder / "text.h5"); }),
                     {"text.h5", "not an HDF5 file"}));
    hdf5::File::create(folder / "empty.h5", "empty.h5");
    EXPECT_TRUE(says(error_of([&] { read_hierarchy(folder / "empty.h5"); }),
                     {"empty.h5", "another program, or damaged"}));
    {
        auto file = hdf5::File::create(folder / "later.h5", "later.h5");
        hdf5::write_format(file, "livetet mesh hierarchy", 9);
    }
    EXPECT_TRUE(says(error_of([&] { read_hierarchy(folder / "later.h5"); }),
                     {"later.h5", "version 9", "expected 1"}));
    {
        auto file = hdf5::File::create(folder / "shape.h5", "shape.h5");
        hdf5::write_format(file, "livetet mesh hierarchy", 1);
        file.write_text("provenance", "");
        file.write<double>("levels/0/nodes", std::vector<double>(8), 2);
    }
    EXPECT_TRUE(says(error_of([&] { read_hierarchy(folder / "shape.h5"); }),
                     {"levels/0/nodes", "2 columns", "3 columns"}));
    EXPECT_TRUE(
        says(error_of([&] { write_hierarchy(folder / "no" / "h.h5", example()); }), {"no folder"}));
}

/// HDF5 follows wrong addresses and sizes to unallocated memory.
TEST(HierarchyFile, AWrongNumberAnywhereInItNeverCrashes) {
    const auto path = fresh_folder() / "h.h5";
    MeshHierarchy small;
    small.levels.push_back(cube());
    write_hierarchy(path, small);
    const std::string good = read_text_file(path);
    int refused = 0;
    for (std::size_t at = 0; at + 8 <= good.size(); at += 40) {
        std::string bad = good;
        bad.replace(at, 8, std::string("\xff\xff\x7f\xff\0\0\0\0", 8));
        write_text_file(path, bad);
        try {
            read_hierarchy(path);
        } catch (const Error& error) {
            ++refused;
            EXPECT_NE(std::string(error.what()).find("h.h5"), std::string::npos)
                << at << ": " << error.what();
        }
    }
    EXPECT_GT(refused, 20);
}

TEST(HierarchyFile, ATruncatedFileIsAnError) {
    const auto path = fresh_folder() / "h.h5";
    write_hierarchy(path, example());
    const std::string whole = read_text_file(path);
    for (std::size_t n = 0; n < whole.size(); n += 997) {
        write_bytes(path, whole.substr(0, n));
        EXPECT_TRUE(says(error_of([&] { read_hierarchy(path); }), {"h.h5"})) << n;
    }
}

}  // namespace
}  // namespace livetet
