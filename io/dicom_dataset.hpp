#pragma once

#include <gdcmDataSet.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTag.h>

#include <optional>
#include <string>
#include <vector>

namespace livetet::dicom {

/// Tags that are read or written, by the keywords of DICOM PS3.6. No tag of a patient is among
/// them.
namespace tag {
inline constexpr std::uint16_t image = 0x0028;
inline const gdcm::Tag image_type(0x0008, 0x0008), instance_creation_date(0x0008, 0x0012),
    instance_creation_time(0x0008, 0x0013), sop_class_uid(0x0008, 0x0016),
    sop_instance_uid(0x0008, 0x0018), series_date(0x0008, 0x0021), content_date(0x0008, 0x0023),
    series_time(0x0008, 0x0031), content_time(0x0008, 0x0033), modality(0x0008, 0x0060),
    manufacturer(0x0008, 0x0070), code_value(0x0008, 0x0100),
    coding_scheme_designator(0x0008, 0x0102), code_meaning(0x0008, 0x0104),
    series_description(0x0008, 0x103e), manufacturer_model_name(0x0008, 0x1090),
    referenced_series_sequence(0x0008, 0x1115), referenced_image_sequence(0x0008, 0x1140),
    referenced_instance_sequence(0x0008, 0x114a), referenced_sop_class_uid(0x0008, 0x1150),
    referenced_sop_instance_uid(0x0008, 0x1155), referenced_sop_sequence(0x0008, 0x1199),
    derivation_description(0x0008, 0x2111), source_image_sequence(0x0008, 0x2112),
    frame_type(0x0008, 0x9007), derivation_image_sequence(0x0008, 0x9124),
    source_image_evidence_sequence(0x0008, 0x9154), derivation_code_sequence(0x0008, 0x9215),
    slice_thickness(0x0018, 0x0050), spacing_between_slices(0x0018, 0x0088),
    device_serial_number(0x0018, 0x1000), software_versions(0x0018, 0x1020),
    contributing_equipment_sequence(0x0018, 0xa001), study_instance_uid(0x0020, 0x000d),
    series_instance_uid(0x0020, 0x000e), series_number(0x0020, 0x0011),
    instance_number(0x0020, 0x0013), image_position_patient(0x0020, 0x0032),
    image_orientation_patient(0x0020, 0x0037), frame_of_reference_uid(0x0020, 0x0052),
    plane_position_sequence(0x0020, 0x9113), plane_orientation_sequence(0x0020, 0x9116),
    samples_per_pixel(image, 0x0002), photometric_interpretation(image, 0x0004),
    number_of_frames(image, 0x0008), rows(image, 0x0010), columns(image, 0x0011),
    pixel_spacing(image, 0x0030), bits_allocated(image, 0x0100), bits_stored(image, 0x0101),
    high_bit(image, 0x0102), pixel_representation(image, 0x0103),
    smallest_pixel_value(image, 0x0106), largest_pixel_value(image, 0x0107),
    rescale_intercept(image, 0x1052), rescale_slope(image, 0x1053),
    spatial_locations_preserved(image, 0x135a), modality_lut_sequence(image, 0x3000),
    pixel_measures_sequence(image, 0x9110), pixel_value_transformation_sequence(image, 0x9145),
    purpose_of_reference_code_sequence(0x0040, 0xa170), segmentation_type(0x0062, 0x0001),
    segment_sequence(0x0062, 0x0002), segment_number(0x0062, 0x0004), segment_label(0x0062, 0x0005),
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

/// All values of an element of 16-bit integers (US, AT: group and element in turn).
std::vector<int> integers_of(const gdcm::DataSet& set, const gdcm::Tag& tag);

/// The items of a sequence; a null pointer if it is missing or damaged.
Sequence sequence_of(const gdcm::DataSet& set, const gdcm::Tag& tag);

/// The number of items of a sequence that may be a null pointer.
std::size_t item_count(const Sequence& sequence);

/// Copies of the elements of all items; none if the sequence is missing or damaged.
std::vector<gdcm::DataSet> items_of(const gdcm::DataSet& set, const gdcm::Tag& tag);

/// Item `n`, counted from 0, of a sequence with more than n items.
const gdcm::DataSet& item_of(const Sequence& sequence, std::size_t n);

}  // namespace livetet::dicom
