#include "apps/live/registration_input.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "apps/live/tracker_source.hpp"
#include "base/error.hpp"
#include "base/log.hpp"
#include "config/yaml.hpp"
#include "io/fiducial_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/points_csv.hpp"
#include "io/text.hpp"
#include "tracking/dwell.hpp"

namespace livetet {

bool is_point_list(const std::filesystem::path& path) {
    const std::string end = ending(path);
    return end == ".json" || end == ".fcsv" || end == ".csv";
}

namespace {

/// "80:150,175:245": windows of frames, half-open.
std::vector<FrameWindow> parse_windows(const std::string& text, const char* option) {
    std::vector<FrameWindow> windows;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        const std::string part = text.substr(begin, end - begin);
        const std::size_t colon = std::min(part.find(':'), part.size());
        const auto first = parse_index(part.substr(0, colon));
        const auto last = colon < part.size() ? parse_index(part.substr(colon + 1)) : std::nullopt;
        if (!first || !last || *last <= *first)
            fail("{}: \"{}\" is not a window of frames, expected FIRST:END with FIRST < END",
                 option, part);
        windows.push_back({*first, *last});
        begin = end + 1;
    }
    return windows;
}

DwellOptions dwell_options(const RegisterArguments& a) {
    DwellOptions options;
    options.tool = a.tool;
    if (!a.reference.empty()) options.reference = a.reference;
    return options;
}

/// The poses of the tool and the reference sensor, from a recording or a stream.
Recording read_poses(const RegisterArguments& a, const SourceReader& read,
                     const std::string& source, const char* title) {
    std::vector<std::string> tools{a.tool};
    if (!a.reference.empty()) tools.push_back(a.reference);
    RecordingOptions options;
    options.tools = std::move(tools);
    if (is_stream(source)) options.length_s = a.length_s;
    options.title = title;
    return read(source, options);
}

/// "80:150,175:245", as --dwells takes it.
std::string frames_of(const std::vector<Dwell>& dwells) {
    std::vector<std::string> windows;
    for (const Dwell& d : dwells) windows.push_back(fmt::format("{}:{}", d.first, d.last));
    return fmt::format("{}", fmt::join(windows, ","));
}

[[noreturn]] void refuse_rests(const RegisterArguments& a, const Rests& rests,
                               std::size_t expected) {
    const DwellOptions options = dwell_options(a);
    std::string text = fmt::format("{}: the tip rested {} times", a.tracker, rests.dwells.size());
    if (!rests.dwells.empty()) text += fmt::format(" ({})", frames_of(rests.dwells));
    text += fmt::format(", expected {} as the image has fiducials", expected);
    if (!rests.unheld.empty())
        fail(
            "{}; in {} it rested too, but turned by less than {:g} degrees, as if laid aside: turn "
            "the tool about its tip on each fiducial, or name the frames with --dwells {}",
            text, frames_of(rests.unheld), options.min_turn_deg, frames_of(rests.unheld));
    fail(
        "{}; let the tip rest for {:g} s on each, within {:g} mm, and turn the tool a little, or "
        "name the frames with --dwells FIRST:END,...",
        text, options.min_duration_s, options.radius_mm);
}

std::vector<Dwell> collect_dwells(const RegisterArguments& a, const SourceReader& read,
                                  const RigidTransform<Tool, Tip>& tool_from_tip,
                                  std::size_t expected) {
    std::vector<FrameWindow> windows;
    if (!a.dwells.empty()) windows = parse_windows(a.dwells, "--dwells");
    const Recording recording = read_poses(a, read, a.tracker, "fiducials");
    const Rests rests = with_context(a.tracker, [&]() -> Rests {
        if (windows.empty()) return find_rests(recording, tool_from_tip, dwell_options(a));
        return {dwells_in_windows(recording, tool_from_tip, windows, dwell_options(a)), {}};
    });
    if (rests.dwells.size() == expected) return rests.dwells;
    refuse_rests(a, rests, expected);
}

void set_weights(const RegisterArguments& a, FiducialRegistration& r) {
    std::vector<std::string> names;
    for (const RegisteredFiducial& f : r.fiducials) names.push_back(f.name);
    for (const std::string& text : a.weights) {
        const std::size_t equals = std::min(text.rfind('='), text.size());
        const auto weight =
            equals < text.size() ? parse_number(text.substr(equals + 1)) : std::nullopt;
        if (!weight || !std::isfinite(*weight) || *weight < 0)
            fail("--weight: found \"{}\", expected NAME=W with W a number that is not negative",
                 text);
        const std::string name = text.substr(0, equals);
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end()) {
            const std::string nearest = nearest_name(name, names);
            fail("--weight {}: {} has no fiducial \"{}\"{}", text, a.image.string(), name,
                 nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest));
        }
        r.fiducials[static_cast<std::size_t>(found - names.begin())].weight = *weight;
    }
}

/// Lists of different lengths: keeps the fiducials that both lists name, and says which are left
/// out. Throws Error if the names do not match.
void match_by_name(const RegisterArguments& a, const std::vector<NamedPoint>& touched,
                   FiducialRegistration& r) {
    std::map<std::string, Eigen::Vector3d> places;
    for (const NamedPoint& p : touched) places.emplace(p.name, p.position);
    std::vector<RegisteredFiducial> both;
    std::vector<std::string> left_out;
    for (RegisteredFiducial& f : r.fiducials) {
        const auto place = places.find(f.name);
        if (f.name.empty() || place == places.end()) {
            left_out.push_back(f.name);
            continue;
        }
        f.in_tracker = place->second;
        both.push_back(f);
        places.erase(place);
    }
    if (both.size() < 3 || both.size() < std::min(touched.size(), r.fiducials.size()))
        fail(
            "{} has {} fiducials and {} has {}, of which {} have the same names; expected equal "
            "numbers in the same order, or names that match",
            a.tracker, touched.size(), a.image.string(), r.fiducials.size(), both.size());
    for (const auto& [name, place] : places) left_out.push_back(name);
    log_warning(fmt::format("{} fiducials are matched by name; left out, as one list lacks {}: {}",
                            both.size(), left_out.size() == 1 ? "it" : "them",
                            fmt::join(left_out, ", ")));
    r.fiducials = std::move(both);
}

}  // namespace

std::vector<NamedPoint> read_point_list(const std::filesystem::path& path) {
    return ending(path) == ".csv" ? read_points_csv(path) : read_fiducials(path);
}

CollectedFiducials collect_fiducials(const RegisterArguments& a, const SourceReader& read) {
    CollectedFiducials fiducials;
    FiducialRegistration& r = fiducials.registration;
    r.reference_tool = a.reference;
    const std::vector<NamedPoint> in_image = read_point_list(a.image);
    for (const NamedPoint& p : in_image)
        r.fiducials.push_back({.name = p.name, .in_image = p.position});
    set_weights(a, r);
    if (is_point_list(a.tracker)) {
        if (!a.reference.empty())
            fail("--reference needs a recording, {} holds points only", a.tracker);
        const std::vector<NamedPoint> touched = read_point_list(a.tracker);
        if (touched.size() != in_image.size()) {
            match_by_name(a, touched, r);
            return fiducials;
        }
        for (std::size_t i = 0; i < touched.size(); ++i)
            r.fiducials[i].in_tracker = touched[i].position;
        return fiducials;
    }
    const ToolTip tip = tip_of(a, a.tracker);
    fiducials.tip_covariance = tip.covariance;
    const std::vector<Dwell> dwells = collect_dwells(a, read, tip.tool_from_tip(), in_image.size());
    for (std::size_t i = 0; i < dwells.size(); ++i) {
        r.fiducials[i].in_tracker = dwells[i].tip_in_tracker;
        if (dwells[i].tip_in_reference) r.fiducials[i].in_reference = *dwells[i].tip_in_reference;
        fiducials.base_from_tool.push_back(dwells[i].mean_turn);
    }
    return fiducials;
}

ToolTip tip_of(const RegisterArguments& a, const std::string& source) {
    if (a.tip.empty() == a.tip_mm.empty())
        fail(
            "{}: points that a tool touches need its tip, expected --tip FILE (of `livetet "
            "calibrate pivot`) or "
            "--tip-mm X Y Z",
            source);
    if (!a.tip.empty()) return read_tip(a.tip, a.tool);
    ToolTip tip{a.tool, {}, {}};
    tip.pivot.tool_from_tip.translation =
        Eigen::Vector3d(a.tip_mm[0], a.tip_mm[1], a.tip_mm[2]) / 1e3;
    return tip;
}

std::vector<Eigen::Vector3d> places_in_image(const FiducialRegistration& r) {
    std::vector<Eigen::Vector3d> places;
    for (const RegisteredFiducial& f : r.fiducials) places.push_back(f.in_image);
    return places;
}

std::vector<Eigen::Vector3d> places_in_base(const FiducialRegistration& r) {
    std::vector<Eigen::Vector3d> places;
    for (const RegisteredFiducial& f : r.fiducials)
        places.push_back(r.reference_tool.empty() ? f.in_tracker : f.in_reference);
    return places;
}

std::vector<double> weights_of(const FiducialRegistration& r) {
    std::vector<double> weights;
    for (const RegisteredFiducial& f : r.fiducials) weights.push_back(f.weight);
    const bool equal = std::all_of(weights.begin(), weights.end(), [](double w) { return w == 1; });
    return equal ? std::vector<double>{} : weights;
}

void reorder_touched(CollectedFiducials& fiducials, const std::vector<std::size_t>& order) {
    const CollectedFiducials before = fiducials;
    std::vector<RegisteredFiducial>& ordered = fiducials.registration.fiducials;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const RegisteredFiducial& touched = before.registration.fiducials[order[i]];
        ordered[i].in_tracker = touched.in_tracker;
        ordered[i].in_reference = touched.in_reference;
        if (!before.base_from_tool.empty())
            fiducials.base_from_tool[i] = before.base_from_tool[order[i]];
    }
}

Recording read_surface_sweep(const RegisterArguments& a, const SourceReader& read) {
    const std::string& source = a.surface_points.empty() ? a.tracker : a.surface_points;
    (void)tip_of(a, source);  // throws before the tool is led over the surface
    return read_poses(a, read, source, "surface");
}

std::vector<Eigen::Vector3d> collect_surface_points(const RegisterArguments& a,
                                                    const SourceReader& read) {
    const std::string& source = a.surface_points.empty() ? a.tracker : a.surface_points;
    if (a.surface_points.empty() && a.surface_frames.empty())
        fail(
            "--surface {}: no points on it, expected --surface-points FILE, or --surface-frames "
            "FIRST:END of {}",
            a.surface.string(), source);
    if (is_point_list(source)) {
        if (!a.surface_frames.empty())
            fail("{}: holds points, expected a recording for --surface-frames {}", source,
                 a.surface_frames);
        return positions_of(read_point_list(source));
    }
    return surface_points_of(a, read_surface_sweep(a, read));
}

std::vector<Eigen::Vector3d> surface_points_of(const RegisterArguments& a,
                                               const Recording& recording) {
    const std::string& source = a.surface_points.empty() ? a.tracker : a.surface_points;
    std::vector<FrameWindow> windows;
    if (!a.surface_frames.empty()) windows = parse_windows(a.surface_frames, "--surface-frames");
    const RigidTransform<Tool, Tip> tool_from_tip = tip_of(a, source).tool_from_tip();
    return with_context(
        source, [&] { return tip_places(recording, tool_from_tip, windows, dwell_options(a)); });
}

TriangleMesh read_organ_surface(const RegisterArguments& a) {
    if (ending(a.surface) == ".h5") {
        MeshHierarchy hierarchy = read_hierarchy(a.surface);
        TetMesh& finest = hierarchy.levels.front();
        return {std::move(finest.nodes), boundary_triangles(finest.tets)};
    }
#ifdef LIVETET_IMAGES
    return read_surface(a.surface, a.space);
#else
    fail("{}: surfaces are not in this build, expected a mesh hierarchy (.h5)", a.surface.string());
#endif
}

}  // namespace livetet
