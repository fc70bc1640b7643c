#include "io/dicom_object.hpp"

#include <gdcmReader.h>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/dicom_dataset.hpp"
#include "io/dicom_name.hpp"
#include "io/text.hpp"
#include "io/volume.hpp"

namespace livetet::dicom {

namespace {

namespace fs = std::filesystem;

constexpr int max_frames = 1 << 20;

/// The elements of one frame: its own groups, then those that all frames share, then the object.
class FrameElements {
  public:
    explicit FrameElements(const Object& object)
        : object_(object),
          shared_(sequence_of(object.header, tag::shared_functional_groups_sequence)),
          per_frame_(sequence_of(object.header, tag::per_frame_functional_groups_sequence)) {
        if (object.is_enhanced() && static_cast<int>(item_count(per_frame_)) != object.frames)
            fail("{}: has {} frames and {} per-frame functional groups, expected one for each",
                 object.file.string(), object.frames, item_count(per_frame_));
    }

    /// Calls use(elements) with those of the frame's macro `group`: the first place that has it.
    template <class Use>
    void in_group(int frame, const gdcm::Tag& group, const Use& use) const {
        if (object_.is_enhanced()) {
            for (const auto& [groups, n] : {std::pair{&per_frame_, frame}, std::pair{&shared_, 0}})
                if (static_cast<int>(item_count(*groups)) > n)
                    if (const Sequence macro = sequence_of(item_of(*groups, n), group);
                        item_count(macro) > 0)
                        return use(item_of(macro, 0));
            return;
        }
        use(object_.header);
    }

  private:
    const Object& object_;
    Sequence shared_, per_frame_;
};

std::vector<double> expect_numbers(const gdcm::DataSet& set, const gdcm::Tag& tag,
                                   std::size_t count, const char* what, const std::string& name) {
    const std::vector<double> numbers = numbers_of(set, tag);
    if (numbers.size() != count ||
        std::any_of(numbers.begin(), numbers.end(), [](double v) { return !std::isfinite(v); }))
        fail("{}: its {} has {} values, expected {} numbers", name, what, numbers.size(), count);
    return numbers;
}

Plane read_plane(const Object& object, const FrameElements& elements, int frame) {
    Plane plane;
    plane.name = object.name(frame);
    plane.size = object.size;
    std::vector<double> position, orientation, spacing;
    elements.in_group(frame, tag::plane_position_sequence, [&](const gdcm::DataSet& set) {
        position = expect_numbers(set, tag::image_position_patient, 3, "Image Position (Patient)",
                                  plane.name);
    });
    elements.in_group(frame, tag::plane_orientation_sequence, [&](const gdcm::DataSet& set) {
        orientation = expect_numbers(set, tag::image_orientation_patient, 6,
                                     "Image Orientation (Patient)", plane.name);
    });
    elements.in_group(frame, tag::pixel_measures_sequence, [&](const gdcm::DataSet& set) {
        spacing = expect_numbers(set, tag::pixel_spacing, 2, "Pixel Spacing", plane.name);
        plane.slice_step = number_of(set, tag::spacing_between_slices);
        plane.thickness = number_of(set, tag::slice_thickness);
    });
    if (position.empty() || orientation.empty() || spacing.empty())
        fail("{}: states no {}, expected the place of each frame", plane.name,
             position.empty()      ? "position"
             : orientation.empty() ? "orientation"
                                   : "pixel spacing");
    plane.position = Eigen::Map<const Eigen::Vector3d>(position.data());
    plane.row = Eigen::Map<const Eigen::Vector3d>(orientation.data());
    plane.column = Eigen::Map<const Eigen::Vector3d>(orientation.data() + 3);
    plane.spacing = {spacing[1], spacing[0]};  // the file states that between rows first
    check_plane(plane);
    return plane;
}

Scale read_scale(const Object& object, const FrameElements& elements, int frame) {
    Scale scale;
    elements.in_group(frame, tag::pixel_value_transformation_sequence,
                      [&](const gdcm::DataSet& set) {
                          scale.slope = number_of(set, tag::rescale_slope).value_or(1);
                          scale.intercept = number_of(set, tag::rescale_intercept).value_or(0);
                      });
    if (!std::isfinite(scale.slope) || !std::isfinite(scale.intercept) || scale.slope == 0)
        fail(
            "{}: its Rescale Slope and Intercept are {:g} and {:g}, expected numbers, the slope "
            "not 0",
            object.name(frame), scale.slope, scale.intercept);
    return scale;
}

int read_segment(const Object& object, const FrameElements& elements, int frame) {
    std::optional<int> segment;
    elements.in_group(frame, tag::segment_identification_sequence, [&](const gdcm::DataSet& set) {
        segment = integer_of(set, tag::referenced_segment_number);
    });
    if (!segment || *segment < 1)
        fail("{}: names no segment, expected the number of one", object.name(frame));
    return *segment;
}

}  // namespace

bool Object::is_enhanced() const {
    return header.FindDataElement(tag::per_frame_functional_groups_sequence);
}

std::string Object::name(int frame) const {
    return frames > 1 ? fmt::format("{}, frame {}", file.string(), frame + 1) : file.string();
}

std::optional<Object> read_object(const fs::path& file) {
    const std::string where = file.string();
    gdcm::Reader reader;
    reader.SetFileName(where.c_str());
    if (!reader.ReadUpToTag(tag::pixel_data, {tag::pixel_data})) {
        if (!has_dicom_mark(file) && !ends_as_dicom(file)) return {};
        fail("{}: is damaged, expected a DICOM file", where);
    }
    Object object;
    object.file = file;
    object.header = reader.GetFile().GetDataSet();
    object.pixels_at = reader.GetStreamCurrentPosition();
    object.is_implicit =
        reader.GetFile().GetHeader().GetDataSetTransferSyntax().GetNegociatedType() ==
        gdcm::TransferSyntax::Implicit;
    const gdcm::DataSet& set = object.header;
    object.series_uid = text_of(set, tag::series_instance_uid);
    const std::optional<int> rows = integer_of(set, tag::rows),
                             columns = integer_of(set, tag::columns);
    if (object.series_uid.empty() || !rows || !columns) return {};
    object.size = {*columns, *rows};
    object.modality = text_of(set, tag::modality);
    object.series_number = text_of(set, tag::series_number);
    if (!parse_index(object.series_number)) object.series_number.clear();
    constexpr const char* segmentations[] = {"1.2.840.10008.5.1.4.1.1.66.4",   // Segmentation
                                             "1.2.840.10008.5.1.4.1.1.66.7"};  // Label Map
    if (std::count(std::begin(segmentations), std::end(segmentations),
                   text_of(set, tag::sop_class_uid)) > 0) {
        object.segmentation_type = text_of(set, tag::segmentation_type);
        if (object.segmentation_type.empty())
            fail("{}: states no Segmentation Type, expected BINARY, FRACTIONAL or LABELMAP", where);
    }
    const double frames = number_of(set, tag::number_of_frames).value_or(1);
    if (!(frames >= 1 && frames <= max_frames && frames == std::floor(frames)))
        fail("{}: has {:g} frames, expected 1 to {}", where, frames, max_frames);
    object.frames = static_cast<int>(frames);
    checked_voxel_count({*columns, *rows, object.frames}, where);
    return object;
}

std::string series_uid_of(const fs::path& file) {
    gdcm::Reader reader;
    reader.SetFileName(file.string().c_str());
    if (!reader.ReadUpToTag(tag::series_number)) return {};  // follows the UID
    return text_of(reader.GetFile().GetDataSet(), tag::series_instance_uid);
}

PixelFormat pixel_format(const Object& object) {
    const std::string where = object.file.string();
    const gdcm::DataSet& set = object.header;
    if (const int samples = integer_of(set, tag::samples_per_pixel).value_or(1); samples != 1)
        fail("{}: has {} values a pixel (colours), expected grey or labels", where, samples);
    const std::string meaning = text_of(set, tag::photometric_interpretation);
    if (!object.is_segmentation() && meaning != "MONOCHROME1" && meaning != "MONOCHROME2")
        fail("{}: its Photometric Interpretation is '{}', expected MONOCHROME1 or MONOCHROME2",
             where, printable_text(meaning, 16));
    if (item_count(sequence_of(set, tag::modality_lut_sequence)) > 0)
        fail(
            "{}: translates its values by a table (Modality LUT), expected Rescale Slope and "
            "Intercept",
            where);
    PixelFormat format;
    format.allocated = integer_of(set, tag::bits_allocated).value_or(0);
    format.stored = integer_of(set, tag::bits_stored).value_or(format.allocated);
    format.is_signed = integer_of(set, tag::pixel_representation).value_or(0) == 1;
    const int high_bit = integer_of(set, tag::high_bit).value_or(format.stored - 1);
    const bool binary = object.segmentation_type == "BINARY";
    constexpr int widths[] = {8, 16, 32};
    const bool known = binary ? format.allocated == 1
                              : std::count(std::begin(widths), std::end(widths), format.allocated);
    if (!known || format.stored < 1 || format.stored > format.allocated ||
        high_bit != format.stored - 1)
        fail("{}: its pixels have {} bits of which {} are used, the highest is {}; expected {}",
             where, format.allocated, format.stored, high_bit,
             binary ? "1 bit" : "8, 16 or 32 bits, and the lowest of them used");
    return format;
}

Frames read_frames(const Object& object) {
    if (object.frames > 1 && !object.is_enhanced())
        fail(
            "{}: has {} frames without positions (no per-frame functional groups), expected an "
            "enhanced multi-frame object",
            object.file.string(), object.frames);
    const FrameElements elements(object);
    const bool has_segments = object.is_segmentation() && object.segmentation_type != "LABELMAP";
    Frames frames;
    for (int n = 0; n < object.frames; ++n) {
        frames.planes.push_back(read_plane(object, elements, n));
        frames.scales.push_back(object.is_segmentation() ? Scale{}
                                                         : read_scale(object, elements, n));
        if (has_segments) frames.segments.push_back(read_segment(object, elements, n));
    }
    return frames;
}

}  // namespace livetet::dicom
