#pragma once

#include <gdcmDataSet.h>
#include <gdcmFile.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmWriter.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

/// Writes small DICOM files element by element, so that a reader's mistake is not shared.
namespace livetet::testing_dicom {

inline void put(gdcm::DataSet& set, std::uint16_t group, std::uint16_t element, gdcm::VR vr,
                std::string bytes) {
    if (bytes.size() % 2 != 0) bytes += vr == gdcm::VR::UI || vr == gdcm::VR::OB ? '\0' : ' ';
    gdcm::DataElement data(gdcm::Tag(group, element));
    data.SetVR(vr);
    data.SetByteValue(bytes.data(), gdcm::VL(static_cast<std::uint32_t>(bytes.size())));
    set.Replace(data);
}

inline void put_integer(gdcm::DataSet& set, std::uint16_t group, std::uint16_t element, int value) {
    const auto word = static_cast<std::uint16_t>(value);
    put(set, group, element, gdcm::VR::US, {reinterpret_cast<const char*>(&word), sizeof word});
}

inline void put_items(gdcm::DataSet& set, std::uint16_t group, std::uint16_t element,
                      const std::vector<gdcm::DataSet>& items) {
    gdcm::SmartPointer<gdcm::SequenceOfItems> sequence = new gdcm::SequenceOfItems;
    sequence->SetLengthToUndefined();
    for (const gdcm::DataSet& inside : items) {
        gdcm::Item item;
        item.SetVLToUndefined();
        item.SetNestedDataSet(inside);
        sequence->AddItem(item);
    }
    gdcm::DataElement data(gdcm::Tag(group, element));
    data.SetVR(gdcm::VR::SQ);
    data.SetValue(*sequence);
    data.SetVLToUndefined();
    set.Replace(data);
}

/// Texts of numbers, as DICOM separates them.
template <class Numbers>
std::string listed(const Numbers& numbers) {
    std::string text;
    for (const double v : numbers) text += (text.empty() ? "" : "\\") + fmt::format("{:.10g}", v);
    return text;
}

constexpr const char* ct_image = "1.2.840.10008.5.1.4.1.1.2";
constexpr const char* enhanced_ct_image = "1.2.840.10008.5.1.4.1.1.2.1";
constexpr const char* segmentation = "1.2.840.10008.5.1.4.1.1.66.4";

inline void write_object(
    const std::filesystem::path& path, const gdcm::DataSet& set, const std::string& sop_class,
    gdcm::TransferSyntax::TSType syntax = gdcm::TransferSyntax::ExplicitVRLittleEndian) {
    gdcm::Writer writer;
    gdcm::File& file = writer.GetFile();
    file.GetDataSet() = set;
    put(file.GetDataSet(), 0x0008, 0x0016, gdcm::VR::UI, sop_class);
    if (!set.FindDataElement(gdcm::Tag(0x0008, 0x0018)))
        put(file.GetDataSet(), 0x0008, 0x0018, gdcm::VR::UI, "1.2.3.4");
    put(file.GetDataSet(), 0x0010, 0x0010, gdcm::VR::PN, "Secret^Name");
    file.GetHeader().SetDataSetTransferSyntax(syntax);
    writer.SetFileName(path.string().c_str());
    ASSERT_TRUE(writer.Write());
}

/// A slice of a series. Pixel (i, j) has the stored value first_value + i + columns * j.
struct Slice {
    std::array<double, 3> position{10, 20, 30};
    std::array<double, 6> orientation{1, 0, 0, 0, 1, 0};
    std::array<double, 2> spacing{2, 0.5};  ///< between rows, between columns
    int columns = 4, rows = 3, first_value = 0;
    int bits = 16;
    double slope = 1, intercept = 0, thickness = 3;
    std::string series = "1.2.826.0.1.11111111", number = "7", modality = "CT";
};

inline std::string words(const Slice& s) {
    std::string bytes;
    for (int n = 0; n < s.columns * s.rows; ++n) {
        const auto value = static_cast<std::uint16_t>(s.first_value + n);
        bytes.append(reinterpret_cast<const char*>(&value), s.bits / 8);
    }
    return bytes;
}

inline gdcm::DataSet image_elements(const Slice& s) {
    using gdcm::VR;
    gdcm::DataSet set;
    put(set, 0x0008, 0x0060, VR::CS, s.modality);
    put(set, 0x0020, 0x000d, VR::UI, "1.2.826.0.1.22222222");
    put(set, 0x0020, 0x000e, VR::UI, s.series);
    put(set, 0x0020, 0x0052, VR::UI, "1.2.826.0.1.33333333");
    if (!s.number.empty()) put(set, 0x0020, 0x0011, VR::IS, s.number);
    put_integer(set, 0x0028, 0x0002, 1);
    put(set, 0x0028, 0x0004, VR::CS, "MONOCHROME2");
    put_integer(set, 0x0028, 0x0010, s.rows);
    put_integer(set, 0x0028, 0x0011, s.columns);
    put_integer(set, 0x0028, 0x0100, s.bits);
    put_integer(set, 0x0028, 0x0101, s.bits);
    put_integer(set, 0x0028, 0x0102, s.bits - 1);
    put_integer(set, 0x0028, 0x0103, 0);
    return set;
}

inline gdcm::DataSet slice_elements(const Slice& s) {
    using gdcm::VR;
    gdcm::DataSet set = image_elements(s);
    put(set, 0x0008, 0x0018, VR::UI, fmt::format("1.2.3.{}", s.first_value + 1));
    put(set, 0x0018, 0x0050, VR::DS, fmt::format("{:g}", s.thickness));
    put(set, 0x0020, 0x0032, VR::DS, listed(s.position));
    put(set, 0x0020, 0x0037, VR::DS, listed(s.orientation));
    put(set, 0x0028, 0x0030, VR::DS, listed(s.spacing));
    put(set, 0x0028, 0x1052, VR::DS, fmt::format("{:g}", s.intercept));
    put(set, 0x0028, 0x1053, VR::DS, fmt::format("{:g}", s.slope));
    put(set, 0x7fe0, 0x0010, s.bits == 8 ? VR::OB : VR::OW, words(s));
    return set;
}

inline void write_slice(const std::filesystem::path& path, const Slice& slice) {
    write_object(path, slice_elements(slice), ct_image);
}

/// `count` slices 3 mm apart, from the top down; slice n begins with the value 100 n.
inline std::vector<Slice> series_of(int count) {
    std::vector<Slice> slices(count);
    for (int n = 0; n < count; ++n) {
        slices[n].position[2] = 30 + 3 * (count - 1 - n);
        slices[n].first_value = 100 * n;
    }
    return slices;
}

inline void write_series(const std::filesystem::path& folder, const std::vector<Slice>& slices) {
    std::filesystem::create_directories(folder);
    for (std::size_t n = 0; n < slices.size(); ++n)
        write_slice(folder / fmt::format("s{}.dcm", n), slices[n]);
}

/// A frame of a segmentation: its pixels are 0 or 1 (BINARY), or up to `full` (FRACTIONAL).
struct Frame {
    int segment = 1;
    double z = 30;
    std::string pixels = std::string(12, '\0');
};

struct Segmentation {
    std::vector<std::string> names{"Liver", "Tumour"};
    std::vector<Frame> frames;
    std::string type = "BINARY";
    int full = 100;
    double step = 3;  ///< Spacing Between Slices
};

inline void write_segmentation(const std::filesystem::path& path, const Segmentation& s) {
    using gdcm::VR;
    Slice like;
    const bool binary = s.type == "BINARY";
    like.bits = 8;
    like.modality = "SEG";
    like.series = "1.2.826.0.1.99999999";
    like.number = "300";
    gdcm::DataSet set = image_elements(like);
    if (binary)
        for (const int element : {0x0100, 0x0101}) put_integer(set, 0x0028, element, 1);
    if (binary) put_integer(set, 0x0028, 0x0102, 0);
    put(set, 0x0028, 0x0008, VR::IS, std::to_string(s.frames.size()));
    put(set, 0x0062, 0x0001, VR::CS, s.type);
    put_integer(set, 0x0062, 0x000e, s.full);
    std::vector<gdcm::DataSet> segments;
    for (std::size_t n = 0; n < s.names.size(); ++n) {
        gdcm::DataSet& segment = segments.emplace_back();
        put_integer(segment, 0x0062, 0x0004, static_cast<int>(n) + 1);
        put(segment, 0x0062, 0x0005, VR::LO, s.names[n]);
    }
    put_items(set, 0x0062, 0x0002, segments);
    gdcm::DataSet orientation, measures, shared;
    put(orientation, 0x0020, 0x0037, VR::DS, listed(like.orientation));
    put(measures, 0x0028, 0x0030, VR::DS, listed(like.spacing));
    if (s.step > 0) put(measures, 0x0018, 0x0088, VR::DS, fmt::format("{:g}", s.step));
    put_items(shared, 0x0020, 0x9116, {orientation});
    put_items(shared, 0x0028, 0x9110, {measures});
    put_items(set, 0x5200, 0x9229, {shared});
    std::vector<gdcm::DataSet> per_frame;
    std::string pixels;
    for (const Frame& frame : s.frames) {
        gdcm::DataSet position, segment, &groups = per_frame.emplace_back();
        put(position, 0x0020, 0x0032, VR::DS, fmt::format("10\\20\\{:g}", frame.z));
        put_integer(segment, 0x0062, 0x000b, frame.segment);
        put_items(groups, 0x0020, 0x9113, {position});
        if (s.type != "LABELMAP") put_items(groups, 0x0062, 0x000a, {segment});
        pixels += frame.pixels;
    }
    put_items(set, 0x5200, 0x9230, per_frame);
    std::string bytes = pixels;
    if (binary) {  // packed from the lowest bit on, across the frames
        bytes.assign((pixels.size() + 7) / 8, '\0');
        for (std::size_t n = 0; n < pixels.size(); ++n)
            bytes[n / 8] = static_cast<char>(bytes[n / 8] | pixels[n] << n % 8);
    }
    put(set, 0x7fe0, 0x0010, VR::OB, bytes);
    write_object(path, set, segmentation);
}

}  // namespace livetet::testing_dicom
