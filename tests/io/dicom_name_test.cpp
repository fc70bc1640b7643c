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

TEST(DicomName, FilesMadeFromAFolderHaveItsWholeName) {
    const auto folder = fresh_folder();
    std::filesystem::create_directories(folder / "1.2.84");
    for (const std::string end : {"1.2.84", "1.2.84/"})
        EXPECT_EQ(derived_filename(folder.string() + "/" + end, ".failed.stl"),
                  "1.2.84.failed.stl");
    EXPECT_EQ(derived_filename(folder.string() + "/1.2.84/#4", ".failed.stl"),
              "1.2.84#4.failed.stl");
    EXPECT_EQ(derived_filename("a/seg.dcm#1,2", ".failed.stl"), "seg.failed.stl");
    EXPECT_EQ(derived_filename("a/ball.stl", ".failed.stl"), "ball.failed.stl");
}

TEST(DicomName, AFileWithTheSignInItsNameIsThatFile) {
    const auto folder = fresh_folder();
    const auto path = write_bytes(folder / "a.dcm#1.dcm", "x");
    write_bytes(folder / "a.dcm", "x");
    EXPECT_EQ(dicom_name(path)->place, path);
    EXPECT_EQ(dicom_name(path)->choice, "");
}

TEST(DicomName, ASignInAFoldersNameIsNoChoice) {
    const auto folder = fresh_folder();
    for (const char* name : {"cases", "cases#2", "cases#2/ct"})
        std::filesystem::create_directories(folder / name);
    const std::string image = folder.string() + "/cases#2/ct.nii.gz";
    EXPECT_FALSE(dicom_name(image));
    EXPECT_EQ(image_place(image), image);
    EXPECT_EQ(image_filename(image), "ct.nii.gz");
    const auto name = dicom_name(folder.string() + "/cases#2/ct#4");
    ASSERT_TRUE(name);
    EXPECT_EQ(name->place, folder / "cases#2" / "ct");
    EXPECT_EQ(name->choice, "4");
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
