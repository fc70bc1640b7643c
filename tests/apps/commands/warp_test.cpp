#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "apps/commands/warped_block.hpp"
#include "base/file.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::livetet;
using test::text_of;
using test::WarpedBlock;
using test::write_text;

Vector3 stay(const Vector3& x) { return x; }

/// Some voxels along, by whole voxels of the upright grid.
Vector3 three_right(const Vector3& x) { return x + Vector3(9e-3, 0, 0); }

double volume_of(const TetMesh& mesh, const std::vector<Vector3>& u) {
    TetMesh deformed = mesh;
    for (std::size_t n = 0; n < u.size(); ++n) deformed.nodes[n] += u[n];
    return volume(deformed);
}

TEST(Warp, FindsTheLabelMapThatWasMeshedAndMovesItByWholeVoxels) {
    const WarpedBlock block;
    block.write_meshed();
    block.write_result("result.h5", {stay, three_right});
    const std::filesystem::path left = block.folder / ".out.nii.part4194305.gz";
    test::write_text(left, "of a run that was killed");
    const auto outcome = livetet(block.folder, "warp result.h5 -o out.nii.gz");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(left));
    EXPECT_NE(outcome.err.find(left.filename().string()), std::string::npos) << outcome.err;
    const LabelImage before = read_label_image(block.folder / "labels.nii.gz"),
                     after = read_label_image(block.folder / "out.nii.gz");
    for (int k = 0; k < 40; ++k)
        for (int j = 0; j < 40; ++j)
            for (int i = 0; i < 40; ++i)
                ASSERT_EQ(after.at(i, j, k), i >= 3 ? before.at(i - 3, j, k) : 0)
                    << i << ' ' << j << ' ' << k;
    // Moved elsewhere together, all is found by its name.
    std::filesystem::create_directories(block.folder / "moved");
    for (const char* name : {"labels.nii.gz", "block.h5", "result.h5"})
        std::filesystem::rename(block.folder / name, block.folder / "moved" / name);
    EXPECT_EQ(livetet(block.folder, "warp moved/result.h5 -o again.nii.gz").status, 0);
    EXPECT_EQ(text_of(block.folder / "again.nii.gz"), text_of(block.folder / "out.nii.gz"));
}

TEST(Warp, FramesAreChosenByNumberOrTimeAndTheLastIsTheDefault) {
    const WarpedBlock block;
    block.write_meshed();
    const auto by = [](double m) {
        return [m](const Vector3& x) { return Vector3(x + Vector3(m, 0, 0)); };
    };
    block.write_result("result.h5", {by(0), by(3e-3), by(6e-3)});
    const auto leftmost = [&](const std::string& options) {
        EXPECT_EQ(livetet(block.folder, "warp result.h5 -o out.nii.gz " + options).status, 0)
            << options;
        const LabelImage out = read_label_image(block.folder / "out.nii.gz");
        int i = 0;
        while (i < 40 && out.at(i, 20, 20) != 1) ++i;
        return i;
    };
    const int at_rest = leftmost("--frame 1");
    EXPECT_EQ(leftmost("--frame 2"), at_rest + 1);
    EXPECT_EQ(leftmost(""), at_rest + 2);
    EXPECT_EQ(leftmost("--time 10.4"), at_rest);
    EXPECT_EQ(leftmost("--time 11.4"), at_rest + 1);
    EXPECT_EQ(leftmost("--time 12"), at_rest + 2);
}

TEST(Warp, TheDeformedLabelsHaveTheDeformedMeshesVolume) {
    for (const bool oblique : {false, true}) {
        const WarpedBlock block(oblique);
        block.write_meshed();
        const auto bend = [](const Vector3& x) {
            return Vector3(1.15 * x.x(), x.y() + 5 * x.x() * x.x(),
                           0.9 * x.z() + 3 * x.x() * x.y());
        };
        block.write_result("result.h5", {bend});
        const auto outcome = livetet(block.folder, "warp result.h5 -o out.nii.gz --json told.json");
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        const auto told = nlohmann::json::parse(text_of(block.folder / "told.json"));
        const LabelImage before = read_label_image(block.folder / "labels.nii.gz"),
                         after = read_label_image(block.folder / "out.nii.gz");
        const double ml = told["voxel_ml"],
                     expected = 1e6 * volume_of(block.mesh, block.displaced(bend));
        // The voxels of the block at rest hold its volume to this; deformed they may be as far off
        // again.
        const double resting =
            ml * static_cast<double>(std::count(before.values.begin(), before.values.end(), 1));
        EXPECT_NEAR(resting, 120, 2);
        const double found =
            ml * static_cast<double>(std::count(after.values.begin(), after.values.end(), 1));
        EXPECT_NEAR(found / resting, expected / 120, 0.02);
        EXPECT_GT(expected / 120, 1.03);  // or it would show nothing
        EXPECT_EQ(told["inverted"], 0);
        EXPECT_EQ(told["label_map"], true);
    }
}

TEST(Warp, AGreyImageKeepsItsKindOfVoxelAndIsInterpolated) {
    const WarpedBlock block(true);
    block.write_result("result.h5", {[](const Vector3& x) {
                           return Vector3(x + Vector3(0.0011, 0.0007, -0.0005));
                       }},
                       "gone.h5");
    const auto value = [](const Vector3& x) {
        return static_cast<float>(1e4 * (x.x() + 2 * x.y()));
    };  // -900 to 2,000, stored rounded
    write_image(block.folder / "ct.nii.gz", block.image<float>(value), ScalarType::int16);
    for (const char* how :
         {"", "--interpolation linear", "--interpolation cubic", "--interpolation nearest"}) {
        const auto outcome =
            livetet(block.folder,
                    std::string("warp result.h5 --image ct.nii.gz -o out.nii --rind-mm 0 ") + how);
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_EQ(read_volume(block.folder / "out.nii").type, ScalarType::int16);
        const GreyImage out = read_grey_image(block.folder / "out.nii");
        const double allowed =
            std::string(how).ends_with("nearest") ? 50 : 2;  // half a voxel's diagonal; roundings
        double worst = 0;
        for (int n = 10; n < 30; ++n) {
            const Vector3 x = block.place(n, 20, 20) - Vector3(0.0011, 0.0007, -0.0005);
            if ((x.array() > 0.002).all() &&
                (x.array() < Eigen::Array3d(0.058, 0.048, 0.038)).all())
                worst = std::max<double>(worst, std::abs(out.at(n, 20, 20) - value(x)));
        }
        EXPECT_LT(worst, allowed) << how;
        EXPECT_GT(worst, 0) << how;
    }
}

TEST(Warp, WhatTheBodyLeftIsEmptyAndTheRestStays) {
    const WarpedBlock block;
    block.write_result("result.h5", {three_right});
    write_image(block.folder / "mr.nii.gz", block.image<float>([](const Vector3& x) {
        return static_cast<float>(700.5 + 1e3 * x.y());
    }));
    ASSERT_EQ(
        livetet(block.folder, "warp result.h5 --image mr.nii.gz -o out.nii.gz --empty -5").status,
        0);
    const GreyImage before = read_grey_image(block.folder / "mr.nii.gz"),
                    after = read_grey_image(block.folder / "out.nii.gz");
    int first = 0;
    while (block.place(first, 20, 20).x() < 0) ++first;
    EXPECT_EQ(after.at(first, 20, 20), -5);
    EXPECT_EQ(after.at(first + 1, 20, 20), -5);
    EXPECT_NEAR(after.at(first + 3, 20, 20), before.at(first, 20, 20), 1e-3);
    EXPECT_EQ(after.at(first - 5, 20, 20), before.at(first - 5, 20, 20));
    EXPECT_EQ(after.at(20, 0, 0), before.at(20, 0, 0));
}

TEST(Warp, OfASolveOnTenNodeTets) {
    // Without lateral contraction a block that is pulled stretches evenly.
    WarpedBlock block;
    block.write_meshed();
    write_text(block.folder / "scene.yaml", R"(
mesh: {file: block.h5}
elements: P2
materials: [{young_Pa: 3000, poisson: 0}]
fix: [{box_mm: [-1, -1, -1, 61, 51, 0.1]}]
drive: [{box_mm: [-1, -1, 39.9, 61, 51, 41], displacement_mm: [0, 0, 8]}]
)");
    const auto solved = livetet(block.folder, "solve scene.yaml");
    ASSERT_EQ(solved.status, 0) << solved.err;
    const auto outcome =
        livetet(block.folder, "warp result.h5 -o out.nii.gz --inverse-field inverse.nii");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const LabelImage before = read_label_image(block.folder / "labels.nii.gz"),
                     after = read_label_image(block.folder / "out.nii.gz");
    const auto count = [](const LabelImage& image) {
        return static_cast<double>(std::count(image.values.begin(), image.values.end(), 1));
    };
    EXPECT_NEAR(count(after) / count(before), 1.2, 0.001);
}

TEST(Warp, OfAResultThatWasCutOffWhatIsWholeIsUsed) {
    const WarpedBlock block;
    block.write_meshed();
    {
        ResultWriter writer(block.folder / "result.h5", block.mesh, "mesh: {file: block.h5}\n");
        writer.append(0, block.displaced(stay));
        writer.append(1, block.displaced(three_right));
        writer.flush();
        for (const auto& entry : std::filesystem::directory_iterator(block.folder.path()))
            if (entry.path().filename().string().starts_with(".result.part"))
                std::filesystem::copy_file(entry.path(), block.folder / "cut.h5");
    }
    const auto outcome = livetet(block.folder, "warp cut.h5 -o out.nii.gz --json told.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(text_of(block.folder / "told.json"))["frame"], 2);
    EXPECT_EQ(read_label_image(block.folder / "out.nii.gz").at(30, 20, 20), 1);
    std::filesystem::resize_file(block.folder / "cut.h5",
                                 2000);  // within the mesh; behind the frames lies room for more
    expect_refused(livetet(block.folder, "warp cut.h5 -o other.nii.gz"), {"cut.h5"});
    EXPECT_FALSE(std::filesystem::exists(block.folder / "other.nii.gz"));
}

TEST(Warp, BadInputIsOneLineAndNothingIsWritten) {
    const WarpedBlock block;
    block.write_meshed();
    block.write_result("result.h5", {stay, three_right});
    block.write_result("surface.h5", {stay}, "liver.stl");
    block.write_result("lost.h5", {stay}, "elsewhere/mesh.h5");
    ResultWriter(block.folder / "empty.h5", block.mesh, "mesh: {file: block.h5}\n").close();
    const auto refused = [&](const std::string& arguments,
                             std::initializer_list<std::string> parts) {
        expect_refused(livetet(block.folder, "warp " + arguments), parts);
        EXPECT_FALSE(std::filesystem::exists(block.folder / "out.nii.gz")) << arguments;
    };
    refused("result.h5", {"nothing to write", "-o", "--inverse-field"});
    refused("result.h5 -o out.nii.gz --frame 3",
            {"result.h5", "holds 2 frames", "--frame 3", "1 to 2"});
    refused("result.h5 -o out.nii.gz --frame 0", {"--frame 0", "1 to 2"});
    refused("result.h5 -o out.nii.gz --frame -1", {"--frame -1", "1 to 2"});
    refused("result.h5 -o labels.nii.gz", {"labels.nii.gz", "is read"});
    refused("result.h5 -o out.nii.gz --time 11.5", {"result.h5", "10 to 11 s", "11.5"});
    refused("result.h5 -o out.nii.gz --frames 1,2", {"out.nii.gz", "2 frames", "{frame}"});
    refused("result.h5 -o out.nii.gz --rind-mm 1e6", {"--rind-mm", "1000"});
    refused("result.h5 -o out.nii.gz --empty inf", {"--empty inf", "finite"});
    refused("result.h5 -o out.nii.gz --empty 1e30", {"--empty 1e+30", "label", "2147483647"});
    refused("result.h5 -o out.nii.gz --image ''", {"--image", "empty text"});
    refused("result.h5 -o out.png", {"out.png", "'.png'", ".nii"});
    refused("empty.h5 -o out.nii.gz", {"empty.h5", "no frame"});
    refused("nowhere.h5 -o out.nii.gz", {"nowhere.h5"});
    refused("block.h5 -o out.nii.gz", {"block.h5", "livetet result"});  // a hierarchy is no result
    refused("surface.h5 -o out.nii.gz", {"surface.h5", "liver.stl", "no image", "--image"});
    refused("lost.h5 -o out.nii.gz", {"lost.h5", "elsewhere/mesh.h5", "not there", "--image"});
    refused("result.h5 -o labels.nii.gz --image labels.nii.gz", {"labels.nii.gz", "another file"});
    refused("result.h5 -o out.nii.gz --inverse-field out.nii.gz", {"out.nii.gz", "two files"});
    refused("result.h5 -o nofolder/out.nii.gz", {"nofolder"});
    refused("result.h5 -o out.nii.gz --empty 0.5", {"--empty 0.5", "label"});

    // An image of another place; and the image that was meshed, exchanged for one on other voxels.
    LabelImage image = read_label_image(block.folder / "labels.nii.gz");
    image.ras_from_voxel(0, 3) += 0.5;
    write_image(block.folder / "far.nii.gz", image);
    refused("result.h5 -o out.nii.gz --image far.nii.gz",
            {"far.nii.gz", "another place", "(0.00, 0.00, 0.00) mm to (60.00, 50.00, 40.00) mm"});
    refused("result.h5 -o out.nii.gz --grid far.nii.gz", {"far.nii.gz", "another place"});
    write_image(block.folder / "labels.nii.gz", image);
    refused("result.h5 -o out.nii.gz", {"labels.nii.gz", "same place", "--image"});

    // A result whose mesh is gone.
    const std::string text = text_of(block.folder / "result.h5");
    write_text(block.folder / "short.h5", text.substr(0, text.size() / 3));
    refused("short.h5 -o out.nii.gz", {"short.h5"});
}

TEST(Warp, ADiskThatIsFullIsOneLineAndNoFile) {
    const WarpedBlock block;
    block.write_meshed();
    block.write_result("result.h5", {three_right});
    // No file may grow beyond a few blocks, as on a disk that is full.
    const auto outcome =
        livetet(block.folder, "warp result.h5 -o out.nii --forward-field field.nii",
                "trap '' XFSZ; ulimit -f 40;");
    expect_refused(outcome, {"out.nii", "cannot be written"});
    EXPECT_FALSE(std::filesystem::exists(block.folder / "out.nii"));
    for (const auto& entry : std::filesystem::directory_iterator(block.folder.path()))
        EXPECT_EQ(entry.path().filename().string().find(".part"), std::string::npos)
            << entry.path();
}

}  // namespace
}  // namespace livetet
