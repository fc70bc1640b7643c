#include "io/dicom_pixels.hpp"

#include <gdcmImageReader.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfFragments.h>
#include <gdcmTransferSyntax.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "base/error.hpp"
#include "io/dicom_dataset.hpp"

namespace livetet::dicom {

namespace {

/// Largest ratio of decompressed to stored bytes that is believed; RLE and JPEG 2000 reach it for
/// constant images only.
constexpr double max_compression = 2000;

std::uint64_t byte_count(const Object& object, const PixelFormat& format) {
    const std::uint64_t bits =
        std::uint64_t(object.size[0]) * object.size[1] * object.frames * format.allocated;
    return (bits + 7) / 8;
}

/// Pixels of a compressed transfer syntax, through GDCM's decoders.
std::vector<char> decompressed(const Object& object, const PixelFormat& format) {
    const std::string where = object.file.string();
    if (format.allocated < 8)
        fail("{}: its bits are compressed, expected a BINARY segmentation that is not", where);
    const std::uint64_t expected = byte_count(object, format);
    if (static_cast<double>(expected) >
        max_compression * static_cast<double>(std::filesystem::file_size(object.file)))
        fail("{}: has {} bytes, expected more for {} bytes of pixels", where,
             std::filesystem::file_size(object.file), expected);
    gdcm::ImageReader reader;
    reader.SetFileName(where.c_str());
    if (!reader.Read())
        fail("{}: its compressed pixels cannot be decoded: damaged, or of an unknown coding",
             where);
    const gdcm::Image& image = reader.GetImage();
    if (image.GetPixelFormat().GetBitsAllocated() != format.allocated ||
        image.GetBufferLength() != expected)
        fail("{}: its compressed pixels are {} bytes of {} bits, expected {} of {}", where,
             image.GetBufferLength(), image.GetPixelFormat().GetBitsAllocated(), expected,
             format.allocated);
    std::vector<char> bytes(expected);
    if (!image.GetBuffer(bytes.data()))
        fail("{}: its compressed pixels cannot be decoded: damaged, or of an unknown coding",
             where);
    return bytes;
}

/// Throws Error unless the file has `bytes` of pixels: GDCM reads truncated ones, too.
void check_file_holds(const Object& object, std::uint64_t bytes) {
    const std::uint64_t size = std::filesystem::file_size(object.file),
                        found = size - std::min(size, object.pixels_at);
    if (found < bytes)
        fail("{}: holds {} bytes of pixels, expected {}: the file is truncated",
             object.file.string(), found, bytes);
}

std::uint64_t fragment_bytes(const gdcm::SequenceOfFragments& fragments) {
    std::uint64_t bytes = 0;
    for (std::size_t n = 0; n < fragments.GetNumberOfFragments(); ++n)
        bytes += std::uint64_t(fragments.GetFragment(n).GetVL());
    return bytes;
}

std::vector<char> pixel_bytes(const Object& object, const PixelFormat& format) {
    const std::string where = object.file.string();
    gdcm::Reader reader;
    reader.SetFileName(where.c_str());
    if (!reader.Read()) fail("{}: is damaged, expected a DICOM file", where);
    const gdcm::File& file = reader.GetFile();
    const gdcm::TransferSyntax syntax = file.GetHeader().GetDataSetTransferSyntax();
    if (syntax == gdcm::TransferSyntax::ExplicitVRBigEndian)
        fail("{}: is big-endian, a coding that DICOM has retired; expected little-endian", where);
    if (!file.GetDataSet().FindDataElement(tag::pixel_data))
        fail("{}: holds no pixels of whole numbers (Pixel Data)", where);
    const gdcm::DataElement& element = file.GetDataSet().GetDataElement(tag::pixel_data);
    if (const gdcm::SequenceOfFragments* fragments = element.GetSequenceOfFragments()) {
        check_file_holds(object, fragment_bytes(*fragments));
        return decompressed(object, format);
    }
    const gdcm::ByteValue* value = element.GetByteValue();
    const std::uint64_t expected = byte_count(object, format),
                        found =
                            value && value->GetPointer() ? std::uint64_t(value->GetLength()) : 0;
    if (found != expected && found != expected + expected % 2)  // padded to an even length
        fail("{}: has {} bytes of pixels, expected {} x {} pixels of {} bits in {} frame(s): {}",
             where, found, object.size[0], object.size[1], format.allocated, object.frames,
             expected);
    if (syntax != gdcm::TransferSyntax::DeflatedExplicitVRLittleEndian)
        check_file_holds(object, expected);
    return {value->GetPointer(), value->GetPointer() + expected};
}

template <class Word>
void read_words(const char* from, const PixelFormat& format, std::vector<double>& values) {
    const std::uint64_t range = std::uint64_t(1) << format.stored, sign = range / 2;
    for (double& v : values) {
        Word word;
        std::memcpy(&word, from, sizeof word);
        from += sizeof word;
        const std::uint64_t bits = word & (range - 1);  // the rest may hold overlays
        v = static_cast<double>(bits);
        if (format.is_signed && bits >= sign) v -= static_cast<double>(range);
    }
}

template <class T>
void append_as(std::span<const double> values, const Scale& scale, std::vector<char>& bytes) {
    const std::size_t at = bytes.size();
    bytes.resize(at + values.size() * sizeof(T));
    char* to = bytes.data() + at;
    for (const double v : values) {
        const auto value = static_cast<T>(scale.slope * v + scale.intercept);
        std::memcpy(to, &value, sizeof value);
        to += sizeof value;
    }
}

}  // namespace

Pixels::Pixels(const Object& object)
    : format_(pixel_format(object)),
      frame_pixels_(std::size_t(object.size[0]) * object.size[1]),
      bytes_(pixel_bytes(object, format_)) {}

void Pixels::read(int frame, std::vector<double>& values) const {
    values.resize(frame_pixels_);
    const std::size_t first = frame_pixels_ * frame;
    if (format_.allocated == 1) {
        for (std::size_t n = 0; n < frame_pixels_; ++n) {
            const std::size_t bit = first + n;
            values[n] = bytes_[bit / 8] >> (bit % 8) & 1;
        }
        return;
    }
    const char* from = bytes_.data() + first * (format_.allocated / 8);
    if (format_.allocated == 8)
        read_words<std::uint8_t>(from, format_, values);
    else if (format_.allocated == 16)
        read_words<std::uint16_t>(from, format_, values);
    else
        read_words<std::uint32_t>(from, format_, values);
}

ScalarType type_for(std::span<const PixelFormat> formats, std::span<const Scale> scales) {
    double low = 0, high = 0;
    for (std::size_t n = 0; n < scales.size(); ++n) {
        const auto [slope, intercept] = scales[n];
        if (slope != std::floor(slope) || intercept != std::floor(intercept))
            return ScalarType::float32;
        const PixelFormat& format = formats[n];
        const double range = std::ldexp(1.0, format.stored),
                     min_stored = format.is_signed ? -range / 2 : 0;
        for (const double stored : {min_stored, min_stored + range - 1}) {
            low = std::min(low, slope * stored + intercept);
            high = std::max(high, slope * stored + intercept);
        }
    }
    const auto fits = [&]<class T>(T) {
        return low >= double(std::numeric_limits<T>::min()) &&
               high <= double(std::numeric_limits<T>::max());
    };
    if (fits(std::uint8_t{})) return ScalarType::uint8;
    if (fits(std::int16_t{})) return ScalarType::int16;
    if (fits(std::uint16_t{})) return ScalarType::uint16;
    return fits(std::int32_t{}) ? ScalarType::int32 : ScalarType::float32;
}

void append_values(std::span<const double> values, const Scale& scale, ScalarType type,
                   std::vector<char>& bytes) {
    if (type == ScalarType::uint8)
        append_as<std::uint8_t>(values, scale, bytes);
    else if (type == ScalarType::int16)
        append_as<std::int16_t>(values, scale, bytes);
    else if (type == ScalarType::uint16)
        append_as<std::uint16_t>(values, scale, bytes);
    else if (type == ScalarType::int32)
        append_as<std::int32_t>(values, scale, bytes);
    else
        append_as<float>(values, scale, bytes);
}

}  // namespace livetet::dicom
