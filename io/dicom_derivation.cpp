#include "io/dicom_derivation.hpp"

#include <gdcmSequenceOfItems.h>

#include <algorithm>

#include "base/error.hpp"
#include "io/dicom_dataset.hpp"
#include "io/text.hpp"

namespace livetet::dicom {

namespace {

using gdcm::VR;

/// Elements of images and frames that are not copied.
bool stays_behind(const gdcm::Tag& tag) {
    const std::uint16_t group = tag.GetGroup();
    if (tag.IsPrivate() || tag.IsGroupLength()) return true;
    if ((group & 0xff00) == 0x5000 || (group & 0xff00) == 0x6000) return true;  // curves, overlays
    static const gdcm::Tag others[] = {
        tag::smallest_pixel_value,      tag::largest_pixel_value,  tag::pixel_data,
        tag::derivation_image_sequence, gdcm::Tag(0x0008, 0x0014),  // Instance Creator UID
        gdcm::Tag(0x0008, 0x103f),  // Series Description Code Sequence
        gdcm::Tag(0x0028, 0x0108),  // Smallest Pixel Value in Series
        gdcm::Tag(0x0028, 0x0109),  // Largest Pixel Value in Series
        gdcm::Tag(0x0088, 0x0200),  // Icon Image Sequence
        gdcm::Tag(0x4ffe, 0x0001),  // MAC Parameters Sequence
        gdcm::Tag(0xfffa, 0xfffa),  // Digital Signatures Sequence
        gdcm::Tag(0xfffc, 0xfffc),  // Data Set Trailing Padding
    };
    return std::find(std::begin(others), std::end(others), tag) != std::end(others);
}

std::vector<std::string> values_of(const std::string& text) {
    std::vector<std::string> values{""};
    for (const char c : text)
        if (c == '\\')
            values.emplace_back();
        else
            values.back() += c;
    for (std::string& value : values) value = std::string(trim(value));
    return values;
}

std::string derived_type(const std::string& type, bool enhanced) {
    std::vector<std::string> values = values_of(type);
    if (enhanced) values.resize(std::max<std::size_t>(values.size(), 4), "NONE");
    values.resize(std::max<std::size_t>(values.size(), 2));
    values[0] = "DERIVED";
    values[1] = enhanced ? "PRIMARY" : "SECONDARY";
    if (enhanced) values[3] = "RESAMPLED";
    std::string joined;
    for (const std::string& value : values) joined += (joined.empty() ? "" : "\\") + value;
    return joined;
}

/// The items of Source Image Sequence: what an image was computed from, at other places.
std::vector<gdcm::DataSet> source_items(const std::vector<DicomInstance>& sources) {
    std::vector<gdcm::DataSet> items;
    for (const DicomInstance& source : sources) {
        gdcm::DataSet item = reference_to(source);
        put_text(item, tag::spatial_locations_preserved, VR::CS, "NO");
        put_code(item, tag::purpose_of_reference_code_sequence,
                 {"121322", "Source image for image processing operation"});
        items.push_back(item);
    }
    return items;
}

}  // namespace

gdcm::DataSet copied_elements(const gdcm::DataSet& from) {
    gdcm::DataSet to;
    for (auto element = from.Begin(); element != from.End(); ++element) {
        const gdcm::Tag& tag = element->GetTag();
        if (stays_behind(tag)) continue;
        if (tag == tag::frame_type) {
            put_text(to, tag, VR::CS, derived_type(text_of(from, tag), true));
            continue;
        }
        const bool nested = !element->IsEmpty() && dynamic_cast<const gdcm::SequenceOfItems*>(
                                                       &element->GetValue()) != nullptr;
        if (!nested) {
            to.Insert(*element);
            continue;
        }
        std::vector<gdcm::DataSet> items = items_of(from, tag);
        for (gdcm::DataSet& item : items) item = copied_elements(item);
        put_items(to, tag, items);
    }
    return to;
}

DicomInstance instance_of(const Object& object) {
    DicomInstance instance{text_of(object.header, tag::sop_class_uid),
                           text_of(object.header, tag::sop_instance_uid)};
    if (instance.sop_class.empty() || instance.sop_instance.empty())
        fail("{}: states no SOP {} UID, expected one that derived objects can refer to",
             object.file.string(), instance.sop_class.empty() ? "Class" : "Instance");
    return instance;
}

gdcm::DataSet reference_to(const DicomInstance& instance) {
    gdcm::DataSet item;
    put_text(item, tag::referenced_sop_class_uid, VR::UI, instance.sop_class);
    put_text(item, tag::referenced_sop_instance_uid, VR::UI, instance.sop_instance);
    return item;
}

gdcm::DataSet copied_header(const Object& source) {
    gdcm::DataSet set = copied_elements(source.header);
    const gdcm::Tag specific_character_set(0x0008, 0x0005);  // has a value or is missing
    if (text_of(set, specific_character_set).empty()) set.Remove(specific_character_set);
    if (!source.is_segmentation())  // always DERIVED and PRIMARY
        put_text(set, tag::image_type, VR::CS,
                 derived_type(text_of(source.header, tag::image_type), source.is_enhanced()));
    return set;
}

Syntax syntax_of(const Object& source) {
    return source.is_implicit ? Syntax::implicit_types : Syntax::explicit_types;
}

void check_same_grid(const ImageGrid& image, const ImageGrid& source, const std::string& where) {
    const bool same_place = image.ras_from_voxel.isApprox(source.ras_from_voxel, 1e-6);
    if (image.size != source.size || !same_place)
        fail(
            "{}: has {} x {} x {} voxels, found {} x {} x {}{}, expected its voxels in what is "
            "derived from it",
            where, source.size[0], source.size[1], source.size[2], image.size[0], image.size[1],
            image.size[2], same_place ? "" : " at other places");
}

void put_derivation(gdcm::DataSet& set, const DicomDerivation& derivation,
                    const std::vector<DicomInstance>& sources) {
    put_text(set, tag::derivation_description, VR::ST, derivation.description);
    put_code(set, tag::derivation_code_sequence, {"113085", "Spatial resampling"});
    put_items(set, tag::source_image_sequence, source_items(sources));
}

void put_frame_derivation(gdcm::DataSet& set, const DicomDerivation& derivation,
                          const std::vector<DicomInstance>& sources) {
    gdcm::DataSet item;
    put_derivation(item, derivation, sources);
    std::vector<gdcm::DataSet> shared = items_of(set, tag::shared_functional_groups_sequence);
    if (shared.empty()) shared.emplace_back();
    put_items(shared.front(), tag::derivation_image_sequence, {item});
    put_items(set, tag::shared_functional_groups_sequence, shared);
}

void put_equipment(gdcm::DataSet& set, const DicomDerivation& derivation) {
    std::vector<gdcm::DataSet> equipment = items_of(set, tag::contributing_equipment_sequence);
    gdcm::DataSet& ours = equipment.emplace_back();
    put_text(ours, tag::manufacturer, VR::LO, "Livetet");
    put_text(ours, tag::manufacturer_model_name, VR::LO, "livetet warp");
    put_text(ours, tag::software_versions, VR::LO, derivation.version);
    put_code(ours, tag::purpose_of_reference_code_sequence, {"109103", "Modifying Equipment"});
    put_items(set, tag::contributing_equipment_sequence, equipment);
}

void add_references(gdcm::DataSet& set, const SeriesInstances& series) {
    std::vector<gdcm::DataSet> references;
    for (const DicomInstance& instance : series.instances)
        references.push_back(reference_to(instance));
    std::vector<gdcm::DataSet> all = items_of(set, tag::referenced_series_sequence);
    gdcm::DataSet& ours = all.emplace_back();
    put_text(ours, tag::series_instance_uid, VR::UI, series.series_uid);
    put_items(ours, tag::referenced_instance_sequence, references);
    put_items(set, tag::referenced_series_sequence, all);
}

NewSeries new_series(const Object& source, const DicomDerivation& derivation, int above) {
    constexpr std::size_t max_number = 2147483647;  // of the type IS
    NewSeries series{new_uid(), {}, derivation.series_description, date_time_now()};
    if (const auto number = parse_index(source.series_number);
        number && *number < max_number - above)
        series.number = std::to_string(*number + above);
    return series;
}

std::string put_instance(gdcm::DataSet& set, const NewSeries& series) {
    const std::string instance = new_uid();
    put_text(set, tag::sop_instance_uid, VR::UI, instance);
    put_text(set, tag::series_instance_uid, VR::UI, series.uid);
    put_text(set, tag::series_number, VR::IS, series.number);
    put_text(set, tag::series_description, VR::LO, series.description);
    for (const gdcm::Tag& date : {tag::instance_creation_date, tag::series_date, tag::content_date})
        put_text(set, date, VR::DA, series.made.date);
    for (const gdcm::Tag& time : {tag::instance_creation_time, tag::series_time, tag::content_time})
        put_text(set, time, VR::TM, series.made.time);
    return instance;
}

}  // namespace livetet::dicom
