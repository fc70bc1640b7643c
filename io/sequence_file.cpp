#include "io/sequence_file.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numeric>
#include <optional>
#include <vector>

#include <fmt/ranges.h>

#include "base/error.hpp"
#include "base/file.hpp"
#include "io/openigtlink/plus_pose.hpp"
#include "io/text.hpp"

namespace livetet {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view frame_prefix = "Seq_Frame", tracker_field = "ToTrackerTransform";

using Fields = std::map<std::string, std::string, std::less<>>;

struct Header {
    std::optional<std::size_t> frame_count;  ///< according to the size in the header
    std::map<std::size_t, Fields> frames;
    std::vector<std::string> tools;   ///< in order of first appearance
    std::vector<std::string> others;  ///< transforms to other frames than the tracker's
};

void add_once(std::vector<std::string>& names, std::string_view name) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.emplace_back(name);
}

/// Parses a key such as `Seq_Frame0012_StylusToTrackerTransform`: frame 12, field
/// `StylusToTrackerTransform`.
void add_frame_field(Header& header, std::string_view key, std::string_view value,
                     const std::string& where) {
    const std::string_view rest = key.substr(frame_prefix.size());
    const auto bar = rest.find('_');
    const auto frame = parse_index(rest.substr(0, bar));
    if (!frame || bar == std::string_view::npos)
        fail("{}: found the field {}, expected a name such as Seq_Frame0000_Timestamp", where, key);
    const std::string_view field = rest.substr(bar + 1);
    if (field.ends_with(tracker_field) && field.size() > tracker_field.size())
        add_once(header.tools, field.substr(0, field.size() - tracker_field.size()));
    else if (field.ends_with("Transform"))
        add_once(header.others,
                 field.substr(0, field.size() - std::string_view("Transform").size()));
    if (!header.frames[*frame].emplace(field, value).second)
        fail("{}: frame {} has the field {} twice, expected it once", where, *frame, field);
}

/// Parses one header line, already split into key and value.
void add_field(Header& header, std::string_view key, std::string_view value,
               const std::string& where) {
    if (key.starts_with(frame_prefix)) return add_frame_field(header, key, value, where);
    if (key.starts_with("axis ") && key.ends_with("index values"))
        fail(
            "{}: found {}, a sequence of 3D Slicer's own format; expected one of PLUS "
            "(Seq_Frame0000_...)",
            where, key);
    if (key != "DimSize" && key != "sizes") return;
    const auto sizes = split_words(value);
    header.frame_count = sizes.empty() ? std::nullopt : parse_index(sizes.back());
    if (!header.frame_count)
        fail("{}: {} = {}, expected whole numbers, the last one the frames", where, key, value);
}

Header read_header(std::istream& in, const fs::path& path) {
    Header header;
    std::string line;
    std::getline(in, line);
    const bool nrrd = line.starts_with("NRRD");
    if (!nrrd && !line.starts_with("ObjectType"))
        fail("{}:1: found '{}', expected ObjectType = Image or NRRD0004, as PLUS's sequences begin",
             path.string(), trim(line).substr(0, 40));
    for (std::size_t number = 2; std::getline(in, line); ++number) {
        const std::string where = fmt::format("{}:{}", path.string(), number);
        const std::string_view text = trim(line);
        if (nrrd && text.empty()) return header;
        if (text.empty() || text.starts_with('#')) continue;
        // NRRD: `field: value` and `key:=value`; MetaImage: `Name = Value`.
        const auto mark = text.find(nrrd ? ':' : '=');
        if (mark == std::string_view::npos)
            fail("{}: found '{}', expected {}", where, text.substr(0, 40),
                 nrrd ? "key:=value" : "Name = Value");
        const std::size_t width = nrrd && text.substr(mark).starts_with(":=") ? 2 : 1;
        const std::string_view key = trim(text.substr(0, mark));
        if (!nrrd && key == "ElementDataFile") return header;
        add_field(header, key, trim(text.substr(mark + width)), where);
    }
    fail("{}: ends within frame {}, expected more fields and then {}: the file is truncated",
         path.string(), header.frames.empty() ? 0 : header.frames.rbegin()->first,
         nrrd ? "a blank line" : "ElementDataFile = LOCAL");
}

const std::string* find(const Fields& fields, std::string_view name) {
    const auto found = fields.find(name);
    return found == fields.end() ? nullptr : &found->second;
}

/// Parses a 4 x 4 matrix, 16 numbers by rows; translation in mm.
Eigen::Matrix4d parse_matrix(std::string_view text, const std::string& where) {
    const auto words = split_words(text);
    if (words.size() != 16)
        fail("{}: found {} numbers, expected the 16 of a 4 x 4 matrix", where, words.size());
    Eigen::Matrix4d matrix;
    for (int i = 0; i < 16; ++i) {
        const auto number = parse_number(words[i]);
        if (!number) fail("{}: found '{}', expected a number", where, words[i].substr(0, 40));
        matrix(i / 4, i % 4) = *number;
    }
    return matrix;
}

TrackedPose parse_pose(const Fields& fields, const std::string& tool, const std::string& where) {
    TrackedPose pose;
    const std::string name = tool + std::string(tracker_field);
    const std::string* matrix_text = find(fields, name);
    const std::string* status = find(fields, name + "Status");
    if (status) pose.status = parse_pose_status(*status);
    if (!matrix_text) {
        if (status && pose.status == PoseStatus::ok)
            fail("{}: found {}Status = OK and no {}, expected its 16 numbers", where, name, name);
        return pose;
    }
    const Eigen::Matrix4d matrix = parse_matrix(*matrix_text, where + ", field " + name);
    if (!status) pose.status = PoseStatus::ok;
    const auto tracker_from_tool = tracker_from_tool_mm(matrix);
    if (!tracker_from_tool) {
        if (pose.status == PoseStatus::ok) pose.status = PoseStatus::broken;
        return pose;
    }
    pose.rotation = tracker_from_tool->rotation;
    pose.translation = tracker_from_tool->translation;
    return pose;
}

double parse_time(const Fields& fields, const std::string& where) {
    const std::string* text = find(fields, "Timestamp");
    if (!text) fail("{}: no field Timestamp, expected seconds", where);
    const auto time_s = parse_number(*text);
    if (!time_s || !std::isfinite(*time_s))
        fail("{}, field Timestamp: found '{}', expected seconds", where, text->substr(0, 40));
    return *time_s;
}

/// Checks that the frames are exactly those from 0 to the size in the header.
void check_frames(const Header& header, const std::string& where) {
    if (header.tools.empty())
        fail(
            "{}: holds no tool: found {}, expected fields such as "
            "Seq_Frame0000_StylusToTrackerTransform",
            where,
            header.others.empty() ? "no transforms"
                                  : fmt::format("only {}", fmt::join(header.others, ", ")));
    if (!header.frame_count)
        fail("{}: the header states no size, expected DimSize or sizes", where);
    std::size_t expected = 0;
    for (const auto& [frame, fields] : header.frames) {
        if (frame != expected || frame >= *header.frame_count) break;
        ++expected;
    }
    if (expected == *header.frame_count && expected == header.frames.size()) return;
    if (expected == *header.frame_count)
        fail("{}: found frame {}, expected {} frames, as the header's size says", where,
             header.frames.rbegin()->first, expected);
    fail(
        "{}: frame {} is missing, found {} frames of the {} that the header's size says: the file "
        "is truncated",
        where, expected, header.frames.size(), *header.frame_count);
}

std::string matrix_text(const TrackedPose& pose) {
    std::string text;
    for (int i = 0; i < 3; ++i)
        text += fmt::format("{} {} {} {} ", pose.rotation(i, 0), pose.rotation(i, 1),
                            pose.rotation(i, 2), pose.translation(i) / metres_per_mm);
    return text + "0 0 0 1";
}

void check_recording(const Recording& recording, const std::string& where) {
    if (recording.tools.empty())
        fail("{}: the recording has no tools, expected at least one", where);
    for (const std::string& tool : recording.tools)
        if (!is_sequence_tool(tool))
            fail("{}: the tool is named '{}', expected a name without blanks, '=' and ':'", where,
                 tool);
    double last = -HUGE_VAL;
    for (std::size_t k = 0; k < recording.samples.size(); ++k) {
        const TrackerSample& sample = recording.samples[k];
        if (sample.poses.size() != recording.tools.size())
            fail("{}: frame {} has {} poses, expected {}", where, k, sample.poses.size(),
                 recording.tools.size());
        if (!std::isfinite(sample.time_s) || sample.time_s < last)
            fail("{}: frame {} is at {} s after {} s, expected time not to go backwards", where, k,
                 sample.time_s, last);
        last = sample.time_s;
    }
}

}  // namespace

Recording read_sequence(const fs::path& path) {
    const std::string where = path.string();
    if (const std::string end = ending(path); end != ".mha" && end != ".mhd" && end != ".nrrd")
        fail("{}: the name ends in '{}', expected a PLUS sequence: .mha, .mhd or .nrrd", where,
             end);
    check_is_file(path);
    std::ifstream in(path, std::ios::binary);
    if (!in) fail("{}: cannot be read", where);
    const Header header = read_header(in, path);
    check_frames(header, where);

    Recording recording{header.tools, {}};
    recording.samples.reserve(header.frames.size());
    for (const auto& [frame, fields] : header.frames) {
        const std::string place = fmt::format("{}: frame {}", where, frame);
        TrackerSample& sample = recording.samples.emplace_back();
        sample.time_s = parse_time(fields, place);
        if (frame > 0 && sample.time_s < recording.samples[frame - 1].time_s)
            fail(
                "{}: Timestamp {} s comes before the last frame's {} s, expected time not to go "
                "backwards",
                place, sample.time_s, recording.samples[frame - 1].time_s);
        for (const std::string& tool : header.tools)
            sample.poses.push_back(parse_pose(fields, tool, place));
    }
    return recording;
}

bool is_sequence_tool(std::string_view name) {
    return !name.empty() && name.find_first_of(" \t\r\n=:") == std::string_view::npos;
}

void write_sequence(const fs::path& path, const Recording& recording) {
    const std::string where = path.string();
    if (ending(path) != ".mha")
        fail("{}: the name ends in '{}', expected .igs.mha for a PLUS sequence", where,
             ending(path));
    check_recording(recording, where);
    std::string text = fmt::format(
        "ObjectType = Image\nNDims = 3\nAnatomicalOrientation = RAI\nBinaryData = "
        "True\nBinaryDataByteOrderMSB = "
        "False\n"
        "CenterOfRotation = 0 0 0\nCompressedData = False\nDimSize = 0 0 {}\nKinds = domain domain "
        "list\n"
        "ElementNumberOfChannels = 1\nElementSpacing = 1 1 1\nElementType = MET_UCHAR\nOffset = 0 "
        "0 0\n"
        "TransformMatrix = 1 0 0 0 1 0 0 0 1\nUltrasoundImageOrientation = XX\nUltrasoundImageType "
        "= XX\n",
        recording.samples.size());
    for (std::size_t k = 0; k < recording.samples.size(); ++k) {
        const TrackerSample& sample = recording.samples[k];
        const std::string frame = fmt::format("{}{:04}_", frame_prefix, k);
        for (std::size_t i = 0; i < recording.tools.size(); ++i) {
            const std::string field = frame + recording.tools[i] + std::string(tracker_field);
            text += fmt::format("{} = {}\n{}Status = {}\n", field, matrix_text(sample.poses[i]),
                                field, pose_status_word(sample.poses[i].status));
        }
        text += fmt::format("{0}Timestamp = {1}\n{0}ImageStatus = INVALID\n", frame, sample.time_s);
    }
    write_text_file(path, text + "ElementDataFile = LOCAL\n");
}

}  // namespace livetet
