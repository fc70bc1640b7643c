#ifdef LIVETET_IMAGES

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "base/file.hpp"
#include "meshing/levels.hpp"
#include "meshing/surface_check.hpp"

namespace livetet {
namespace {

/// Minimal reader for binary STL in mm; triangles do not share nodes.
TriangleMesh read_binary_stl(const std::filesystem::path& path) {
    const std::string bytes = read_text_file(path);
    constexpr std::size_t header = 84, record = 50;
    TriangleMesh surface;
    for (std::size_t at = header; at + record <= bytes.size(); at += record) {
        float corners[9];
        std::memcpy(corners, bytes.data() + at + 12, sizeof corners);
        const auto n = static_cast<std::int32_t>(surface.nodes.size());
        for (int c = 0; c < 3; ++c)
            surface.nodes.push_back(
                1e-3 * Vector3(corners[3 * c], corners[3 * c + 1], corners[3 * c + 2]));
        surface.triangles.push_back({n, n + 1, n + 2});
    }
    return surface;
}

class RealOrgan : public testing::Test {
  protected:
    void SetUp() override {
        const char* folder = std::getenv("LIVETET_DATA");
        if (!folder) GTEST_SKIP() << "LIVETET_DATA is not set: no real organs to mesh";
        folder_ = folder;
    }
    /// Expects four valid levels of about 60,000, 7,500, 1,000 and 150 tets.
    static void expect_default_hierarchy(const TriangleMesh& surface, double volume_ml) {
        const HierarchyResult result = build_hierarchy(surface, {});
        ASSERT_EQ(result.hierarchy.levels.size(), 4u);
        for (const TetMesh& mesh : result.hierarchy.levels) check_tet_mesh(mesh, "organ");
        EXPECT_NEAR(result.levels[0].quality.tets, 60000, 6000);
        // A level with a nearly flat tet is made again with edges up to 14 % shorter: up to 1.6
        // times the tets.
        EXPECT_GT(result.levels[1].quality.tets, 6000);
        EXPECT_LT(result.levels[1].quality.tets, 13000);
        EXPECT_GT(result.levels[2].quality.tets, 700);
        EXPECT_LT(result.levels[2].quality.tets, 2000);
        EXPECT_GT(result.levels[3].quality.tets, 50);
        EXPECT_LT(result.levels[3].quality.tets, 400);
        EXPECT_NEAR(1e6 * result.levels[0].quality.volume_m3, volume_ml, 0.005 * volume_ml);
        for (const LevelReport& level : result.levels) EXPECT_GE(level.quality.min_dihedral_deg, 5);
    }
    std::filesystem::path folder_;
};

TEST_F(RealOrgan, liver_surface_becomes_a_hierarchy) {
    const std::filesystem::path file = folder_ / "liver/OpenHELP_Liver.stl";
    if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
    expect_default_hierarchy(read_binary_stl(file), 1817.7);
}

TEST_F(RealOrgan, non_manifold_liver_is_repaired_or_refused_in_time) {
    const std::filesystem::path file = folder_ / "surfaces/sofaenv_liver_visual_NONMANIFOLD.stl";
    if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
    const TriangleMesh surface = read_binary_stl(file);
    expect_default_hierarchy(surface, 1762);
}

}  // namespace
}  // namespace livetet

#endif
