#include "io/dicom_name.hpp"

#include "files.hpp"

namespace livetet {
namespace {

using namespace testing_files;

TEST(DicomName, IsTakenApartAtTheSign) {
    const auto folder = fresh_folder();
    std::filesystem::create_directories(folder / "ct");
    for (const std::string end : {"ct", "ct/", "ct#4", "ct/#4"}) {
        const auto name = dicom_name(folder.string() + "/" + end);
        ASSERT_TRUE(name) << end;
        EXPECT_EQ(name->place, folder / "ct") << end;
        EXPECT_EQ(name->choice, end.ends_with('4') ? "4" : "") << end;
    }
    EXPECT_EQ(image_filename(folder.string() + "/ct/#4"), "ct#4");
    EXPECT_EQ(image_filename(folder.string() + "/ct/"), "ct");
    EXPECT_EQ(image_place(folder.string() + "/ct/#4"), folder / "ct");
    EXPECT_EQ(dicom_name("gone.dcm#1,2")->choice, "1,2");
    EXPECT_EQ(image_filename("a/b.nrrd"), "b.nrrd");
}

TEST(DicomName, AFileWithTheSignInItsNameIsThatFile) {
    const auto folder = fresh_folder();
    const auto path = write_bytes(folder / "a.dcm#1.dcm", "x");
    write_bytes(folder / "a.dcm", "x");
    EXPECT_EQ(dicom_name(path)->place, path);
    EXPECT_EQ(dicom_name(path)->choice, "");
}

TEST(DicomName, FilesWithoutAnExtensionAreKnownByTheirMark) {
    const auto folder = fresh_folder();
    const auto marked = write_bytes(folder / "IM01", std::string(128, '\0') + "DICM"),
               other = write_bytes(folder / "IM02", std::string(128, '\0') + "DACM"),
               nifti = write_bytes(folder / "a.nii", std::string(128, '\0') + "DICM");
    EXPECT_TRUE(dicom_name(marked));
    EXPECT_FALSE(dicom_name(other));
    EXPECT_FALSE(dicom_name(nifti));
    EXPECT_FALSE(dicom_name(folder / "none"));
    EXPECT_FALSE(dicom_name(""));
}

}  // namespace
}  // namespace livetet
