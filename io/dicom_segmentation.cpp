#include "io/dicom_segmentation.hpp"

#include <algorithm>
#include <map>

#include "base/error.hpp"
#include "io/dicom_dataset.hpp"
#include "io/dicom_pixels.hpp"
#include "io/text.hpp"

namespace livetet::dicom {

namespace {

using Names = std::map<std::int32_t, std::string>;

constexpr std::size_t max_listed = 20, max_name = 64;

/// A name as messages and notes show it.
std::string shown(std::string_view name) { return printable_text(name, max_name); }

Names read_names(const Object& object) {
    const Sequence segments = sequence_of(object.header, tag::segment_sequence);
    Names names;
    for (std::size_t n = 0; n < item_count(segments); ++n) {
        const gdcm::DataSet& segment = item_of(segments, n);
        const std::optional<int> number = integer_of(segment, tag::segment_number);
        if (!number) fail("{}: segment {} of its list has no number", object.file.string(), n + 1);
        const std::string name = shown(text_of(segment, tag::segment_label));
        if (!names.emplace(*number, name).second)
            fail("{}: has two segments of number {}", object.file.string(), *number);
    }
    names.erase(0);  // the background of a label map
    if (names.empty()) fail("{}: lists no segments", object.file.string());
    return names;
}

std::string named(const Names& names, std::int32_t number) {
    return fmt::format("{} \"{}\"", number, names.at(number));
}

std::string list_of(const Names& names) {
    std::string text;
    std::size_t listed = 0;
    for (const auto& [number, name] : names) {
        if (++listed > max_listed)
            return text + fmt::format(" and {} more", names.size() - max_listed);
        text += (text.empty() ? "" : ", ") + named(names, number);
    }
    return text;
}

/// The segment that a word of a choice names: its number, or its name in any case.
std::int32_t segment_of(const std::string& word, const Names& names, const std::string& where) {
    if (word.empty())
        fail("{}: a segment is missing in the choice (after the '#'), expected some of {}", where,
             list_of(names));
    const auto number = parse_index(word);
    Names matching = names;
    std::erase_if(matching, [&](const auto& segment) {
        return number ? static_cast<std::size_t>(segment.first) != *number
                      : lower(segment.second) != lower(shown(word));
    });
    if (matching.empty())
        fail("{}: has no segment '{}' (after the '#'), expected some of {}", where, shown(word),
             list_of(names));
    if (matching.size() > 1)
        fail("{}: has {} segments '{}', choose by number: {}", where, matching.size(), shown(word),
             list_of(matching));
    return matching.begin()->first;
}

/// The numbers of the chosen segments, in the order of the choice; all without one.
std::vector<std::int32_t> chosen_of(const Names& names, const std::string& choice,
                                    const std::string& where) {
    std::vector<std::int32_t> chosen;
    if (choice.empty()) {
        for (const auto& [number, name] : names) chosen.push_back(number);
        return chosen;
    }
    for (std::size_t at = 0; at <= choice.size();) {
        const std::size_t end = std::min(choice.find(',', at), choice.size());
        chosen.push_back(segment_of(
            std::string(trim(std::string_view(choice).substr(at, end - at))), names, where));
        at = end + 1;
    }
    return chosen;
}

/// Writes segments into a label map and counts the voxels that two of them claim.
class LabelWriter {
  public:
    LabelWriter(const ImageGrid& grid)
        : slice_(static_cast<std::size_t>(grid.size[0]) * grid.size[1]),
          labels_(slice_ * grid.size[2]) {}

    /// Sets the voxels of a slice to label_of(n) for pixel n, except where that is 0.
    template <class LabelOf>
    void add(int slice, const LabelOf& label_of) {
        std::uint16_t* to = labels_.data() + slice * slice_;
        for (std::size_t n = 0; n < slice_; ++n) {
            const std::uint16_t label = label_of(n);
            if (label == 0) continue;
            if (to[n] != 0 && to[n] != label) ++overlaps_[{to[n], label}];
            to[n] = label;
        }
    }

    const std::map<std::pair<std::int32_t, std::int32_t>, std::size_t>& overlaps() const {
        return overlaps_;
    }
    const std::vector<std::uint16_t>& labels() const { return labels_; }

  private:
    std::size_t slice_;
    std::vector<std::uint16_t> labels_;
    std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> overlaps_;
};

/// Frames of one segment each: BINARY and FRACTIONAL.
void add_frames(const Object& object, const Frames& frames, const Stack& stack,
                std::span<const std::int32_t> chosen, double threshold, LabelWriter& writer) {
    const Pixels pixels(object);
    std::vector<double> values;
    for (const std::int32_t segment : chosen)
        for (int n = 0; n < object.frames; ++n) {
            if (frames.segments[n] != segment) continue;
            pixels.read(n, values);
            writer.add(stack.slice_of_plane[n], [&](std::size_t v) {
                return static_cast<std::uint16_t>(values[v] >= threshold ? segment : 0);
            });
        }
}

/// Frames whose values are segment numbers: LABELMAP.
void add_label_frames(const Object& object, const Names& names, const Stack& stack,
                      std::span<const std::int32_t> chosen, LabelWriter& writer) {
    enum class Label : std::uint8_t { unknown, listed, chosen };
    std::vector<Label> labels(std::size_t(1) << 16, Label::unknown);  // numbers have 16 bits
    labels[0] = Label::listed;
    for (const auto& [number, name] : names) labels[number] = Label::listed;
    for (const std::int32_t segment : chosen) labels[segment] = Label::chosen;
    const Pixels pixels(object);
    std::vector<double> values;
    for (int n = 0; n < object.frames; ++n) {
        pixels.read(n, values);
        writer.add(stack.slice_of_plane[n], [&](std::size_t v) {
            const double value = values[v];
            const bool fits = value >= 0 && value < static_cast<double>(labels.size());
            const auto number = static_cast<std::uint16_t>(fits ? value : 0);
            if (!fits || labels[number] == Label::unknown)
                fail("{}: has label {:g}, which no segment of its list has, expected {}",
                     object.name(n), value, list_of(names));
            return labels[number] == Label::chosen ? number : std::uint16_t{0};
        });
    }
}

void check_segments(const Frames& frames, const Names& names) {
    for (std::size_t n = 0; n < frames.segments.size(); ++n)
        if (!names.contains(frames.segments[n]))
            fail("{}: belongs to segment {}, expected one of {}", frames.planes[n].name,
                 frames.segments[n], list_of(names));
}

}  // namespace

Volume read_segmentation(const Object& object, const std::string& choice) {
    const std::string where = object.file.string(), type = object.segmentation_type;
    if (type != "BINARY" && type != "FRACTIONAL" && type != "LABELMAP")
        fail("{}: is a segmentation of type '{}', expected BINARY, FRACTIONAL or LABELMAP", where,
             type.substr(0, 16));
    const Names names = read_names(object);
    const std::vector<std::int32_t> chosen = chosen_of(names, choice, where);
    const Frames frames = read_frames(object);
    check_segments(frames, names);
    const Stack stack = stack_segmentation(frames.planes, where);
    LabelWriter writer(stack.grid);
    double threshold = 1;
    if (type == "FRACTIONAL") {
        const int full = integer_of(object.header, tag::maximum_fractional_value).value_or(0);
        if (full < 1)
            fail("{}: its Maximum Fractional Value is {}, expected 1 or more", where, full);
        threshold = 0.5 * full;
    }
    if (type == "LABELMAP")
        add_label_frames(object, names, stack, chosen, writer);
    else
        add_frames(object, frames, stack, chosen, threshold, writer);
    if (choice.empty() && !writer.overlaps().empty()) {
        const auto [pair, count] = *writer.overlaps().begin();
        fail(
            "{}: segments {} and {} overlap in {} voxels; expected a choice after the file's name, "
            "such as '{}#{},{}': these segments, the later on top",
            where, named(names, pair.first), named(names, pair.second), count,
            object.file.filename().string(), pair.first, pair.second);
    }

    Volume volume;
    volume.size = stack.grid.size;
    volume.ras_from_voxel = stack.grid.ras_from_voxel;
    for (const std::int32_t segment : chosen) volume.label_names[segment] = names.at(segment);
    const bool small = *std::max_element(chosen.begin(), chosen.end()) <= 255;
    volume.type = small ? ScalarType::uint8 : ScalarType::uint16;
    if (small) {
        volume.bytes.assign(writer.labels().begin(), writer.labels().end());
    } else {
        const auto* first = reinterpret_cast<const char*>(writer.labels().data());
        volume.bytes.assign(first, first + writer.labels().size() * sizeof(std::uint16_t));
    }
    return volume;
}

}  // namespace livetet::dicom
