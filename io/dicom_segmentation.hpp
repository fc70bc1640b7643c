#pragma once

#include <string>

#include "io/dicom_object.hpp"
#include "io/volume.hpp"

namespace livetet::dicom {

/// Reads a segmentation as a label map: the label of a voxel is the number of its segment, 0
/// outside of all; `label_names` holds the segments' names. A FRACTIONAL segment covers the voxels
/// of which at least half belong to it.
///
/// `choice`: the segments to take, numbers or names separated by commas; where they overlap, the
/// later ones lie on top. Without a choice all are taken, and Error is thrown, naming the segments,
/// if two of them overlap. (DICOM PS3.3, C.8.20, Segmentation IOD)
Volume read_segmentation(const Object& object, const std::string& choice);

}  // namespace livetet::dicom
