#pragma once

#include "image/image.hpp"
#include "io/dicom_derived.hpp"
#include "io/dicom_object.hpp"

namespace livetet::dicom {

/// Writes a label map as a BINARY segmentation that is derived from another, into a folder as
/// IM0001.dcm (`target`: the folder in messages): a frame for each segment and each slice in which
/// it has a voxel, along the slices, segment by segment. Segments keep their numbers, names and
/// codes. See `write_dicom_series`. (DICOM PS3.3, C.8.20, Segmentation IOD)
DerivedSeries write_derived_segmentation(const std::filesystem::path& folder,
                                         const std::filesystem::path& target, const Object& source,
                                         const LabelImage& labels,
                                         const DicomDerivation& derivation);

}  // namespace livetet::dicom
