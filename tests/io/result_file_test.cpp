#include "io/result_file.hpp"

#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <limits>

#include "files.hpp"
#include "io/hierarchy_file.hpp"
#include "mesh/hex_grid.hpp"
#include "meshes.hpp"

namespace livetet {
namespace {

using namespace testing_files;
using namespace testing_meshes;

std::vector<Vector3> moved(double by) {
    std::vector<Vector3> u;
    for (const Vector3& x : cube().nodes) u.push_back(by * Vector3(x.y(), 1, -x.x()));
    return u;
}

TEST(ResultFile, FramesComeBackInFloat) {
    const auto path = fresh_folder() / "r.h5";
    ResultWriter writer(path, cube(), "scene: a & b");
    for (int k = 0; k < 5; ++k) {
        writer.append(0.1 * k, moved(0.001 * k));
        writer.append_values("residual", std::vector<double>{1.0 / (k + 1), 2.0 * k});
    }
    EXPECT_FALSE(std::filesystem::exists(path)) << "a run under way shows no result";
    writer.close();
    writer.close();
    const ResultReader reader(path);
    expect_same(reader.mesh(), cube());
    EXPECT_EQ(reader.scene_text(), "scene: a & b");
    EXPECT_EQ(reader.times_s(), (std::vector<double>{0, 0.1, 0.2, 0.1 * 3, 0.4}));
    for (int k = 0; k < 5; ++k) {
        const auto u = reader.displacement(k), expected = moved(0.001 * k);
        for (std::size_t n = 0; n < 8; ++n) EXPECT_LT((u[n] - expected[n]).norm(), 1e-9);
        EXPECT_EQ(reader.values("residual", k, 2), (std::vector<double>{1.0 / (k + 1), 2.0 * k}));
    }
    EXPECT_EQ(reader.value_names(), std::vector<std::string>{"residual"});
    EXPECT_TRUE(says(error_of([&] { reader.displacement(5); }), {"r.h5", "5 frames", "number 5"}));
    EXPECT_TRUE(says(error_of([&] { reader.values("other", 0, 2); }), {"no table values/other"}));
}

TEST(ResultFile, TheXdmfNamesTheTablesOfEachFrame) {
    const auto path = fresh_folder() / "r & s.h5";
    ResultWriter writer(path, cube(), "");
    writer.append(0.5, moved(1));
    writer.append(0.75, moved(2));
    writer.close();
    auto xdmf = path;
    const std::string text = read_text_file(xdmf.replace_extension(".xdmf"));
    for (const char* part :
         {"TopologyType=\"Tetrahedron\" NumberOfElements=\"6\"", "r &amp; s.h5:/mesh/tets<",
          "r &amp; s.h5:/mesh/nodes<", "r &amp; s.h5:/displacement/000001<", "Value=\"0.75\"",
          "CollectionType=\"Temporal\"", "Dimensions=\"8 3\""})
        EXPECT_NE(text.find(part), std::string::npos) << part;
    EXPECT_EQ(text.find(path.parent_path().string()), std::string::npos)
        << "result and xdmf move together";
}

TEST(ResultFile, WithoutCloseNothingIsLeft) {
    const auto folder = fresh_folder();
    { ResultWriter(folder / "r.h5", cube(), "").append(0, moved(1)); }
    EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST(ResultFile, WhatWasFlushedIsWholeShouldTheProgramBeKilled) {
    const auto folder = fresh_folder();
    ResultWriter writer(folder / "r.h5", cube(), "scene");
    const auto frame = [&](int k) {
        writer.append(k, moved(0.001 * k));
        writer.append_values("v", std::vector<double>{1.0 * k});
    };
    for (int k = 0; k < 100; ++k) frame(k);
    writer.flush();
    for (int k = 100; k < 130; ++k) frame(k);
    std::filesystem::path left;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) left = entry.path();
    std::filesystem::copy(left, folder / "left.h5");
    const ResultReader reader(folder / "left.h5");
    ASSERT_GE(reader.frame_count(), 100u);
    EXPECT_LT((reader.displacement(99)[3] - moved(0.099)[3]).norm(), 1e-9);
    for (std::size_t k = 0; k < 100; ++k) {
        EXPECT_EQ(reader.times_s()[k], k);
        EXPECT_EQ(reader.values("v", k, 1)[0], k);
    }
    EXPECT_FALSE(reader.has_text("run"));
}

TEST(ResultFile, AFullDiskIsMetBetweenFramesAndWhatCameBeforeIsKept) {
    const auto path = fresh_folder() / "r.h5";
    ResultWriter writer(path, cube(), "scene");
    rlimit before{};
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto ignored = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{5 << 20, before.rlim_max};  // a disk of 5 MB
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
    std::size_t frames = 0;
    const std::string problem = error_of([&] {
        for (; frames < 20000; ++frames) {
            writer.append(static_cast<double>(frames), moved(0.001));
            writer.append_values("v", std::vector<double>{1.0 * static_cast<double>(frames)});
        }
    });
    writer.write_text("run", std::string(10000, '.'));
    writer.close();
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, ignored);
    EXPECT_TRUE(says(problem, {"r.h5", "no room on the disk for frame"}));
    const ResultReader reader(path);
    ASSERT_EQ(reader.frame_count(), frames);
    EXPECT_EQ(reader.values("v", frames - 1, 1)[0], static_cast<double>(frames - 1));
    EXPECT_EQ(reader.text("run").size(), 10000u);
    EXPECT_LT(std::filesystem::file_size(path), (frames + 100) * 2048)
        << "what was reserved is given back";
}

TEST(ResultFile, FramesThatCannotBeAreRefused) {
    const auto path = fresh_folder() / "r.h5";
    ResultWriter writer(path, cube(), "");
    writer.append(1, moved(1));
    auto u = moved(1);
    u[3].y() = NAN;
    EXPECT_TRUE(says(error_of([&] { writer.append(2, u); }), {"frame 1", "node 3", "finite"}));
    u.resize(7);
    EXPECT_TRUE(
        says(error_of([&] { writer.append(2, u); }), {"frame 1", "7 displacements", "expected 8"}));
    EXPECT_TRUE(
        says(error_of([&] { writer.append(0.5, moved(1)); }), {"frame 1", "0.5 s", "backwards"}));
    writer.append_values("v", std::vector<double>{1});
    EXPECT_TRUE(says(error_of([&] { writer.append_values("v", std::vector<double>{1}); }),
                     {"once with each frame"}));
    writer.append(2, moved(2));
    EXPECT_TRUE(says(error_of([&] {
                         writer.append_values("v", std::vector<double>{1, 2});
                     }),
                     {"values/v", "2 numbers", "expected 1"}));
    writer.close();
    EXPECT_TRUE(says(error_of([&] { writer.append(3, moved(1)); }), {"closed"}));
    EXPECT_EQ(ResultReader(path).frame_count(), 2u);
    EXPECT_TRUE(says(error_of([&] { ResultWriter(path.parent_path() / "r.vtu", cube(), ""); }),
                     {"'.vtu'", ".h5"}));
}

TEST(ResultFile, ATruncatedFileIsAnError) {
    const auto path = fresh_folder() / "r.h5";
    ResultWriter writer(path, cube(), "");
    for (int k = 0; k < 20; ++k) writer.append(k, moved(k));
    writer.close();
    truncate_to(path, 0.7);
    EXPECT_TRUE(says(error_of([&] { ResultReader{path}; }), {"r.h5", "truncated"}));
}

/// Two cells of a row, and the mesh after a cut that doubles their common face.
struct CutRow {
    TetMesh whole, open;
    std::vector<std::int32_t> originals;

    CutRow() {
        whole.hexahedra = {{0, 1, 3, 4, 6, 7, 9, 10}, {1, 2, 4, 5, 7, 8, 10, 11}};
        for (int k = 0; k < 2; ++k)
            for (int j = 0; j < 2; ++j)
                for (int i = 0; i < 3; ++i) whole.nodes.emplace_back(i, j, k);
        whole.shares = {1, 0.5};
        whole.tets = tets_of_hexahedra(whole.hexahedra);
        open = whole;
        for (int c : {0, 2, 4, 6}) {
            originals.push_back(whole.hexahedra[1][c]);
            open.hexahedra[1][c] = static_cast<std::int32_t>(open.nodes.size());
            open.nodes.push_back(whole.nodes[originals.back()]);
        }
        open.tets = tets_of_hexahedra(open.hexahedra);
    }
    static std::vector<Vector3> frame(std::size_t nodes, int k) {
        std::vector<Vector3> u;
        for (std::size_t n = 0; n < nodes; ++n) u.emplace_back(static_cast<double>(n), k, 0.5);
        return u;
    }
};

TEST(ResultFile, AMeshThatIsCutWhileTheRunGoesOnKeepsTheFramesBefore) {
    const CutRow row;
    const auto folder = fresh_folder(), path = folder / "r.h5";
    ResultWriter writer(path, row.whole, "scene", Precision::single);
    writer.append(0, CutRow::frame(12, 0));
    writer.append(1, CutRow::frame(12, 1));
    writer.set_mesh(row.open, row.originals);
    writer.append(2, CutRow::frame(16, 2));
    writer.flush();
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        std::filesystem::copy(entry.path(), folder / "left.h5");
    writer.close();
    for (const char* name : {"r.h5", "left.h5"}) {
        const ResultReader reader(folder / name);
        expect_same(reader.mesh(), row.open);
        EXPECT_EQ(reader.mesh().hexahedra, row.open.hexahedra);
        EXPECT_EQ(reader.first_mesh().hexahedra, row.whole.hexahedra);
        ASSERT_EQ(reader.frame_count(), 3U);
        for (int k = 0; k < 2; ++k) {
            const auto u = reader.displacement(k), before = CutRow::frame(12, k);
            ASSERT_EQ(u.size(), 16U);
            for (std::size_t n = 0; n < 12; ++n) EXPECT_EQ(u[n], before[n]);
            for (std::size_t n = 12; n < 16; ++n) EXPECT_EQ(u[n], before[row.originals[n - 12]]);
        }
        EXPECT_EQ(reader.displacement(2), CutRow::frame(16, 2));
    }
    const std::string xdmf = read_text_file(folder / "r.xdmf");
    const auto at = [&](const std::string& part, int times) {
        std::size_t found = 0, from = 0;
        while ((from = xdmf.find(part, from)) != std::string::npos) ++found, ++from;
        EXPECT_EQ(found, static_cast<std::size_t>(times)) << part;
    };
    at("r.h5:/mesh/hexahedra<", 2);
    at("Dimensions=\"12 3\"", 4);  // nodes and displacement of two frames
    at("r.h5:/meshes/000000/hexahedra<", 1);
    at("r.h5:/meshes/000000/nodes<", 1);
    at("Dimensions=\"16 3\"", 2);
}

TEST(ResultFile, AMeshThatDoesNotContinueTheRunIsRefused) {
    const CutRow row;
    const auto path = fresh_folder() / "r.h5";
    ResultWriter writer(path, row.whole, "");
    auto originals = row.originals;
    originals.pop_back();
    EXPECT_TRUE(says(error_of([&] { writer.set_mesh(row.open, originals); }),
                     {"from frame 0", "16 nodes", "12", "3 copies"}));
    originals.push_back(15);
    EXPECT_TRUE(says(error_of([&] { writer.set_mesh(row.open, originals); }),
                     {"node 15 is a copy of node 15", "lower"}));
    EXPECT_TRUE(says(error_of([&] { writer.set_mesh(cube(), {}); }), {"8 nodes", "expected"}));
    writer.set_mesh(row.open, row.originals);
    EXPECT_TRUE(says(error_of([&] { writer.append(0, CutRow::frame(12, 0)); }),
                     {"12 displacements", "expected 16"}));
    EXPECT_TRUE(says(error_of([&] { writer.set_mesh(row.whole, {}); }), {"expected at least 16"}));
    writer.append(0, CutRow::frame(16, 0));
    writer.append_field("f", FieldPlace::node, 1, std::vector<double>(16, 1.0));
    EXPECT_TRUE(says(error_of([&] { writer.set_mesh(row.open, row.originals); }), {"fields"}));
    writer.close();
    EXPECT_TRUE(says(error_of([&] { writer.set_mesh(row.open, row.originals); }), {"closed"}));
}

/// What another program wrote into a result's tables is told by file and table.
TEST(ResultFile, ALaterMeshThatDoesNotFitItsFileIsAnError) {
    const CutRow row;
    const auto folder = fresh_folder();
    {
        ResultWriter writer(folder / "r.h5", row.whole, "");
        writer.append(0, CutRow::frame(12, 0));
        writer.close();
    }
    const auto broken = [&](const TetMesh& later, const std::vector<std::int32_t>& originals,
                            const std::vector<double>& from_and_nodes = {0, 16},
                            std::size_t rows = 17) {
        const auto path = folder / "broken.h5";
        {
            auto file = hdf5::File::create(path, "broken.h5");
            hdf5::write_format(file, "livetet result", 1);
            file.write_text("scene", "");
            write_mesh(file, "mesh", row.whole);
            write_mesh(file, "meshes/000000", later);
            file.write<std::int32_t>("meshes/000000/originals", originals, 1);
            file.write<double>("later_meshes", from_and_nodes, 2);
            file.write<double>("times", std::vector<double>{0}, 1);
            file.write<double>("displacement/000000", std::vector<double>(3 * rows, 0.0), 3);
        }
        return error_of([&] { (void)ResultReader(path).displacement(0); });
    };
    EXPECT_TRUE(says(broken(row.open, {1, 4, 7}), {"broken.h5", "meshes/000000", "3 copies"}));
    EXPECT_TRUE(says(broken(row.open, {1, 4, 7, -1}), {"broken.h5", "node 15", "node -1"}));
    EXPECT_TRUE(says(broken(row.open, {1, 4, 7, 10}),
                     {"broken.h5", "displacement/000000", "17 rows", "expected 16"}));
    const double none = std::numeric_limits<double>::quiet_NaN();
    for (const double frame : {1.0, 0.0, none, -1.0})
        for (const double nodes : {16.0, 15.0, none}) {
            if (nodes == 16 && frame >= 0) continue;
            const std::string said = broken(row.open, {1, 4, 7, 10}, {frame, nodes});
            EXPECT_TRUE(says(said, {"broken.h5", "later_meshes"})) << frame << ", " << nodes;
        }
    // Before the later mesh, and from it on.
    for (const auto& [frame, nodes] : {std::pair{1.0, 12U}, {0.0, 16U}})
        for (const std::size_t rows : {12U, 14U, 16U}) {
            const std::string said = broken(row.open, {1, 4, 7, 10}, {frame, 16}, rows);
            if (rows == nodes)
                EXPECT_EQ(said, "") << frame;
            else
                EXPECT_TRUE(
                    says(said, {"displacement/000000", frame > 0 ? "expected 12" : "expected 16"}))
                    << frame << ", " << rows << ": " << said;
        }
}

}  // namespace
}  // namespace livetet
