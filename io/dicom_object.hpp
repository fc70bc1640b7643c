#pragma once

#include <gdcmDataSet.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/dicom_planes.hpp"

namespace livetet::dicom {

/// A stored value v means slope * v + intercept.
struct Scale {
    double slope = 1, intercept = 0;
};

/// How pixels are stored: integers of `stored` bits in words of `allocated` bits.
struct PixelFormat {
    int allocated = 0, stored = 0;
    bool is_signed = false;
};

/// The header of one DICOM file of images: one slice, several frames, or a segmentation.
struct Object {
    std::filesystem::path file;
    std::string series_uid, modality;
    std::string series_number;      ///< digits; empty if the file states none
    std::string segmentation_type;  ///< BINARY, FRACTIONAL or LABELMAP; empty for other objects
    std::array<int, 2> size{0, 0};  ///< columns, rows
    int frames = 1;
    std::uint64_t pixels_at = 0;  ///< offset of the pixels in the file
    bool is_implicit = false;     ///< its elements do not state their types (implicit VR)
    gdcm::DataSet header;         ///< all elements before the pixels

    bool is_segmentation() const { return !segmentation_type.empty(); }
    /// Whether its frames have their positions in functional groups.
    bool is_enhanced() const;
    /// Name for messages: the file, and the frame (counted from 0) if there are several.
    std::string name(int frame) const;
};

/// Reads a file's header. Returns nothing if it is no DICOM file or holds no image, such as a
/// report, a list of contours or a DICOMDIR. Throws Error if it is damaged or has sizes that are
/// not possible.
std::optional<Object> read_object(const std::filesystem::path& file);

/// The UID of a file's series, also of one that read_object refuses; empty if it cannot be found.
std::string series_uid_of(const std::filesystem::path& file);

/// The format of the pixels. Throws Error for colours and formats that are not read.
PixelFormat pixel_format(const Object& object);

/// Position, scale and segment of each frame. Segments have the numbers of the file.
struct Frames {
    std::vector<Plane> planes;
    std::vector<Scale> scales;
    std::vector<int> segments;  ///< of a binary or fractional segmentation; else empty
};

/// Position, scale and segment of each frame, from the object itself or its functional groups
/// (DICOM PS3.3, C.7.6.16). Throws Error if one is missing or invalid.
Frames read_frames(const Object& object);

}  // namespace livetet::dicom
