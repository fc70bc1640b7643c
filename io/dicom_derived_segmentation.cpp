#include "io/dicom_derived_segmentation.hpp"

#include <algorithm>
#include <cstring>
#include <set>

#include "base/error.hpp"
#include "io/dicom_dataset.hpp"
#include "io/dicom_derivation.hpp"
#include "io/dicom_planes.hpp"

namespace livetet::dicom {

namespace {

using gdcm::VR;

/// A frame that is written.
struct SegmentFrame {
    int segment, slice;
};

std::set<std::int32_t> segment_numbers(const Object& source) {
    std::set<std::int32_t> numbers;
    for (const gdcm::DataSet& segment : items_of(source.header, tag::segment_sequence))
        if (const auto number = integer_of(segment, tag::segment_number)) numbers.insert(*number);
    return numbers;
}

/// The frames that hold a voxel, by segment and slice. Throws Error for labels without a segment.
std::vector<SegmentFrame> frames_of(const LabelImage& labels, const Object& source) {
    const std::set<std::int32_t> numbers = segment_numbers(source);
    const std::size_t slice = std::size_t(labels.size[0]) * labels.size[1];
    std::set<std::pair<std::int32_t, int>> found;
    for (int k = 0; k < labels.size[2]; ++k) {
        std::int32_t last = 0;
        for (std::size_t n = 0; n < slice; ++n) {
            const std::int32_t label = labels.values[k * slice + n];
            if (label != last && label != 0) found.emplace(label, k);
            last = label;
        }
    }
    std::vector<SegmentFrame> frames;
    for (const auto& [label, k] : found) {
        if (!numbers.contains(label))
            fail("{}: has no segment {}, found a voxel with that label to write",
                 source.file.string(), label);
        frames.push_back({label, k});
    }
    if (frames.empty())
        fail("{}: no voxel of its segments is left in its grid, expected at least one",
             source.file.string());
    return frames;
}

/// One bit a pixel, from the lowest on, across the frames.
std::vector<char> bits_of(const LabelImage& labels, const std::vector<SegmentFrame>& frames) {
    const std::size_t slice = std::size_t(labels.size[0]) * labels.size[1],
                      bytes = (frames.size() * slice + 7) / 8;
    std::vector<char> bits(bytes + bytes % 2);
    std::size_t at = 0;
    for (const auto& [segment, k] : frames)
        for (std::size_t n = 0; n < slice; ++n, ++at)
            if (labels.values[k * slice + n] == segment)
                bits[at / 8] = static_cast<char>(bits[at / 8] | 1 << at % 8);
    return bits;
}

/// Dimension Index Values of a frame: its segment, its slice, or 1 of other dimensions.
std::vector<std::uint32_t> index_values(const gdcm::DataSet& header, const SegmentFrame& frame) {
    static const gdcm::Tag dimension_index_sequence(0x0020, 0x9222),
        dimension_index_pointer(0x0020, 0x9165);
    std::vector<std::uint32_t> values;
    for (const gdcm::DataSet& dimension : items_of(header, dimension_index_sequence)) {
        const std::vector<int> pointer = integers_of(dimension, dimension_index_pointer);
        const gdcm::Tag by(static_cast<std::uint16_t>(pointer.size() == 2 ? pointer[0] : 0),
                           static_cast<std::uint16_t>(pointer.size() == 2 ? pointer[1] : 0));
        values.push_back(by == tag::referenced_segment_number ? frame.segment
                         : by == tag::image_position_patient  ? frame.slice + 1
                                                              : 1);
    }
    return values;
}

/// The functional groups of a frame: those of the source's frame of the same segment and slice, of
/// the same segment, or of any.
class FrameGroups {
  public:
    FrameGroups(const Object& source, const Frames& frames, const Stack& stack)
        : source_(source),
          frames_(frames),
          stack_(stack),
          of_source_(items_of(source.header, tag::per_frame_functional_groups_sequence)) {}

    gdcm::DataSet of(const SegmentFrame& frame) const {
        static const gdcm::Tag frame_content_sequence(0x0020, 0x9111),
            dimension_index_values(0x0020, 0x9157);
        gdcm::DataSet groups = copied_elements(of_source_[like(frame)]), content, position, segment;
        const std::vector<std::uint32_t> values = index_values(source_.header, frame);
        if (!values.empty())
            put_bytes(content, dimension_index_values, VR::UL,
                      {reinterpret_cast<const char*>(values.data()), 4 * values.size()},
                      source_.file.string());
        const Eigen::Vector3d at = lps_mm(stack_.grid, frame.slice);
        put_text(position, tag::image_position_patient, VR::DS, decimal_strings({at.data(), 3}));
        put_integer(segment, tag::referenced_segment_number,
                    static_cast<std::uint16_t>(frame.segment));
        put_items(groups, frame_content_sequence, {content});
        put_items(groups, tag::plane_position_sequence, {position});
        put_items(groups, tag::segment_identification_sequence, {segment});
        return groups;
    }

  private:
    std::size_t like(const SegmentFrame& frame) const {
        std::size_t best = 0;
        for (std::size_t n = 0; n < frames_.segments.size(); ++n) {
            if (frames_.segments[n] != frame.segment) continue;
            if (stack_.slice_of_plane[n] == frame.slice) return n;
            best = n;
        }
        return best;
    }

    const Object& source_;
    const Frames& frames_;
    const Stack& stack_;
    std::vector<gdcm::DataSet> of_source_;
};

}  // namespace

DerivedSeries write_derived_segmentation(const std::filesystem::path& folder,
                                         const std::filesystem::path& target, const Object& source,
                                         const LabelImage& labels,
                                         const DicomDerivation& derivation) {
    const std::string where = source.file.string();
    if (source.segmentation_type != "BINARY")
        fail("{}: is a segmentation of type {}, expected BINARY for one that is derived from it",
             where, source.segmentation_type.substr(0, 16));
    const Frames of_source = read_frames(source);
    const Stack stack = stack_segmentation(of_source.planes, where);
    check_same_grid(grid_of(labels), stack.grid, where);
    const std::vector<SegmentFrame> frames = frames_of(labels, source);

    gdcm::DataSet set = copied_header(source);
    const DicomInstance from = instance_of(source);
    const FrameGroups groups(source, of_source, stack);
    std::vector<gdcm::DataSet> per_frame;
    for (const SegmentFrame& frame : frames) per_frame.push_back(groups.of(frame));
    put_items(set, tag::per_frame_functional_groups_sequence, per_frame);
    put_text(set, tag::number_of_frames, VR::IS, std::to_string(frames.size()));
    put_frame_derivation(set, derivation, {from});
    put_equipment(set, derivation);
    add_references(set, {source.series_uid, {from}});
    const NewSeries series = new_series(source, derivation, 1000);
    const std::string instance = put_instance(set, series);
    put_bytes(set, tag::pixel_data, VR::OB, bits_of(labels, frames), where);
    write_object(folder / "IM0001.dcm", target / "IM0001.dcm", set, syntax_of(source));
    return {series.uid, {{from.sop_class, instance}}, 0};
}

}  // namespace livetet::dicom
