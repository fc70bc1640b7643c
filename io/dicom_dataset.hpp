#pragma once

#include <gdcmDataSet.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTag.h>

#include <optional>
#include <string>
#include <vector>

namespace livetet::dicom {

/// Tags that are read, by the keywords of DICOM PS3.6. No tag of a patient is among them.
namespace tag {
inline constexpr std::uint16_t image = 0x0028;
inline const gdcm::Tag sop_class_uid(0x0008, 0x0016), modality(0x0008, 0x0060),
    slice_thickness(0x0018, 0x0050), spacing_between_slices(0x0018, 0x0088),
    series_instance_uid(0x0020, 0x000e), series_number(0x0020, 0x0011),
    image_position_patient(0x0020, 0x0032), image_orientation_patient(0x0020, 0x0037),
    plane_position_sequence(0x0020, 0x9113), plane_orientation_sequence(0x0020, 0x9116),
    samples_per_pixel(image, 0x0002), photometric_interpretation(image, 0x0004),
    number_of_frames(image, 0x0008), rows(image, 0x0010), columns(image, 0x0011),
    pixel_spacing(image, 0x0030), bits_allocated(image, 0x0100), bits_stored(image, 0x0101),
    high_bit(image, 0x0102), pixel_representation(image, 0x0103), rescale_intercept(image, 0x1052),
    rescale_slope(image, 0x1053), modality_lut_sequence(image, 0x3000),
    pixel_measures_sequence(image, 0x9110), pixel_value_transformation_sequence(image, 0x9145),
    segmentation_type(0x0062, 0x0001), segment_sequence(0x0062, 0x0002),
    segment_number(0x0062, 0x0004), segment_label(0x0062, 0x0005),
    segment_identification_sequence(0x0062, 0x000a), referenced_segment_number(0x0062, 0x000b),
    maximum_fractional_value(0x0062, 0x000e), shared_functional_groups_sequence(0x5200, 0x9229),
    per_frame_functional_groups_sequence(0x5200, 0x9230), pixel_data(0x7fe0, 0x0010);
}  // namespace tag

using Sequence = gdcm::SmartPointer<gdcm::SequenceOfItems>;

/// The value of a text element without padding; empty if it is missing or longer than 4096 bytes.
std::string text_of(const gdcm::DataSet& set, const gdcm::Tag& tag);

/// The numbers of an element of decimal or integer texts (DS, IS), separated by '\'; NaN for what
/// is no number. Empty if the element is missing.
std::vector<double> numbers_of(const gdcm::DataSet& set, const gdcm::Tag& tag);

/// The first of these numbers.
std::optional<double> number_of(const gdcm::DataSet& set, const gdcm::Tag& tag);

/// The first value of an element of 16-bit integers (US).
std::optional<int> integer_of(const gdcm::DataSet& set, const gdcm::Tag& tag);

/// The items of a sequence; a null pointer if it is missing or damaged.
Sequence sequence_of(const gdcm::DataSet& set, const gdcm::Tag& tag);

/// The number of items of a sequence that may be a null pointer.
std::size_t item_count(const Sequence& sequence);

/// Item `n`, counted from 0, of a sequence with more than n items.
const gdcm::DataSet& item_of(const Sequence& sequence, std::size_t n);

}  // namespace livetet::dicom
