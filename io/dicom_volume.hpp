#pragma once

#include <filesystem>
#include <vector>

#include "io/dicom_name.hpp"
#include "io/volume.hpp"

namespace livetet {

/// Reads a DICOM series, multi-frame image or segmentation through GDCM, in a child process: a
/// damaged file can harm that process alone. Values are scaled to the units of the file, such as
/// Hounsfield units. Throws Error as `read_grey_image` does.
Volume read_dicom_volume(const DicomName& name);

/// The files that read_dicom_volume reads, by name.
std::vector<std::filesystem::path> dicom_files(const DicomName& name);

}  // namespace livetet
