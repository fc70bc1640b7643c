#ifdef LIVETET_IMAGES
#include "io/dicom_derived.hpp"

#include <fmt/format.h>
#include <gdcmReader.h>

#include <set>

#include "dicom_writer.hpp"
#include "files.hpp"
#include "io/image_file.hpp"

namespace livetet {
namespace {

using namespace testing_files;
using namespace testing_dicom;

namespace fs = std::filesystem;

gdcm::DataSet elements_of(const fs::path& file) {
    gdcm::Reader reader;
    reader.SetFileName(file.c_str());
    EXPECT_TRUE(reader.Read()) << file;
    return reader.GetFile().GetDataSet();
}

std::string value_of(const gdcm::DataSet& set, std::uint16_t group, std::uint16_t element) {
    const gdcm::Tag tag(group, element);
    if (!set.FindDataElement(tag)) return "missing";
    const gdcm::ByteValue* bytes = set.GetDataElement(tag).GetByteValue();
    std::string text(bytes ? bytes->GetPointer() : "", bytes ? std::size_t(bytes->GetLength()) : 0);
    while (!text.empty() && (text.back() == ' ' || text.back() == '\0')) text.pop_back();
    return text;
}

std::size_t items_in(const gdcm::DataSet& set, std::uint16_t group, std::uint16_t element) {
    const auto items = set.GetDataElement(gdcm::Tag(group, element)).GetValueAsSQ();
    return items ? items->GetNumberOfItems() : 0;
}

const DicomDerivation derivation{"Deformed for a test", "deformed", "0.2.0", 1};

/// A series with a window, a private element and an overlay.
void write_source(const fs::path& folder, const std::vector<Slice>& slices,
                  gdcm::TransferSyntax::TSType syntax) {
    fs::create_directories(folder);
    for (std::size_t n = 0; n < slices.size(); ++n) {
        gdcm::DataSet set = slice_elements(slices[n]);
        put(set, 0x0008, 0x0008, gdcm::VR::CS, "ORIGINAL\\PRIMARY\\AXIAL");
        put(set, 0x0028, 0x1050, gdcm::VR::DS, "40");
        put(set, 0x0009, 0x0010, gdcm::VR::LO, "SOMEBODY");
        put(set, 0x6000, 0x3000, gdcm::VR::OW, "ab");
        write_object(folder / fmt::format("s{}.dcm", n), set, ct_image, syntax);
    }
}

TEST(DicomDerived, AnImageThatHasNotChangedKeepsItsPixelsToTheBit) {
    for (const auto syntax : {gdcm::TransferSyntax::ExplicitVRLittleEndian,
                              gdcm::TransferSyntax::ImplicitVRLittleEndian}) {
        const fs::path folder = fresh_folder();
        auto slices = series_of(3);
        for (Slice& s : slices) s.slope = 0.3, s.intercept = -1024.7;
        write_source(folder / "ct", slices, syntax);
        const GreyImage image = read_grey_image(folder / "ct");
        fs::create_directories(folder / "out");
        const DerivedSeries written =
            write_dicom_series(folder / "out", {folder / "ct", {}}, image, derivation);
        EXPECT_EQ(written.clamped, 0u);
        ASSERT_EQ(written.instances.size(), 3u);
        const GreyImage again = read_grey_image(folder / "out");
        EXPECT_EQ(again.values, image.values);
        EXPECT_EQ(again.ras_from_voxel, image.ras_from_voxel);
        std::set<std::string> instances{"1.2.3.1", "1.2.3.101", "1.2.3.201"};
        for (int k = 0; k < 3; ++k) {
            // The files are numbered along the slices, of which the source's last is the lowest.
            const gdcm::DataSet of =
                                    elements_of(folder / "out" / fmt::format("IM000{}.dcm", k + 1)),
                                source = elements_of(folder / "ct" / fmt::format("s{}.dcm", 2 - k));
            EXPECT_EQ(value_of(of, 0x7fe0, 0x0010), value_of(source, 0x7fe0, 0x0010));
            for (const auto& [group, element] : {std::pair{0x0010, 0x0010},
                                                 {0x0020, 0x000d},
                                                 {0x0020, 0x0052},
                                                 {0x0020, 0x0032},
                                                 {0x0028, 0x1050},
                                                 {0x0028, 0x1053}})
                EXPECT_EQ(value_of(of, group, element), value_of(source, group, element))
                    << group << ' ' << element;
            EXPECT_EQ(value_of(of, 0x0008, 0x0008), "DERIVED\\SECONDARY\\AXIAL");
            EXPECT_EQ(value_of(of, 0x0008, 0x2111), "Deformed for a test");
            EXPECT_EQ(value_of(of, 0x0020, 0x000e), written.series_uid);
            EXPECT_EQ(value_of(of, 0x0020, 0x0011), "1007");
            EXPECT_EQ(value_of(of, 0x0009, 0x0010), "missing");
            EXPECT_EQ(value_of(of, 0x6000, 0x3000), "missing");
            EXPECT_EQ(items_in(of, 0x0008, 0x2112), k == 1 ? 3u : 2u);  // within one slice
            const std::string uid = value_of(of, 0x0008, 0x0018);
            EXPECT_EQ(uid, written.instances[k].sop_instance);
            EXPECT_TRUE(uid.starts_with("2.25.") && uid.size() <= 64) << uid;
            EXPECT_TRUE(instances.insert(uid).second) << "used twice: " << uid;
        }
        EXPECT_NE(written.series_uid, slices[0].series);
    }
}

TEST(DicomDerived, ChangedValuesAreRoundedAndClamped) {
    const fs::path folder = fresh_folder();
    auto slices = series_of(2);
    for (Slice& s : slices) s.slope = 2, s.intercept = -100;
    write_series(folder / "ct", slices);
    GreyImage image = read_grey_image(folder / "ct");
    image.at(1, 1, 0) = 51.2F;   // 75.6 stored: 76
    image.at(2, 1, 0) = -101;    // -0.5: clamped to 0, or rounded up to it
    image.at(3, 1, 0) = -4000;   // clamped
    image.at(0, 2, 1) = 200000;  // of 16 bits: clamped
    fs::create_directories(folder / "out");
    const DerivedSeries written =
        write_dicom_series(folder / "out", {folder / "ct", {}}, image, derivation);
    const GreyImage again = read_grey_image(folder / "out");
    EXPECT_EQ(again.at(1, 1, 0), 52);
    EXPECT_EQ(again.at(2, 1, 0), -100);
    EXPECT_EQ(again.at(3, 1, 0), -100);
    EXPECT_EQ(again.at(0, 2, 1), 2 * 65535 - 100);
    EXPECT_EQ(again.at(0, 0, 0), image.at(0, 0, 0));
    EXPECT_GE(written.clamped, 2u);
    EXPECT_LE(written.clamped, 3u);
}

/// Labels moved by one slice towards higher ones.
LabelImage moved_up(const LabelImage& labels) {
    LabelImage moved = labels;
    const std::size_t slice = std::size_t(labels.size[0]) * labels.size[1];
    std::fill_n(moved.values.begin(), slice, 0);
    std::copy(labels.values.begin(), labels.values.end() - slice, moved.values.begin() + slice);
    return moved;
}

TEST(DicomDerived, ASegmentationIsWrittenAsOne) {
    const fs::path folder = fresh_folder();
    Segmentation source;
    for (const int segment : {1, 2})
        for (const double z : {30.0, 33.0, 36.0}) {
            Frame frame{segment, z, std::string(12, '\0')};
            frame.pixels[segment + (z > 31 ? 4 : 0)] = 1;
            source.frames.push_back(frame);
        }
    source.frames.pop_back();  // segment 2 has no voxel in the highest slice
    write_segmentation(folder / "seg.dcm", source);
    const LabelImage labels = moved_up(read_label_image(folder / "seg.dcm"));
    ASSERT_EQ(std::count(labels.values.begin(), labels.values.end(), 2), 2);
    fs::create_directories(folder / "out");
    write_dicom_series(folder / "out", {folder / "seg.dcm", {}}, labels, derivation);
    // Interpolated labels would shrink segments, or turn one into another.
    const GreyImage grey{
        labels.size, labels.ras_from_voxel, {labels.values.begin(), labels.values.end()}};
    EXPECT_TRUE(
        says(error_of([&] {
                 write_dicom_series(folder / "grey", {folder / "seg.dcm", {}}, grey, derivation);
             }),
             {"seg.dcm", "is a segmentation", "expected labels"}));
    EXPECT_FALSE(fs::exists(folder / "grey"));
    const Volume again = read_volume(folder / "out");
    EXPECT_EQ(again.label_names.at(2), "Tumour");
    const LabelImage read = read_label_image(folder / "out");
    // Empty slices at the end are not stored: the lowest is gone.
    ASSERT_EQ(read.size, (std::array<int, 3>{4, 3, 2}));
    EXPECT_NEAR(1e3 * read.ras_from_voxel(2, 3), 33, 1e-9);
    EXPECT_TRUE(std::equal(read.values.begin(), read.values.end(), labels.values.begin() + 12));
}

TEST(DicomDerived, RealObjectsComeBackAsTheyWere) {
    LIVETET_DATA_OR_SKIP(data);
    const fs::path folder = fresh_folder();
    for (const fs::path& source :
         {data / "dicom" / "ct-3slice", data / "dicom" / "23x38x3" / "multiframe" / "mf.dcm",
          data / "dicom" / "liver.dcm"}) {
        SCOPED_TRACE(source.string());
        const LabelImage image = read_label_image(source);
        const fs::path out = folder / source.filename();
        fs::create_directories(out);
        const DerivedSeries written =
            write_dicom_series(out, *dicom_name(source), image, derivation);
        EXPECT_EQ(written.clamped, 0u);
        const LabelImage again = read_label_image(out);
        EXPECT_EQ(again.values, image.values);
        EXPECT_LT((again.ras_from_voxel - image.ras_from_voxel).cwiseAbs().maxCoeff(), 1e-9);
    }
    const gdcm::DataSet frames = elements_of(folder / "mf.dcm" / "IM0001.dcm");
    EXPECT_EQ(value_of(frames, 0x0008, 0x0008), "DERIVED\\PRIMARY\\AXIAL\\RESAMPLED");
}

TEST(DicomDerived, WhatDoesNotFitTheSourceIsRefused) {
    const fs::path folder = fresh_folder();
    write_series(folder / "ct", series_of(3));
    fs::create_directories(folder / "out");
    GreyImage image = read_grey_image(folder / "ct");
    const auto write = [&](const fs::path& source) {
        write_dicom_series(folder / "out", {source, {}}, image, derivation);
    };
    image.ras_from_voxel(0, 3) += 1e-3;
    EXPECT_TRUE(says(error_of([&] { write(folder / "ct"); }), {"ct", "4 x 3 x 3", "other places"}));
    image.ras_from_voxel(0, 3) -= 1e-3;
    fs::resize_file(folder / "ct" / "s1.dcm", fs::file_size(folder / "ct" / "s1.dcm") - 10);
    const std::string damaged = error_of([&] { write(folder / "ct"); });
    EXPECT_TRUE(says(damaged, {"s1.dcm"}));
    EXPECT_EQ(damaged.find("Secret"), std::string::npos);
}

}  // namespace
}  // namespace livetet
#endif
