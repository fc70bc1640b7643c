#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "image/image.hpp"
#include "io/dicom_name.hpp"

namespace livetet {

/// What objects that are derived from a DICOM image state about it, in ASCII. None of it may
/// describe a patient, as paths may.
struct DicomDerivation {
    std::string description;         ///< how they were computed; at most 1024 characters
    std::string series_description;  ///< at most 64 characters
    std::string version;             ///< of this program
    /// A slice takes values from source slices that are at most this many slices away.
    int slice_reach = 0;
};

/// The class and the unique identifier of a DICOM object.
struct DicomInstance {
    std::string sop_class, sop_instance;
};

/// What `write_dicom_series` has written.
struct DerivedSeries {
    std::string series_uid;
    std::vector<DicomInstance> instances;  ///< one a file
    std::size_t clamped = 0;               ///< voxels beyond what the source's pixels can store
};

/// Writes `image` as a DICOM series that is derived from `source`, an image that `read_volume`
/// reads: a file for each of its files (IM0001.dcm and so on along the slices), into `folder`,
/// which must be new or empty, and is whole or not there. `image` must have the source's grid.
///
/// Each file has the elements of its source file: those of patient, study, equipment and
/// acquisition, place, frame of reference, window. Pixels have the source's format and Rescale
/// Slope and Intercept; a voxel that has not changed keeps its stored value to the bit, others are
/// rounded and clamped. Files are not compressed. New are series, unique identifiers, Image Type
/// (DERIVED\SECONDARY), and how they were derived, with references to the source's slices within
/// `slice_reach`. Unique identifiers are random: each call makes other instances, as DICOM wants of
/// instances that differ in any element. Private elements, overlays, icons and signatures are left
/// out.
///
/// A segmentation is written as one, BINARY as its source must be, from a LabelImage alone: label n
/// is segment n.
///
/// Source and files are read and written in a child process (see through_gdcm). Throws Error if the
/// source cannot be read, has another grid, or a file cannot be written.
DerivedSeries write_dicom_series(const std::filesystem::path& folder, const DicomName& source,
                                 const GreyImage& image, const DicomDerivation& derivation);
DerivedSeries write_dicom_series(const std::filesystem::path& folder, const DicomName& source,
                                 const LabelImage& image, const DicomDerivation& derivation);

}  // namespace livetet
