#include <fmt/format.h>

#include <charconv>
#include <optional>

#include "apps/commands.hpp"
#include "base/error.hpp"
#include "geometry/umeyama.hpp"
#include "io/fiducial_file.hpp"
#include "io/registration_file.hpp"
#include "io/sequence_file.hpp"
#include "io/tip_file.hpp"
#include "tracking/dwell.hpp"
#include "tracking/poses.hpp"

namespace livetet {

namespace {

struct RegisterArguments {
    std::filesystem::path tracker, image, tip, output;
    std::vector<double> tip_mm;
    std::string tool = "Stylus", reference, dwells;
    std::vector<double> targets_mm;
    bool scale = false;
};

/// "80:150,175:245": windows of frames, half-open.
std::vector<FrameWindow> parse_windows(const std::string& text) {
    std::vector<FrameWindow> windows;
    for (const std::string& part : CLI::detail::split(text, ',')) {
        const char* const end = part.data() + part.size();
        FrameWindow w;
        const auto first = std::from_chars(part.data(), end, w.first);
        const bool colon = first.ec == std::errc() && first.ptr != end && *first.ptr == ':';
        const auto last = colon ? std::from_chars(first.ptr + 1, end, w.last) : first;
        if (!colon || last.ec != std::errc() || last.ptr != end || w.last <= w.first)
            fail("--dwells: \"{}\" is not a window of frames, expected FIRST:END with FIRST < END", part);
        windows.push_back(w);
    }
    return windows;
}

std::vector<Dwell> collect_dwells(const RegisterArguments& a, const Recording& recording, std::size_t expected) {
    if (a.tip.empty() == a.tip_mm.empty())
        fail(
            "{}: landmarks in a recording need the tool's tip, expected --tip FILE (of `livetet calibrate pivot`) or "
            "--tip-mm X Y Z",
            a.tracker.string());
    RigidTransform<Tool, Tip> tool_from_tip;
    if (a.tip.empty())
        tool_from_tip.translation = Eigen::Vector3d(a.tip_mm[0], a.tip_mm[1], a.tip_mm[2]) / 1e3;
    else
        tool_from_tip = read_tip(a.tip).tool_from_tip;
    DwellOptions options;
    options.tool = a.tool;
    if (!a.reference.empty()) options.reference = a.reference;
    const std::vector<Dwell> dwells = naming(a.tracker.string(), [&] {
        return a.dwells.empty() ? find_dwells(recording, tool_from_tip, options)
                                : dwells_in_windows(recording, tool_from_tip, parse_windows(a.dwells), options);
    });
    if (dwells.size() == expected) return dwells;
    std::string found;
    for (const Dwell& d : dwells) found += fmt::format("{}{}:{}", found.empty() ? "" : ",", d.first, d.last);
    fail("{}: the tip rested {} times ({}), expected {} as the image has fiducials; name them with --dwells",
         a.tracker.string(), dwells.size(), found.empty() ? "never" : found, expected);
}

/// The fiducials in the frame that the registration is made in: the reference sensor's where there is one.
std::vector<Eigen::Vector3d> points_of(const FiducialRegistration& r, bool in_image) {
    std::vector<Eigen::Vector3d> points;
    for (const RegisteredFiducial& f : r.fiducials)
        points.push_back(in_image ? f.in_image : r.reference_tool.empty() ? f.in_tracker : f.in_reference);
    return points;
}

FiducialRegistration collect(const RegisterArguments& a) {
    FiducialRegistration r;
    r.reference_tool = a.reference;
    const std::vector<NamedPoint> in_image = read_fiducials(a.image);
    for (const NamedPoint& p : in_image) r.fiducials.push_back({.name = p.name, .in_image = p.position});
    const std::string name = a.tracker.filename().string();
    if (name.ends_with(".json") || name.ends_with(".fcsv")) {
        if (!a.reference.empty()) fail("--reference needs a recording, {} holds points only", a.tracker.string());
        const std::vector<NamedPoint> touched = read_fiducials(a.tracker);
        if (touched.size() != in_image.size())
            fail("{} has {} fiducials and {} has {}, expected as many", a.tracker.string(), touched.size(),
                 a.image.string(), in_image.size());
        for (std::size_t i = 0; i < touched.size(); ++i) r.fiducials[i].in_tracker = touched[i].position;
        return r;
    }
    const Recording recording = read_sequence(a.tracker);
    const std::vector<Dwell> dwells = collect_dwells(a, recording, in_image.size());
    for (std::size_t i = 0; i < dwells.size(); ++i) {
        r.fiducials[i].in_tracker = dwells[i].tip_in_tracker;
        if (dwells[i].tip_in_reference) r.fiducials[i].in_reference = *dwells[i].tip_in_reference;
    }
    return r;
}

void refuse_wrong_order(const RegisterArguments& a, const FiducialRegistration& r) {
    const auto better = better_order(points_of(r, false), points_of(r, true));
    if (!better) return;
    std::string order;
    for (const std::size_t i : better->order) order += fmt::format("{}{}", order.empty() ? "" : ", ", i + 1);
    fail(
        "{}: FRE is {:.2f} mm; the fiducials of {} in the order {} fit better, FRE {:.2f} mm: reorder one of the files",
        a.tracker.string(), 1e3 * better->given_fre, a.tracker.filename().string(), order, 1e3 * better->fre);
}

void register_fiducials(const RegisterArguments& a) {
    FiducialRegistration r = collect(a);
    const auto from = points_of(r, false), to = points_of(r, true);
    const Scaling scaling = a.scale ? Scaling::similarity : Scaling::rigid;
    const PointFit fit = naming(fmt::format("{}, {}", a.tracker.string(), a.image.string()),
                                [&] { return fit_points(from, to, scaling); });
    refuse_wrong_order(a, r);
    const auto left_out = leave_one_out(from, to, scaling);
    r.fre = fit.fre;
    r.fle = fle_from_fre(fit.fre, from.size());
    r.image_from_tracker = {fit.scale, fit.rotation, fit.translation};
    for (std::size_t i = 0; i < r.fiducials.size(); ++i) {
        r.fiducials[i].residual = fit.residuals[i].norm();
        r.fiducials[i].leave_one_out = left_out[i].value_or(std::nan(""));
    }
    fmt::print("{:<12} {:>9} {:>9} {:>9}   {:>11} {:>16}\n", "fiducial", "x/mm", "y/mm", "z/mm", "residual/mm",
               "leave-one-out/mm");
    for (const RegisteredFiducial& f : r.fiducials)
        fmt::print("{:<12} {:9.2f} {:9.2f} {:9.2f}   {:11.3f} {:16.3f}\n", f.name, 1e3 * f.in_image.x(),
                   1e3 * f.in_image.y(), 1e3 * f.in_image.z(), 1e3 * f.residual, 1e3 * f.leave_one_out);
    fmt::print("frame        {}\n", a.reference.empty() ? std::string("the tracker's")
                                                        : fmt::format("the reference sensor's ({})", a.reference));
    fmt::print("FRE          {:.3f} mm RMS (a small FRE is not a small error)\n", 1e3 * r.fre);
    fmt::print("FLE          {:.3f} mm RMS, estimated from FRE\n", 1e3 * r.fle);
    if (a.scale) fmt::print("scale        {:.5f}\n", fit.scale);
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const auto& x : to) centre += x / static_cast<double>(to.size());
    fmt::print("expected TRE {:.3f} mm RMS at the fiducials' centre\n", 1e3 * expected_tre(to, r.fle, centre));
    for (std::size_t i = 0; i + 2 < a.targets_mm.size(); i += 3) {
        const Eigen::Vector3d target(a.targets_mm[i], a.targets_mm[i + 1], a.targets_mm[i + 2]);
        fmt::print("expected TRE {:.3f} mm RMS at ({:.1f}, {:.1f}, {:.1f}) mm\n",
                   1e3 * expected_tre(to, r.fle, target / 1e3), target.x(), target.y(), target.z());
    }
    if (a.output.empty()) return;
    write_registration(a.output, r);
    fmt::print("written      {}\n", a.output.string());
}

}  // namespace

void add_register_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "register", "Registers the tracker (or the reference sensor) to the image by fiducials (Umeyama)");
    auto a = std::make_shared<RegisterArguments>();
    command
        ->add_option(
            "--tracker", a->tracker,
            "fiducials in the tracker's frame (.mrk.json, .fcsv), or a recording in which a tool rests on each in turn")
        ->required();
    command->add_option("--image", a->image, "the same fiducials in the image, in the same order (.mrk.json, .fcsv)")
        ->required();
    command->add_option("--tool", a->tool, "recording: the tool that touches them")->capture_default_str();
    command->add_option("--tip", a->tip, "recording: the tool's tip, of `livetet calibrate pivot -o`");
    command->add_option("--tip-mm", a->tip_mm, "recording: the tool's tip as X Y Z in mm")->expected(3);
    command->add_option("--reference", a->reference,
                        "recording: a sensor fixed to the organ; the registration is then made in its frame");
    command->add_option("--dwells", a->dwells,
                        "recording: frames in which the tip rests, 80:150,175:245,... (default: found)");
    command
        ->add_option("--target-mm", a->targets_mm,
                     "a place X Y Z in the image (mm) to state the expected error at; may be repeated")
        ->expected(3, 300);
    command->add_flag("--scale", a->scale, "estimate a scale too");
    command->add_option("-o,--output", a->output, "write the registration to this file (.json) for `livetet track`");
    command->callback([a] { register_fiducials(*a); });
}

}  // namespace livetet
