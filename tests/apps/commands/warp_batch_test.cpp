#include <nlohmann/json.hpp>

#include "apps/commands/warped_block.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::livetet;
using test::text_of;
using test::WarpedBlock;
namespace fs = std::filesystem;

/// Motions by 0, 1, 2 and so on voxels of the upright grid.
std::vector<WarpedBlock::Move> steps(int count) {
    std::vector<WarpedBlock::Move> moves;
    for (int n = 0; n < count; ++n)
        moves.push_back([n](const Vector3& x) { return Vector3(x + Vector3(3e-3 * n, 0, 0)); });
    return moves;
}

TEST(WarpBatch, ManyFramesAreWhatEachOfThemIs) {
    const WarpedBlock block;
    block.write_meshed();
    block.write_result("result.h5", steps(10));
    const auto outcome = livetet(block.folder,
                                 "warp result.h5 --frames 1:10:3 -o out_{frame}.nii.gz "
                                 "--inverse-field u_{frame}.nii --json told.json --threads 3");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto told = nlohmann::json::parse(text_of(block.folder / "told.json"));
    ASSERT_EQ(told["frames"].size(), 4u);
    for (int n = 0; n < 4; ++n) {
        const std::string frame = std::to_string(1 + 3 * n);
        ASSERT_EQ(livetet(block.folder, "warp result.h5 -o one.nii.gz --frame " + frame).status, 0);
        const std::string name = "out_" + std::string(2 - frame.size(), '0') + frame + ".nii.gz";
        EXPECT_EQ(text_of(block.folder / name), text_of(block.folder / "one.nii.gz")) << name;
        EXPECT_EQ(told["frames"][n]["frame"], 1 + 3 * n);
    }
    EXPECT_NE(text_of(block.folder / "out_01.nii.gz"), text_of(block.folder / "out_10.nii.gz"));
    EXPECT_TRUE(fs::exists(block.folder / "u_07.nii"));
    EXPECT_FALSE(fs::exists(block.folder / "out_02.nii.gz"));
}

TEST(WarpBatch, SeveralResultsAreWarpedInOneCall) {
    const WarpedBlock block;
    block.write_meshed();
    for (const int n : {1, 2}) {
        const std::string run = "run" + std::to_string(n);
        fs::create_directories(block.folder / run);
        block.write_result(run + "/result.h5", steps(n + 1), "../block.h5");
    }
    const auto outcome =
        livetet(block.folder, "warp run1/result.h5 run2/result.h5 -o {folder}/{result}.nii.gz");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto first = [&](const char* file) {
        const LabelImage image = read_label_image(block.folder / file);
        int i = 0;
        while (i < 40 && image.at(i, 20, 20) != 1) ++i;
        return i;
    };
    EXPECT_EQ(first("run2/result.nii.gz"), first("run1/result.nii.gz") + 1);
}

TEST(WarpBatch, TheFirstErrorNamesItsFile) {
    const WarpedBlock block;
    block.write_meshed();
    block.write_result("result.h5", steps(5));
    const auto refused = [&](const std::string& arguments,
                             std::initializer_list<std::string> parts) {
        expect_refused(livetet(block.folder, "warp " + arguments), parts);
        for (const auto& entry : fs::directory_iterator(block.folder.path()))
            EXPECT_FALSE(entry.path().filename().string().starts_with("out")) << entry.path();
    };
    // Known before anything is written.
    refused("result.h5 --frames 1:5 -o out.nii.gz", {"out.nii.gz", "5 frames", "{frame}"});
    refused("result.h5 nowhere.h5 -o out_{result}.nii.gz", {"nowhere.h5"});
    refused("result.h5 --frames 4:6 -o out_{frame}.nii.gz",
            {"result.h5", "5 frames", "--frames 4:6", "1 to 5"});
    refused("result.h5 --frames 1:5 -o out_{fram}.nii.gz", {"{fram}", "{frame}"});
    // The image of the second result is not there: the first may be complete, none is half-written.
    block.write_result("lost.h5", steps(1), "elsewhere/mesh.h5");
    const auto outcome = livetet(
        block.folder, "warp result.h5 lost.h5 -o done_{result}.nii.gz --threads 1 --json j.json");
    expect_refused(outcome, {"lost.h5", "elsewhere/mesh.h5", "1 of 2 frames"});
    EXPECT_TRUE(fs::exists(block.folder / "done_result.nii.gz"));
    EXPECT_FALSE(fs::exists(block.folder / "done_lost.nii.gz"));
    EXPECT_FALSE(fs::exists(block.folder / "j.json"));
    for (const auto& entry : fs::directory_iterator(block.folder.path()))
        EXPECT_EQ(entry.path().string().find(".part"), std::string::npos) << entry.path();
}

TEST(ReportBatch, OneThatCannotBeReadStopsNoOther) {
    const WarpedBlock block;
    block.write_meshed();
    for (const char* name : {"a.h5", "b.h5"}) block.write_result(name, steps(2));
    test::write_text(block.folder / "bad.h5", "no HDF5");
    const auto outcome =
        livetet(block.folder, "report a.h5 bad.h5 b.h5 --no-pictures --json {result}.json");
    expect_refused(outcome, {"bad.h5", "2 of 3 reports"});
    for (const char* name : {"a", "b"}) {
        EXPECT_TRUE(fs::exists(block.folder / (std::string(name) + ".report") / "report.txt"));
        EXPECT_TRUE(nlohmann::json::accept(text_of(block.folder / (std::string(name) + ".json"))));
    }
    EXPECT_FALSE(fs::exists(block.folder / "bad.report"));
    ASSERT_EQ(livetet(block.folder, "report a.h5 --no-pictures -o one").status, 0);
    EXPECT_EQ(text_of(block.folder / "one" / "report.txt"),
              text_of(block.folder / "a.report" / "report.txt"));
    expect_refused(livetet(block.folder, "report a.h5 b.h5 --no-pictures -o both"),
                   {"a.h5", "b.h5", "both", "{result}"});
}

}  // namespace
}  // namespace livetet
