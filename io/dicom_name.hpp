#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace livetet {

/// A path that names DICOM input, taken apart. `place` is a folder or a file. `choice` is what
/// follows a '#': a series of the folder, or segments of the file; empty without one.
struct DicomName {
    std::filesystem::path place;
    std::string choice;
};

/// The parts of a path that names DICOM input: a folder; a file whose name ends in .dcm or .dicom;
/// a file with DICOM's mark at byte 128. Nothing for other paths and for names of other image
/// formats. A '#' belongs to the name if a file of the whole name exists.
std::optional<DicomName> dicom_name(const std::filesystem::path& path);

/// Whether a file has DICOM's mark, the letters DICM at byte 128.
bool has_dicom_mark(const std::filesystem::path& file);

/// Whether a name ends as those of DICOM files do: .dcm or .dicom.
bool ends_as_dicom(const std::filesystem::path& path);

/// The path without a choice and without a '/' at its end, if it names DICOM input; else the path.
std::filesystem::path image_place(const std::filesystem::path& path);

/// The last component of a path with the choice, for names relative to another folder: "ct#4" of
/// "study/ct/#4".
std::filesystem::path image_filename(const std::filesystem::path& path);

/// That name with another extension, for a file made from `path`: "ball.failed.stl" of "ball.stl".
/// A folder's name and a choice of a series stay whole: "1.2.84#4.failed.stl" of "study/1.2.84/#4".
std::filesystem::path derived_filename(const std::filesystem::path& path,
                                       const std::string& extension);

}  // namespace livetet
