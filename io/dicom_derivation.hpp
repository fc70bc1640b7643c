#pragma once

#include <gdcmDataSet.h>

#include <string>
#include <vector>

#include "io/dicom_derived.hpp"
#include "io/dicom_elements.hpp"
#include "io/dicom_object.hpp"

/// What derived objects state about themselves and their sources.
namespace livetet::dicom {

/// The class and the unique identifier of an object. Throws Error if it does not state them.
DicomInstance instance_of(const Object& object);

/// An item that refers to an instance (Image SOP Instance Reference macro).
gdcm::DataSet reference_to(const DicomInstance& instance);

/// A copy of an object's elements without those that are wrong or not known to be right for changed
/// pixels: private elements, overlays, the icon, least and largest pixel values, digital
/// signatures, and of frames how they were derived. The type of an image becomes DERIVED,
/// SECONDARY; that of enhanced images and their frames, which have to be PRIMARY, becomes DERIVED,
/// PRIMARY, then as it was, RESAMPLED (DICOM PS3.3, C.7.6.1.1.2 and C.8.16.1).
gdcm::DataSet copied_header(const Object& source);

/// A copy of elements without those, at any depth.
gdcm::DataSet copied_elements(const gdcm::DataSet& from);

/// How the elements of a copy state their types: as in the source, where those of implicit types
/// are not known.
Syntax syntax_of(const Object& source);

/// Throws Error, naming the source, unless a derived image has its grid.
void check_same_grid(const ImageGrid& image, const ImageGrid& source, const std::string& where);

/// Sets how an image of one frame was derived (General Reference module).
void put_derivation(gdcm::DataSet& set, const DicomDerivation& derivation,
                    const std::vector<DicomInstance>& sources);

/// Sets the same for all frames of an object of several (Derivation Image macro).
void put_frame_derivation(gdcm::DataSet& set, const DicomDerivation& derivation,
                          const std::vector<DicomInstance>& sources);

/// Adds `livetet warp` to Contributing Equipment Sequence.
void put_equipment(gdcm::DataSet& set, const DicomDerivation& derivation);

/// Instances of one series.
struct SeriesInstances {
    std::string series_uid;
    std::vector<DicomInstance> instances;
};

/// Adds instances of the same study to Referenced Series Sequence (Common Instance Reference
/// module).
void add_references(gdcm::DataSet& set, const SeriesInstances& series);

/// A new series of the source's study.
struct NewSeries {
    std::string uid, number, description;
    DateTime made;
};

/// `source`: one of its images. The series' number is `above` more than the source's.
NewSeries new_series(const Object& source, const DicomDerivation& derivation, int above);

/// Sets the series and a new SOP Instance UID, which is returned.
std::string put_instance(gdcm::DataSet& set, const NewSeries& series);

}  // namespace livetet::dicom
