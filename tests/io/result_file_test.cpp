#include "io/result_file.hpp"

#include <sys/resource.h>

#include <cmath>
#include <csignal>

#include "files.hpp"
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

}  // namespace
}  // namespace livetet
