#ifdef LIVETET_IMAGES
#include <nlohmann/json.hpp>

#include "apps/commands/warped_block.hpp"
#include "io/dicom_writer.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::livetet;
using test::text_of;
using test::WarpedBlock;
namespace fs = std::filesystem;

/// The block's image as slices: voxel (i, j, k) is 30 k + i + 40 j, less 1024.
void write_block_series(const WarpedBlock& block) {
    fs::create_directories(block.folder / "ct");
    for (int k = 0; k < 40; ++k) {
        testing_dicom::Slice slice;
        const Vector3 x = 1e3 * block.place(0, 0, k);
        slice.position = {-x.x(), -x.y(), x.z()};
        slice.orientation = {-1, 0, 0, 0, -1, 0};
        slice.spacing = {2.5, 3};
        slice.columns = slice.rows = 40;
        slice.first_value = 30 * k;
        slice.intercept = -1024;
        testing_dicom::write_slice(block.folder / ("ct/s" + std::to_string(k)), slice);
    }
}

Vector3 moved_by_three(const Vector3& x) { return x + Vector3(9e-3, 0, 0); }

/// Whether a folder holds anything that a run has left half-written.
bool has_parts(const fs::path& folder) {
    return std::any_of(
        fs::directory_iterator(folder), fs::directory_iterator(),
        [](const auto& entry) { return entry.path().string().find(".part") != std::string::npos; });
}

TEST(WarpDicom, ASeriesComesBackAsASeries) {
    const WarpedBlock block;
    write_block_series(block);
    block.write_result("result.h5", {moved_by_three});
    const auto outcome = livetet(block.folder,
                                 "warp result.h5 --image ct -o out/ --registration reg.dcm "
                                 "--rind-mm 0 --json told.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const GreyImage before = read_grey_image(block.folder / "ct"),
                    after = read_grey_image(block.folder / "out");
    ASSERT_EQ(after.size, before.size);
    EXPECT_EQ(after.ras_from_voxel, before.ras_from_voxel);
    EXPECT_EQ(before.at(1, 2, 3), 30 * 3 + 1 + 80 - 1024);
    int carried = 0;
    for (int i = 0; i < 40; ++i) {
        const double rest = block.place(i - 3, 20, 20).x();
        const bool inside = rest > 1e-4 && rest < 0.06 - 1e-4;
        carried += inside;
        if (inside) {
            EXPECT_EQ(after.at(i, 20, 20), before.at(i - 3, 20, 20)) << i;
        }
    }
    EXPECT_GT(carried, 15);
    EXPECT_EQ(after.at(2, 20, 20), before.at(2, 20, 20));
    EXPECT_EQ(nlohmann::json::parse(text_of(block.folder / "told.json"))["clamped"], 0);
    EXPECT_EQ(std::distance(fs::directory_iterator(block.folder / "out"), {}), 40);
    EXPECT_GT(fs::file_size(block.folder / "reg.dcm"), 40 * 40 * 40 * 12u);
    // What describes a patient is in no output.
    for (const std::string& text : {outcome.out, outcome.err, text_of(block.folder / "told.json")})
        EXPECT_EQ(text.find("Secret"), std::string::npos) << text;
    EXPECT_FALSE(has_parts(block.folder.path()));
    expect_refused(livetet(block.folder, "warp result.h5 --image ct -o out"),
                   {"out", "holds files", "empty"});
}

TEST(WarpDicom, WhatIsNotDerivedFromDicomIsRefused) {
    const WarpedBlock block;
    block.write_meshed();
    write_block_series(block);
    block.write_result("result.h5", {moved_by_three});
    const auto refused = [&](const std::string& arguments,
                             std::initializer_list<std::string> parts) {
        expect_refused(livetet(block.folder, "warp result.h5 " + arguments), parts);
        EXPECT_FALSE(fs::exists(block.folder / "out")) << arguments;
        EXPECT_FALSE(fs::exists(block.folder / "reg.dcm")) << arguments;
        EXPECT_FALSE(has_parts(block.folder.path())) << arguments;
    };
    refused("-o out/", {"out/", "labels.nii.gz", "no DICOM", "--image"});
    refused("--registration reg.dcm", {"reg.dcm", "labels.nii.gz", "no DICOM"});
    refused("--image ct --registration reg.nii.gz", {"reg.nii.gz", ".dcm"});
    refused("--image ct -o out/ --grid labels.nii.gz", {"--grid labels.nii.gz", "DICOM series"});
    refused("--image ct -o out.nrrd", {"out.nrrd", "'.nrrd'", "folder"});
    refused("--image ct -o ct", {"ct"});
    refused("--image ct --registration ct/s3", {"ct/s3", ".dcm"});
    // No file may grow beyond 512 kB, as on a disk that is full: the registration has 768 kB.
    expect_refused(livetet(block.folder, "warp result.h5 --image ct --registration reg.dcm",
                           "trap '' XFSZ; ulimit -f 1000;"),
                   {"reg.dcm", "cannot be written"});
    EXPECT_FALSE(fs::exists(block.folder / "reg.dcm"));
    EXPECT_FALSE(has_parts(block.folder.path()));
}

}  // namespace
}  // namespace livetet
#endif
