#pragma once

#include <string>
#include <vector>

#include "io/dicom_name.hpp"
#include "io/dicom_object.hpp"

namespace livetet::dicom {

/// Whether an object is a volume of its own, without others of its series.
bool stands_alone(const Object& object);

/// The objects that a name stands for, one series, by file name: the only or the chosen series of a
/// folder; all slices of the series that a file is one of; or an object of several frames or a
/// segmentation alone. Throws Error, listing the series, if a folder holds several and none is
/// chosen; or if a file of the series is damaged or no image. Messages name series by number,
/// modality, size and the end of the UID, never by what describes a patient. Subfolders are not
/// searched, and hidden files are passed over.
std::vector<Object> find_series(const DicomName& name);

}  // namespace livetet::dicom
