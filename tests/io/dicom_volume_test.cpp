#ifdef LIVETET_IMAGES
#include "io/dicom_volume.hpp"

#include <fmt/format.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>

#include <algorithm>

#include "dicom_writer.hpp"
#include "files.hpp"
#include "io/image_file.hpp"

namespace livetet {
namespace {

using namespace testing_files;
using namespace testing_dicom;

namespace fs = std::filesystem;

/// Same voxels at the same places, to a micrometre.
void expect_same_image(const LabelImage& found, const LabelImage& expected) {
    ASSERT_EQ(found.size, expected.size);
    EXPECT_LT((found.ras_from_voxel - expected.ras_from_voxel).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_EQ(found.values, expected.values);
}

Eigen::Vector3d place_mm(const LabelImage& image, double i, double j, double k) {
    return 1e3 * (image.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>();
}

TEST(DicomVolume, RealSegmentationsEqualTheirAnswers) {
    LIVETET_DATA_OR_SKIP(data);
    const fs::path dicom = data / "dicom";
    expect_same_image(read_label_image(dicom / "liver.dcm"),
                      read_label_image(dicom / "liver_seg.nrrd"));
    expect_same_image(read_label_image(dicom / "23x38x3" / "seg" / "label.seg"),
                      read_label_image(dicom / "23x38x3" / "nrrd" / "label.nrrd"));
    EXPECT_EQ(read_volume(dicom / "liver.dcm").label_names.at(1), "Liver");
}

TEST(DicomVolume, OneRealVolumeAsSlicesAndAsFramesIsTheSame) {
    LIVETET_DATA_OR_SKIP(data);
    const fs::path dicom = data / "dicom" / "23x38x3";
    // The image is the segmentation without the corners of each slice.
    LabelImage answer = read_label_image(dicom / "nrrd" / "label.nrrd");
    ASSERT_EQ(answer.size, (std::array<int, 3>{23, 38, 3}));
    for (int k = 0; k < 3; ++k)
        for (const int i : {0, 22})
            for (const int j : {0, 37}) answer.at(i, j, k) = 0;
    expect_same_image(read_label_image(dicom / "image"), answer);
    expect_same_image(read_label_image(dicom / "image" / "IMG0002.dcm"), answer);
    expect_same_image(read_label_image(dicom / "multiframe" / "mf.dcm"), answer);
    expect_same_image(read_label_image(dicom / "multiframe"), answer);
}

TEST(DicomVolume, ARealSeriesHasHounsfieldUnits) {
    LIVETET_DATA_OR_SKIP(data);
    const fs::path dicom = data / "dicom";
    const GreyImage ct = read_grey_image(dicom / "ct-3slice");
    const LabelImage liver = read_label_image(dicom / "liver.dcm");
    ASSERT_EQ(ct.size, liver.size);
    EXPECT_LT((ct.ras_from_voxel - liver.ras_from_voxel).cwiseAbs().maxCoeff(), 1e-6);
    double sum = 0, count = 0;
    for (std::size_t n = 0; n < ct.values.size(); ++n)
        if (liver.values[n] != 0) {
            sum += ct.values[n];
            ++count;
        }
    ASSERT_GT(count, 1000);
    EXPECT_GT(sum / count, 20);  // liver, with or without contrast medium
    EXPECT_LT(sum / count, 180);
    EXPECT_LE(*std::min_element(ct.values.begin(), ct.values.end()), -900);  // air
}

TEST(DicomVolume, ASeriesIsSortedByPlaceAndScaled) {
    const fs::path folder = fresh_folder();
    auto slices = series_of(3);
    for (Slice& s : slices) s.intercept = -1024;
    write_series(folder / "ct", slices);
    for (const fs::path& path : {folder / "ct", folder / "ct" / "s1.dcm", folder / "ct" / ""}) {
        SCOPED_TRACE(path.string());
        const LabelImage image = read_label_image(path);
        ASSERT_EQ(image.size, (std::array<int, 3>{4, 3, 3}));
        // LPS (10, 20, 30) is RAS (-10, -20, 30); columns are 0.5 mm apart, rows 2 mm, slices 3 mm.
        EXPECT_LT((place_mm(image, 0, 0, 0) - Eigen::Vector3d(-10, -20, 30)).norm(), 1e-9);
        EXPECT_LT((place_mm(image, 2, 1, 2) - Eigen::Vector3d(-11, -22, 36)).norm(), 1e-9);
        EXPECT_EQ(image.at(0, 0, 0), 200 - 1024);
        EXPECT_EQ(image.at(3, 2, 0), 211 - 1024);
        EXPECT_EQ(image.at(1, 0, 2), 1 - 1024);
    }
    const Volume volume = read_volume(folder / "ct");
    EXPECT_EQ(volume.type, ScalarType::int32);  // 16 bits less 1024 need more than 16
    EXPECT_EQ(volume.slope, 1);
    EXPECT_EQ(dicom_files({folder / "ct", {}}).size(), 3u);
}

TEST(DicomVolume, SlicesOfDifferentScalesAreScaledEach) {
    const fs::path folder = fresh_folder();
    auto slices = series_of(2);
    slices[0].slope = 0.5;
    slices[1].slope = 0.25;
    write_series(folder, slices);
    const GreyImage image = read_grey_image(folder);
    EXPECT_EQ(image.at(1, 0, 1), 0.5F);
    EXPECT_EQ(image.at(1, 0, 0), 25.25F);
}

TEST(DicomVolume, CompressedSlicesHaveTheSameValues) {
    const fs::path folder = fresh_folder();
    auto slices = series_of(2);
    for (Slice& s : slices) s.columns = 33, s.rows = 20;
    write_series(folder / "raw", slices);
    const LabelImage expected = read_label_image(folder / "raw");
    for (const auto syntax :
         {gdcm::TransferSyntax::JPEGLosslessProcess14_1, gdcm::TransferSyntax::RLELossless,
          gdcm::TransferSyntax::JPEG2000Lossless, gdcm::TransferSyntax::JPEGLSLossless,
          gdcm::TransferSyntax::ImplicitVRLittleEndian}) {
        SCOPED_TRACE(gdcm::TransferSyntax::GetTSString(syntax));
        const fs::path packed = folder / gdcm::TransferSyntax::GetTSString(syntax);
        fs::create_directories(packed);
        for (const char* name : {"s0.dcm", "s1.dcm"}) {
            gdcm::ImageReader reader;
            reader.SetFileName((folder / "raw" / name).c_str());
            ASSERT_TRUE(reader.Read());
            gdcm::ImageChangeTransferSyntax change;
            change.SetTransferSyntax(syntax);
            change.SetInput(reader.GetImage());
            ASSERT_TRUE(change.Change());
            gdcm::ImageWriter writer;
            writer.SetFile(reader.GetFile());
            writer.SetImage(change.GetOutput());
            writer.SetFileName((packed / name).c_str());
            ASSERT_TRUE(writer.Write());
        }
        expect_same_image(read_label_image(packed), expected);
        fs::resize_file(packed / "s1.dcm", fs::file_size(packed / "s1.dcm") - 40);
        EXPECT_TRUE(says(error_of([&] { read_label_image(packed); }), {"s1.dcm"}));
    }
}

TEST(DicomVolume, ObliqueSlicesStepAlongTheirNormal) {
    const fs::path folder = fresh_folder();
    std::vector<Slice> slices(2);
    for (Slice& s : slices) s.orientation = {0.6, 0.8, 0, 0, 0, -1};
    // The normal is (-0.8, 0.6, 0).
    slices[1].position = {10 - 0.8 * 2, 20 + 0.6 * 2, 30};
    write_series(folder, slices);
    const LabelImage image = read_label_image(folder);
    EXPECT_LT((place_mm(image, 0, 0, 1) - Eigen::Vector3d(-8.4, -21.2, 30)).norm(), 1e-6);
    EXPECT_LT((place_mm(image, 2, 1, 0) - Eigen::Vector3d(-10.6, -20.8, 28)).norm(), 1e-6);
}

TEST(DicomVolume, FoldersOfSeveralSeriesAreListedAndOneIsChosen) {
    const fs::path folder = fresh_folder();
    auto first = series_of(2), second = series_of(3);
    for (Slice& s : second) s.series = "1.2.826.0.1.22222222", s.number = "8", s.modality = "MR";
    write_series(folder, second);
    for (std::size_t n = 0; n < first.size(); ++n)
        write_slice(folder / fmt::format("t{}", n), first[n]);  // without an extension
    write_bytes(folder / "notes.txt", "no image");
    const std::string error = error_of([&] { read_label_image(folder); });
    EXPECT_TRUE(says(
        error, {"2 series", "#7 (CT, 4 x 3 pixels, 2 slices)", "#8 (MR, 4 x 3 pixels, 3 slices)"}));
    EXPECT_EQ(error.find("Secret"), std::string::npos) << error;
    EXPECT_EQ(read_label_image(folder.string() + "#7").size[2], 2);
    EXPECT_EQ(read_label_image(folder.string() + "/#8").size[2], 3);
    EXPECT_EQ(read_label_image(folder.string() + "#1.2.826.0.1.22222222").size[2], 3);
    EXPECT_EQ(read_label_image(folder / "t0").size[2], 2);
    EXPECT_TRUE(says(error_of([&] { read_label_image(folder.string() + "#9"); }), {"'9'", "#7"}));
    // Numbers that two series share do not choose.
    for (std::size_t n = 0; n < first.size(); ++n) {
        first[n].number = "8";
        write_slice(folder / fmt::format("t{}", n), first[n]);
    }
    EXPECT_TRUE(says(error_of([&] { read_label_image(folder.string() + "#8"); }),
                     {"#11111111", "#22222222"}));
    EXPECT_EQ(read_label_image(folder.string() + "#11111111").size[2], 2);
}

TEST(DicomVolume, FilesOfOtherSeriesAndHiddenOnesDoNotMatter) {
    const fs::path folder = fresh_folder();
    write_series(folder, series_of(2));
    write_bytes(folder / "._s0.dcm", "resource fork");
    EXPECT_EQ(read_label_image(folder).size[2], 2);
    gdcm::DataSet report = slice_elements({});  // no image, in a series of its own
    for (const int element : {0x0010, 0x0011}) report.Remove(gdcm::Tag(0x0028, element));
    put(report, 0x0020, 0x000e, gdcm::VR::UI, "1.2.826.0.1.33333333");
    write_object(folder / "report.dcm", report, ct_image);
    EXPECT_EQ(read_label_image(folder).size[2], 2);
    Slice strange;
    strange.series = "1.2.826.0.1.22222222", strange.number = "8";
    write_slice(folder / "t0.dcm", strange);
    gdcm::DataSet set = slice_elements(strange);
    put(set, 0x0028, 0x0008, gdcm::VR::IS, "0");  // frames
    write_object(folder / "t1.dcm", set, ct_image);
    EXPECT_EQ(read_label_image(folder.string() + "#7").size[2], 2);
    EXPECT_EQ(read_label_image(folder / "s0.dcm").size[2], 2);
    for (const std::string name : {"#8", "#1.2.826.0.1.22222222", "/t0.dcm"})
        EXPECT_TRUE(says(error_of([&] { read_label_image(folder.string() + name); }),
                         {"t1.dcm", "0 frames"}));
    fs::remove(folder / "t0.dcm");  // the faulty series may be the one that is meant
    EXPECT_TRUE(says(error_of([&] { read_label_image(folder); }), {"t1.dcm", "0 frames"}));
    EXPECT_EQ(read_label_image(folder.string() + "#7").size[2], 2);
}

/// A series of four slices of which one is changed.
class DicomRefusals : public testing::Test {
  protected:
    void refuses(const std::function<void(std::vector<Slice>&)>& change,
                 std::initializer_list<const char*> words) const {
        auto slices = series_of(4);
        change(slices);
        fs::remove_all(folder);
        write_series(folder, slices);
        const std::string error = error_of([&] { read_grey_image(folder); });
        EXPECT_TRUE(says(error, words));
        EXPECT_EQ(error.find("Secret"), std::string::npos) << error;
    }
    const fs::path folder = fresh_folder() / "ct";
};

TEST_F(DicomRefusals, NameTheSlice) {
    refuses([](auto& s) { s.erase(s.begin() + 1); },
            {"s0.dcm", "6 mm above", "1 slice", "missing"});
    refuses([](auto& s) { s[2].columns = 5; }, {"s2.dcm", "5 x 3", "4 x 3", "s0.dcm"});
    refuses([](auto& s) { s[2].spacing = {2, 0.6}; }, {"s2.dcm", "0.6 x 2 mm", "0.5 x 2 as in"});
    refuses([](auto& s) { s[1].orientation = {0, 1, 0, 0, 0, 1}; }, {"s1.dcm", "turned"});
    refuses([](auto& s) { s[3].position = s[0].position; }, {"s3.dcm", "at the position of"});
    refuses([](auto& s) { s[1].position[2] += 1; }, {"mm above", "expected 3 mm"});
    refuses(
        [](auto& s) {
            for (int n = 0; n < 4; ++n) s[n].position[1] += 0.8 * n;
        },
        {"s2.dcm", "0.8 mm against", "s3.dcm", "gantry tilt of 14.9 degrees"});
    refuses([](auto& s) { s[1].slope = 0; }, {"s1.dcm", "Rescale Slope", "0"});
    refuses([](auto& s) { s[1].orientation = {1, 0, 0, 0.5, 1, 0}; }, {"s1.dcm", "right angles"});
    refuses([](auto& s) { s[1].position[0] = NAN; }, {"s1.dcm", "Image Position"});
    refuses([](auto& s) { s.clear(); }, {"ct", "no DICOM image"});
    refuses(
        [](auto& s) {
            s.resize(1);
            s[0].thickness = 0;
        },
        {"one slice"});
}

TEST_F(DicomRefusals, AreGivenForPixelsThatAreNotThere) {
    write_series(folder, series_of(2));
    fs::resize_file(folder / "s1.dcm", fs::file_size(folder / "s1.dcm") - 4);
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder); }),
                     {"s1.dcm", "20 bytes of pixels", "expected 24", "truncated"}));
    write_slice(folder / "s1.dcm", series_of(2)[1]);
    gdcm::DataSet set = slice_elements(series_of(2)[1]);
    put_integer(set, 0x0028, 0x0010, 60000);  // rows
    put_integer(set, 0x0028, 0x0011, 60000);
    fs::remove(folder / "s0.dcm");
    write_object(folder / "s1.dcm", set, ct_image);
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder); }),
                     {"s1.dcm", "24 bytes of pixels", "7200000000"}));
    put(set, 0x0028, 0x0004, gdcm::VR::CS, "PALETTE COLOR");
    write_object(folder / "s1.dcm", set, ct_image);
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder); }),
                     {"s1.dcm", "'PALETTE COLOR'", "MONOCHROME1 or MONOCHROME2"}));
    put_integer(set, 0x0028, 0x0002, 3);
    write_object(folder / "s1.dcm", set, ct_image);
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder); }), {"s1.dcm", "3 values a pixel"}));
    write_bytes(folder / "s1.dcm", "no DICOM");
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder); }), {"s1.dcm", "damaged"}));
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder / "none.dcm"); }),
                     {"none.dcm", "no such file"}));
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder / "none.dcm#2"); }),
                     {"none.dcm", "no such file"}));
}

TEST_F(DicomRefusals, AreGivenForFilesOfTheSeriesThatAreNoImages) {
    write_series(folder, series_of(3));
    gdcm::DataSet set = slice_elements(series_of(3)[2]);
    set.Remove(gdcm::Tag(0x0028, 0x0010));  // rows
    write_object(folder / "s2.dcm", set, ct_image);
    for (const fs::path& path : {folder, folder / "s0.dcm"})
        EXPECT_TRUE(says(error_of([&] { read_grey_image(path); }),
                         {"s2.dcm", "no Rows or Columns", "series"}));
}

TEST_F(DicomRefusals, AreGivenForFramesWithoutPositions) {
    gdcm::DataSet set = slice_elements({});
    put(set, 0x0028, 0x0008, gdcm::VR::IS, "2");
    put(set, 0x7fe0, 0x0010, gdcm::VR::OW, words({}) + words({}));
    fs::create_directories(folder);
    write_object(folder / "m.dcm", set, enhanced_ct_image);
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder / "m.dcm"); }),
                     {"m.dcm", "2 frames without positions"}));
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder / "m.dcm#1"); }), {"m.dcm"}));
}

std::string pixels_at(std::initializer_list<int> set, int value = 1) {
    std::string pixels(12, '\0');
    for (const int n : set) pixels[n] = static_cast<char>(value);
    return pixels;
}

TEST(DicomSegmentation, SegmentsBecomeLabelsAndMissingSlicesAreEmpty) {
    const fs::path folder = fresh_folder();
    Segmentation s;
    // Frames of 12 pixels end within bytes; the slice at z = 33 has none; the order is mixed.
    s.frames = {{2, 36, pixels_at({0, 11})}, {1, 30, pixels_at({3})}, {1, 36, pixels_at({1})}};
    write_segmentation(folder / "s.dcm", s);
    for (const double step : {3.0, 0.0, 3.001}) {
        s.step = step;
        if (step == 0) s.frames.push_back({1, 33, pixels_at({})});
        write_segmentation(folder / "s.dcm", s);
        const LabelImage image = read_label_image(folder / "s.dcm");
        ASSERT_EQ(image.size, (std::array<int, 3>{4, 3, 3})) << step;
        std::vector<std::int32_t> expected(36, 0);
        expected[3] = 1;
        expected[24] = expected[35] = 2;
        expected[25] = 1;
        EXPECT_EQ(image.values, expected);
        EXPECT_LT((place_mm(image, 2, 1, 2) - Eigen::Vector3d(-11, -22, 36)).norm(), 1e-6);
    }
    EXPECT_EQ(read_volume(folder / "s.dcm").label_names,
              (std::map<std::int32_t, std::string>{{1, "Liver"}, {2, "Tumour"}}));
    EXPECT_EQ(read_label_image(folder.string() + "/s.dcm#2").values[25], 0);
    EXPECT_EQ(read_label_image(folder).values[25], 1);
}

TEST(DicomSegmentation, OverlappingSegmentsNeedAChoice) {
    const fs::path folder = fresh_folder();
    Segmentation s;
    s.frames = {{1, 30, pixels_at({3, 4})}, {2, 30, pixels_at({4, 5})}};
    const std::string path = (folder / "s.dcm").string();
    write_segmentation(path, s);
    EXPECT_TRUE(says(error_of([&] { read_label_image(path); }),
                     {"1 \"Liver\"", "2 \"Tumour\"", "overlap in 1 voxels", "s.dcm#1,2"}));
    const auto labels = [&](const std::string& choice) {
        const auto values = read_label_image(path + "#" + choice).values;
        return std::vector<std::int32_t>(values.begin() + 3, values.begin() + 6);
    };
    EXPECT_EQ(labels("1,2"), (std::vector<std::int32_t>{1, 2, 2}));
    EXPECT_EQ(labels("2,1"), (std::vector<std::int32_t>{1, 1, 2}));
    EXPECT_EQ(labels("1"), (std::vector<std::int32_t>{1, 1, 0}));
    EXPECT_EQ(labels("tumour"), (std::vector<std::int32_t>{0, 2, 2}));
    EXPECT_TRUE(says(error_of([&] { labels("3"); }), {"'3'", "1 \"Liver\", 2 \"Tumour\""}));
}

TEST(DicomSegmentation, NamesThatDoNotChooseOneSegmentAreRefused) {
    const fs::path path = fresh_folder() / "s.dcm";
    Segmentation s;
    s.names = {"Lesion", "Liver", "lesion"};
    s.frames = {{1, 30, pixels_at({3})}, {3, 30, pixels_at({5})}};
    write_segmentation(path, s);
    const auto read = [&](const std::string& choice) {
        return read_label_image(path.string() + "#" + choice);
    };
    EXPECT_TRUE(says(error_of([&] { read("Lesion"); }),
                     {"2 segments 'Lesion'", "by number", "1 \"Lesion\", 3 \"lesion\""}));
    EXPECT_EQ(read("3").values[5], 3);
    for (const char* choice : {"1,,2", "1,", ",1", "1, ,2", ","})
        EXPECT_TRUE(says(error_of([&] { read(choice); }), {"missing in the choice", "2 \"Liver\""}))
            << choice;
}

TEST(DicomSegmentation, NamesAreShownWithoutControlCharacters) {
    const fs::path path = fresh_folder() / "s.dcm";
    Segmentation s;
    s.names = {"\x1b$B4N", std::string(63, 'a') + "ä" + "b"};
    s.frames = {{1, 30, pixels_at({3})}};
    write_segmentation(path, s);
    EXPECT_EQ(read_volume(path).label_names,
              (std::map<std::int32_t, std::string>{{1, "?$B4N"}, {2, std::string(63, 'a')}}));
    EXPECT_EQ(read_label_image(path.string() + "#" + s.names[1]).values[3], 0);
}

TEST(DicomSegmentation, FractionsCountFromOneHalf) {
    const fs::path path = fresh_folder() / "s.dcm";
    Segmentation s;
    s.type = "FRACTIONAL";
    s.frames = {{1, 30, pixels_at({3, 4}, 49)}, {2, 30, pixels_at({4, 5}, 50)}};
    write_segmentation(path, s);
    const auto values = read_label_image(path).values;
    EXPECT_EQ(std::vector<std::int32_t>(values.begin() + 3, values.begin() + 6),
              (std::vector<std::int32_t>{0, 2, 2}));
    s.full = 0;
    write_segmentation(path, s);
    EXPECT_TRUE(says(error_of([&] { read_label_image(path); }), {"Maximum Fractional Value", "0"}));
}

TEST(DicomSegmentation, LabelMapsHoldSegmentNumbers) {
    const fs::path path = fresh_folder() / "s.dcm";
    Segmentation s;
    s.type = "LABELMAP";
    s.frames = {{0, 30, pixels_at({3}, 1)}, {0, 33, pixels_at({4}, 2)}};
    write_segmentation(path, s);
    const auto values = read_label_image(path).values;
    EXPECT_EQ(values[3], 1);
    EXPECT_EQ(values[16], 2);
    EXPECT_EQ(std::count(values.begin(), values.end(), 0), 22);
    const auto second = read_label_image(path.string() + "#2").values;
    EXPECT_EQ(second[3], 0);
    EXPECT_EQ(second[16], 2);
    s.frames[1].pixels = pixels_at({4}, 9);
    write_segmentation(path, s);
    EXPECT_TRUE(says(error_of([&] { read_label_image(path); }), {"frame 2", "label 9"}));
}

TEST(DicomSegmentation, FramesOfNoSegmentOrPlaceAreRefused) {
    const fs::path path = fresh_folder() / "s.dcm";
    Segmentation s;
    s.frames = {{1, 30, pixels_at({3})}, {3, 33, pixels_at({4})}};
    write_segmentation(path, s);
    EXPECT_TRUE(
        says(error_of([&] { read_label_image(path); }), {"frame 2", "segment 3", "1 \"Liver\""}));
    s.frames = {{1, 30, pixels_at({3})}, {1, 33, pixels_at({3})}, {1, 34, pixels_at({4})}};
    s.step = 3;
    write_segmentation(path, s);
    EXPECT_EQ(read_label_image(path).size[2], 5);  // the smallest gap, below what is stated
    s.frames[2].z = 34.4;
    write_segmentation(path, s);
    EXPECT_TRUE(says(error_of([&] { read_label_image(path); }), {"multiple of 1.4 mm"}));
    s.type = "OTHER";
    write_segmentation(path, s);
    EXPECT_TRUE(says(error_of([&] { read_label_image(path); }), {"'OTHER'", "BINARY"}));
}

TEST(DicomVolume, ContentDigestFollowsTheFilesOfTheSeries) {
    const fs::path folder = fresh_folder();
    auto slices = series_of(3);
    write_series(folder, slices);
    const auto before = content_digest(folder);
    ASSERT_TRUE(before);
    write_bytes(folder / "out.json", "{}");
    EXPECT_EQ(content_digest(folder), before);
    EXPECT_EQ(content_digest(folder / "s0.dcm"), before);
    slices[2].first_value = 1;
    write_series(folder, slices);
    EXPECT_NE(content_digest(folder), before);
}

}  // namespace
}  // namespace livetet
#endif
