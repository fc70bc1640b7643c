#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/surface_file.hpp"
#include "support/program.hpp"

namespace livetet {
namespace {

using test::Folder;
using test::livetet;
using test::text_of;

/// Two labels, side by side, in a ball of 18 mm.
LabelImage two_halves() {
    LabelImage image;
    image.size = {24, 24, 24};
    image.ras_from_voxel.diagonal() << 2e-3, 2e-3, 2e-3, 1;
    for (int k = 0; k < 24; ++k)
        for (int j = 0; j < 24; ++j)
            for (int i = 0; i < 24; ++i)
                image.values.push_back((Vector3(i, j, k) - Vector3::Constant(11.5)).norm() < 9 ? 1 + (i > 11) : 0);
    return image;
}

TEST(Mesh, ReportsDistancesAnglesAndMaterials) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    ASSERT_EQ(livetet(folder, "mesh labels.nii.gz --tets 4000 -o m.h5 --json m.json").status, 0);
    const auto json = nlohmann::json::parse(text_of(folder / "m.json"));
    const auto& finest = json["levels"][0];
    EXPECT_GE(finest["min_dihedral_deg"].get<double>(), 5);
    EXPECT_GE(finest["worst"][0]["min_dihedral_deg"].get<double>(), 5);
    EXPECT_LT(finest["to_surface"]["max_mm"].get<double>(), 1);
    EXPECT_GT(finest["from_surface"]["mean_mm"].get<double>(), 0);
    EXPECT_LT(json["image"]["moved"]["mean_mm"].get<double>(), 1);  // voxels of 2 mm
    ASSERT_EQ(json["regions"].size(), 2u);
    for (const auto& region : json["regions"])
        EXPECT_NEAR(region["tets_ml"].get<double>(), region["voxels_ml"].get<double>(), 1.2);
    EXPECT_EQ(nlohmann::json::parse(read_hierarchy(folder / "m.h5").provenance)["levels"], json["levels"]);
}

TEST(Mesh, KeepsWhatNothingHasChanged) {
    const Folder folder;
    LabelImage image = two_halves();
    write_image(folder / "labels.nii.gz", image);
    write_image(folder / "mask.nii.gz", image);
    const std::string command = "mesh labels.nii.gz --tets 1000 --fix mask.nii.gz -o m.h5 --json m.json ";
    const auto remade = [&](const std::string& more) {
        std::filesystem::remove(folder / "m.json");
        const auto before = std::filesystem::exists(folder / "m.h5") ? std::filesystem::last_write_time(folder / "m.h5")
                                                                     : std::filesystem::file_time_type{};
        EXPECT_EQ(livetet(folder, command + more).status, 0);
        EXPECT_TRUE(std::filesystem::exists(folder / "m.json"));
        return std::filesystem::last_write_time(folder / "m.h5") != before;
    };
    EXPECT_TRUE(remade(""));
    EXPECT_FALSE(remade(""));
    EXPECT_TRUE(remade("--again"));
    EXPECT_TRUE(remade("--min-dihedral-deg 6"));
    EXPECT_TRUE(remade(""));
    image.at(11, 11, 11) = 2;
    write_image(folder / "mask.nii.gz", image);
    EXPECT_TRUE(remade(""));
    write_image(folder / "labels.nii.gz", image);
    EXPECT_TRUE(remade(""));
    EXPECT_FALSE(remade(""));
}

TEST(Mesh, KeepsNothingWhoseVoxelsLieInOtherFiles) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    write_text_file(folder / "mask.mhd",
                    "ObjectType = Image\nNDims = 3\nDimSize = 24 24 24\nElementSpacing = 2 2 2\nElementType = MET_UCHAR\n"
                    "TransformMatrix = -1 0 0 0 -1 0 0 0 1\nElementDataFile = mask.raw\n");
    std::size_t fixed[2];
    for (const int thickness : {8, 12}) {
        std::string voxels(24 * 24 * 24, 0);
        std::fill_n(voxels.begin(), thickness * 24 * 24, 1);
        write_text_file(folder / "mask.raw", voxels);
        ASSERT_EQ(livetet(folder, "mesh labels.nii.gz --tets 1000 --fix mask.mhd -o m.h5").status, 0);
        fixed[thickness == 12] = read_hierarchy(folder / "m.h5").levels.front().node_sets.at("fixed").size();
    }
    EXPECT_GT(fixed[1], fixed[0]);
}

TEST(Mesh, LeavesTheSurfaceThatItFailedOnForALook) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    const auto result = livetet(folder, "mesh labels.nii.gz --tets 4000 --time-limit-s 1e-9 -o m.h5");
    EXPECT_EQ(result.status, 2);
    EXPECT_NE(result.err.find("m.failed.stl"), std::string::npos) << result.err;
    EXPECT_FALSE(read_surface(folder / "m.failed.stl", Space::ras).triangles.empty());
    EXPECT_FALSE(std::filesystem::exists(folder / "m.h5"));
}

TEST(Mesh, SaysAtOnceWhatItCannotDo) {
    const Folder folder;
    write_text_file(folder / "scene.yaml", "mesh: {file: labels.nii.gz}\n");
    const auto mixed = livetet(folder, "mesh scene.yaml --tets 4000 -o m.h5");
    EXPECT_EQ(mixed.status, 2);
    EXPECT_NE(mixed.err.find("--tets"), std::string::npos) << mixed.err;
    write_image(folder / "labels.nii.gz", two_halves());
    const auto nowhere = livetet(folder, "mesh labels.nii.gz -o none/m.h5");
    EXPECT_EQ(nowhere.status, 2);
    EXPECT_NE(nowhere.err.find("none"), std::string::npos) << nowhere.err;
    EXPECT_EQ(nowhere.err.find("level 0"), std::string::npos) << nowhere.err;
}

TEST(Mesh, TakesAFrameBudget) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    ASSERT_EQ(livetet(folder, "mesh labels.nii.gz --budget-ms 0.3 -o m.h5").status, 0);
    EXPECT_NEAR(static_cast<double>(read_hierarchy(folder / "m.h5").levels.front().tets.size()), 3000, 300);
}

}  // namespace
}  // namespace livetet
