#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "apps/commands/commands.hpp"
#include "apps/commands/publish_option.hpp"
#include "apps/commands/read_until_signal.hpp"
#include "apps/commands/register_deform.hpp"
#include "apps/commands/register_materials.hpp"
#include "apps/live/expected_error.hpp"
#include "apps/live/registration_input.hpp"
#include "apps/live/tracker_source.hpp"
#include "apps/scene/outputs.hpp"
#include "base/error.hpp"
#include "geometry/error_ellipsoid.hpp"
#include "geometry/point_moments.hpp"
#include "geometry/point_order.hpp"
#include "geometry/registration_covariance.hpp"
#include "geometry/registration_error.hpp"
#include "geometry/surface_fit.hpp"
#include "geometry/umeyama.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

namespace {

constexpr double symmetric_m =
    0.001;  // a layout symmetric within this distance may be touched in the wrong order
constexpr double narrow = 0.1;  // a strip of fiducials with a smaller aspect ratio hardly
                                // determines the rotation about it

std::string numbered(const std::vector<std::size_t>& order) {
    std::vector<std::size_t> numbers;
    for (const std::size_t i : order) numbers.push_back(i + 1);
    return fmt::format("{}", fmt::join(numbers, ", "));
}

void find_the_order(const RegisterArguments& a, CollectedFiducials& fiducials) {
    const FiducialRegistration& r = fiducials.registration;
    const OrderSearch search =
        with_context(a.tracker, [&] { return find_order(places_in_base(r), places_in_image(r)); });
    if (is_ambiguous(search))
        fail(
            "{}: the orders {} and {} fit equally well, FRE {:.2f} and {:.2f} mm: their layout "
            "does not tell the "
            "fiducials "
            "apart, expected them in the image's order (without --any-order) or one more of them",
            a.tracker, numbered(search.best.order), numbered(search.rival.order),
            1e3 * search.best.fre, 1e3 * search.rival.fre);
    reorder_touched(fiducials, search.best.order);
    fmt::print("order        {} (FRE {:.2f} mm; the next best of all orders {:.2f} mm)\n",
               numbered(search.best.order), 1e3 * search.best.fre, 1e3 * search.rival.fre);
}

void refuse_wrong_order(const RegisterArguments& a, const FiducialRegistration& r) {
    const auto better = better_order(places_in_base(r), places_in_image(r));
    if (!better) return;
    fail(
        "{}: FRE is {:.2f} mm; the fiducials of {} in the order {} fit better, FRE {:.2f} mm: "
        "reorder one of the "
        "files, or "
        "ask for --any-order",
        a.tracker, 1e3 * better->given_fre, std::filesystem::path(a.tracker).filename().string(),
        numbered(better->order), 1e3 * better->fre);
}

/// Throws Error if the distances differ, as for fiducials in metres or of another patient.
void refuse_other_size(const RegisterArguments& a, std::span<const Eigen::Vector3d> from,
                       std::span<const Eigen::Vector3d> to) {
    constexpr double most = 1.5;
    const PointMoments m = moments_of(from, to, {});
    const double ratio = std::sqrt(m.variance_to / m.variance_from);
    if (m.variance_from > 0 && !(ratio < most && ratio > 1 / most))
        fail(
            "{}: its fiducials lie {:.3g} times as far apart as those of {}, expected the same "
            "distances in mm (--scale looks for a scale)",
            a.image.string(), ratio, a.tracker);
}

void warn_of_layout(const FiducialRegistration& r) {
    const auto to = places_in_image(r);
    if (const double ratio = width_ratio(to, weights_of(r)); ratio < narrow)
        fmt::print(
            "warning: the fiducials lie nearly on a line (ratio {:.3f}): they hardly hold a turn "
            "about it\n",
            ratio);
    if (to.size() > max_ordered_points) return;
    const PointOrder symmetry = nearest_symmetry(to);
    if (symmetry.fre < std::max(symmetric_m, 2 * r.fre))
        fmt::print(
            "warning: the fiducials' layout is symmetric: in the order {} they look the same "
            "within {:.2f} mm, and a "
            "wrong order would not show\n",
            numbered(symmetry.order), 1e3 * symmetry.fre);
}

void print_fiducials(const FiducialRegistration& r) {
    fmt::print("{:<12} {:>9} {:>9} {:>9}   {:>6} {:>11} {:>16}\n", "fiducial", "x/mm", "y/mm",
               "z/mm", "weight", "residual/mm", "leave-one-out/mm");
    for (const RegisteredFiducial& f : r.fiducials)
        fmt::print("{:<12} {:9.2f} {:9.2f} {:9.2f}   {:6.3g} {:11.3f} {:16.3f}\n", f.name,
                   1e3 * f.in_image.x(), 1e3 * f.in_image.y(), 1e3 * f.in_image.z(), f.weight,
                   1e3 * f.residual, 1e3 * f.leave_one_out);
    fmt::print("frame        {}\n",
               r.reference_tool.empty()
                   ? std::string("the tracker's")
                   : fmt::format("the reference sensor's ({})", r.reference_tool));
    fmt::print("FRE          {:.3f} mm RMS (a small FRE is not a small error)\n", 1e3 * r.fre);
    fmt::print("FLE          {:.3f} mm RMS, estimated from FRE\n", 1e3 * r.fle);
}

void name_outlier(FiducialRegistration& r, Scaling scaling) {
    const auto outlier =
        find_outlier(places_in_base(r), places_in_image(r), scaling, weights_of(r));
    if (!outlier) return;
    r.outlier = r.fiducials[outlier->index].name;
    const double fle =
        fle_from_fre(outlier->without.fre, r.fiducials.size(), scaling, outlier->weights_without);
    fmt::print(
        "warning: {0} is {1:.2f} mm from where the others put it (chance {2:.1g}); without it FRE "
        "is {3:.3f} mm, FLE "
        "{4:.3f} mm: --weight {0}=0 leaves it out\n",
        *r.outlier, 1e3 * outlier->leave_one_out, outlier->probability, 1e3 * outlier->without.fre,
        1e3 * fle);
}

/// Where errors are stated, in the image: the fiducials' centre and --target-mm.
std::vector<NamedPoint> targets_of(const RegisterArguments& a, const FiducialRegistration& r) {
    const auto to = places_in_image(r);
    std::vector<NamedPoint> targets{
        {"the fiducials' centre", moments_of(to, to, weights_of(r)).mean_to}};
    for (std::size_t i = 0; i + 2 < a.targets_mm.size(); i += 3) {
        const Eigen::Vector3d target(a.targets_mm[i], a.targets_mm[i + 1], a.targets_mm[i + 2]);
        targets.push_back(
            {fmt::format("({:.1f}, {:.1f}, {:.1f}) mm", target.x(), target.y(), target.z()),
             target / 1e3});
    }
    return targets;
}

void print_expected(const RegisterArguments& a, const FiducialRegistration& r, Scaling scaling) {
    const auto to = places_in_image(r);
    for (const NamedPoint& target : targets_of(a, r))
        fmt::print("expected TRE {:.3f} mm RMS at {}\n",
                   1e3 * expected_tre(to, r.fle, target.position, scaling, weights_of(r)),
                   target.name);
}

/// Sets and prints the expected error of a rigid fit that no surface will change.
void state_error(const RegisterArguments& a, CollectedFiducials& fiducials) {
    FiducialRegistration& r = fiducials.registration;
    if (!a.surface.empty()) {
        fmt::print("error        not stated: that of the refinement by the surface is unknown\n");
        return;
    }
    if (a.scale) {
        fmt::print("error        not stated for a fit with a scale\n");
        return;
    }
    r.expected_error = expected_error(fiducials);
    for (const NamedPoint& target : targets_of(a, r)) {
        const Eigen::Vector3d arm = target.position - r.image_from_base.translation;
        const Eigen::Matrix3d covariance = point_covariance(r.expected_error->covariance, arm);
        fmt::print(
            "error        95 % within {:.2f} mm at {}, {}\n",
            1e3 * error_ellipsoid(covariance).radius_95, target.name,
            r.expected_error->holds_tip ? "with the error of the tip" : "without that of the tip");
    }
}

std::string in_words(const PointMotion& m) {
    const bool turns = m.turn.squaredNorm() > 0.5;
    const Eigen::Vector3d axis = (turns ? m.turn : m.slide).normalized();
    return fmt::format("{} ({:.2f}, {:.2f}, {:.2f})", turns ? "turning about" : "sliding along",
                       axis.x(), axis.y(), axis.z());
}

void print_surface(const RegisterArguments& a, const SurfaceFit& fit, double moved,
                   double fiducials_rms) {
    fmt::print(
        "surface      {}: {} points, the nearest {} count; {:.3f} mm RMS from it before, {:.3f} mm "
        "after ({:.3f} mm of "
        "all), {} iterations\n",
        a.surface.string(), fit.points, fit.used, 1e3 * fit.rms_before, 1e3 * fit.rms_after,
        1e3 * fit.rms_of_all, fit.iterations);
    fmt::print(
        "moved        {:.3f} mm at the fiducials' centre, {:.2f} degrees; the fiducials are now "
        "{:.3f} mm RMS off\n",
        1e3 * moved,
        Eigen::AngleAxisd(fit.image_from_start.rotation).angle() * 180 / std::numbers::pi,
        1e3 * fiducials_rms);
    const PointMotion& weakest = fit.motions[fit.free_motions];
    fmt::print("held least   {}: where the surface is 1 mm wrong, up to {:.1f} mm\n",
               in_words(weakest), 1 / std::sqrt(weakest.constraint));
    if (!fit.converged)
        fmt::print("warning: not converged after {} iterations: begin from better fiducials\n",
                   fit.iterations);
    if (fit.free_motions == 0) return;
    std::vector<std::string> free;
    for (std::size_t k = 0; k < fit.free_motions; ++k) free.push_back(in_words(fit.motions[k]));
    fmt::print(
        "warning: the surface points do not determine {}, which is left to the fiducials; touch "
        "more sides\n",
        fmt::join(free, ", "));
}

void fit_surface(const RegisterArguments& a, FiducialRegistration& r) {
    const TriangleMesh surface = read_organ_surface(a);
    SimilarityTransform<ImageFrame, Base>& t = r.image_from_base;
    std::vector<Eigen::Vector3d> points = collect_surface_points(a, read_until_signal);
    for (Eigen::Vector3d& p : points) p = t * p;
    const SurfaceFit fit = with_context(a.surface.string(), [&] {
        return fit_to_surface(points, surface, {.trimmed_share = a.surface_left_out});
    });
    if (fit.free_motions == fit.motions.size())
        fail(
            "{}: the surface points hold no motion at all, expected points spread over the surface",
            a.surface.string());
    const auto& move = fit.image_from_start;
    t.rotation = move.rotation * t.rotation;
    t.translation = move * t.translation;
    const auto from = places_in_base(r), to = places_in_image(r);
    const auto weights = weights_of(r);
    const Eigen::Vector3d centre = moments_of(from, to, weights).mean_to;
    double squares = 0;
    for (std::size_t i = 0; i < to.size(); ++i)
        squares += weight_of(weights, i) * (t * from[i] - to[i]).squaredNorm();
    print_surface(a, fit, (move * centre - centre).norm(),
                  std::sqrt(squares / total_weight(weights, to.size())));
    r.surface = {fit.points,    fit.used,       fit.rms_before,
                 fit.rms_after, fit.iterations, fit.free_motions};
}

void register_fiducials(const RegisterArguments& a) {
    if (a.tracker.empty() || a.image.empty())
        fail("{} is missing, expected --tracker and --image with fiducials, or --deform SCENE",
             a.tracker.empty() ? "--tracker" : "--image");
    if (!a.landmarks.empty() || !a.registration.empty() || !a.json.empty() || a.follow.live ||
        !a.follow.publish.empty() || !a.follow.later_points.empty())
        fail(
            "--landmarks, --later-points, --registration, --json, --live and --publish go with "
            "--deform SCENE");
    if (a.surface.empty() && !(a.surface_points.empty() && a.surface_frames.empty()))
        fail("--surface-points and --surface-frames lie on the organ, expected --surface FILE too");
    const std::string& touched = a.surface_points.empty() ? a.tracker : a.surface_points;
    if (!a.surface_frames.empty() && is_stream(touched))
        fail(
            "--surface-frames {}: the frames of {} are not there yet, expected --surface-points "
            "SOURCE alone",
            a.surface_frames, touched);
    expect_ending("--output", a.output, ".json");
    refuse_to_overwrite("--output", a.output,
                        {a.tracker, a.image, a.tip, a.surface, a.surface_points});
    // 1. fiducials, in the same order
    CollectedFiducials fiducials = collect_fiducials(a, read_until_signal);
    FiducialRegistration& r = fiducials.registration;
    const Scaling scaling = a.scale ? Scaling::similarity : Scaling::rigid;
    if (a.any_order) find_the_order(a, fiducials);

    // 2. fit, checked by a second method
    const auto from = places_in_base(r), to = places_in_image(r);
    const auto weights = weights_of(r);
    if (!a.scale) refuse_other_size(a, from, to);
    const PointFit fit = with_context(fmt::format("{}, {}", a.tracker, a.image.string()), [&] {
        return fit_points_cross_checked(from, to, scaling, weights);
    });
    refuse_wrong_order(a, r);
    r.image_from_base = {fit.scale, fit.rotation, fit.translation};

    // 3. accuracy
    const auto left_out = leave_one_out(from, to, scaling, weights);
    r.fre = fit.fre;
    r.fle = fle_from_fre(fit.fre, from.size(), scaling, weights);
    for (std::size_t i = 0; i < r.fiducials.size(); ++i) {
        r.fiducials[i].residual = fit.residuals[i].norm();
        r.fiducials[i].leave_one_out = left_out[i].value_or(std::nan(""));
    }
    print_fiducials(r);
    if (a.scale) fmt::print("scale        {:.5f}\n", fit.scale);
    print_expected(a, r, scaling);
    state_error(a, fiducials);
    name_outlier(r, scaling);
    warn_of_layout(r);

    // 4. refinement by points on the surface
    if (!a.surface.empty()) fit_surface(a, r);
    if (a.output.empty()) return;
    write_registration(a.output, r);
    fmt::print("written      {}\n", a.output.string());
}

/// Throws Error for an option that changes nothing in this use of the command.
void refuse_idle_options(const CLI::App& command, const RegisterArguments& a) {
    const bool deforms = !a.scene.empty(), finds_materials = !a.materials.scene.empty();
    const bool of_surface = !deforms && !finds_materials && !a.surface.empty();
    const bool has_stream = is_stream(a.tracker) || is_stream(a.surface_points);
    const bool has_dwells =
        !deforms && !finds_materials && !a.tracker.empty() && !is_point_list(a.tracker);
    struct Option {
        const char* name;
        bool has_effect;
        const char* needs;
    };
    // Points to deform by may come from the scene, which is read later.
    const bool may_stream = has_stream || (deforms && a.surface_points.empty());
    for (const Option& option : {Option{"--surface-left-out", of_surface, "--surface FILE"},
                                 Option{"--space", of_surface, "--surface FILE"},
                                 Option{"--support", finds_materials, "--materials SCENE"},
                                 Option{"--dwells", has_dwells, "--tracker with poses"},
                                 Option{"--for", may_stream, "a source openigtlink://host:port"}})
        if (command.count(option.name) > 0 && !option.has_effect)
            fail("{}: has no effect here, expected {} too", option.name, option.needs);
}

void add_surface_options(CLI::App* command, const std::shared_ptr<RegisterArguments>& a) {
    command->add_option("--surface", a->surface,
                        "the organ's surface in the image: points touched on it refine the "
                        "registration (ICP); a mesh "
                        "hierarchy (.h5) or a surface (.stl, .obj, .ply, .vtk, .vtp, .off, in mm)");
    command->add_option("--surface-points", a->surface_points,
                        "points on the surface, in any order: a list (.csv, .mrk.json, .fcsv) in "
                        "the registered frame, a recording in which the tip is led over the "
                        "surface, or openigtlink://host:port of a tracker that sees it now");
    command->add_option("--surface-frames", a->surface_frames,
                        "frames of that recording (or of --tracker) in which the tip is on the "
                        "surface, 950:1400,...");
    command
        ->add_option("--surface-left-out", a->surface_left_out,
                     "share of the surface points, those farthest from it, that is left out")
        ->capture_default_str();
    command
        ->add_option("--space", a->space,
                     "axes of a surface file: ras, or lps as in models of 3D Slicer since 2020")
        ->transform(CLI::CheckedTransformer(
            std::map<std::string, Space>{{"ras", Space::ras}, {"lps", Space::lps}}))
        ->default_str("ras");
}

void add_deform_options(CLI::App* command, const std::shared_ptr<RegisterArguments>& a) {
    command->add_option("--deform", a->scene,
                        "a scene (YAML) with the organ's mesh, material, fixed nodes and section "
                        "`deform`: finds the forces and the displacement that bring its surface "
                        "to --surface-points, and writes them as `livetet solve` does");
    command->add_option("--later-points", a->follow.later_points,
                        "--deform: further lists of points, of the organ as it moves on, in "
                        "order: each is fitted from the state before, and is a frame of the "
                        "result");
    command->add_option(
        "--landmarks", a->landmarks,
        "--deform, --materials: named landmarks of the deformed organ, in the frame of the "
        "surface points (.csv, .mrk.json, .fcsv); --image has them at rest");
    command->add_option(
        "--registration", a->registration,
        "--deform, --materials: the registration of the frame that the points are in, from "
        "`livetet register`; none: they are in the image's frame. -o writes it "
        "with the rigid motion that was found");
    command->add_option("--json", a->json,
                        "--deform, --materials: also write the figures to this file");
    command->add_flag("--live", a->follow.live,
                      "--deform: fit while the tip is led over the organ (--surface-points: a "
                      "stream, or a recording, played at its own pace): each fit is shown, and is "
                      "a frame of the result; Ctrl-C or --for ends the sweep of a stream");
    command->add_option("--publish", a->follow.publish, fmt::format("--live: {}", publish_help));
    command->add_option("--materials", a->materials.scene,
                        "a scene (YAML) with known loads or displacements: finds the values of its "
                        "materials that have a spread (young_Pa: 3000 +- 2000, poisson) from "
                        "--landmarks of the loaded body and --image, the same at rest");
    command->add_flag("--support", a->materials.support,
                      "--materials: find the stiffness of each soft `fix`, too");
}

}  // namespace

void add_register_command(CLI::App& app, ExitStatus& status) {
    CLI::App* command = app.add_subcommand("register",
                                           "Registers the tracker (or the reference sensor) to the "
                                           "image by fiducials, and by the organ's surface; or "
                                           "finds how the organ is deformed, by its surface");
    auto a = std::make_shared<RegisterArguments>();
    command->add_option(
        "--tracker", a->tracker,
        "fiducials in the tracker's frame (.mrk.json, .fcsv, .csv), a recording in "
        "which a tool rests on each in turn, or openigtlink://host:port of a tracker "
        "server where it does so now");
    command->add_option(
        "--image", a->image,
        "the same fiducials in the image, in the same order (.mrk.json, .fcsv, .csv)");
    command
        ->add_option("--for", a->length_s,
                     "tracker server: recording time in seconds (default: until Ctrl-C)")
        ->check(CLI::PositiveNumber);
    command->add_flag(
        "--any-order", a->any_order,
        "the two lists differ in order: find it (at most 10 fiducials; tries all orders)");
    command->add_option(
        "--weight", a->weights,
        "NAME=W: weight of a fiducial, 1 / its squared error; 0 leaves it out; may be repeated");
    command->add_option("--tool", a->tool, "recording: the tool that touches the fiducials")
        ->capture_default_str();
    command->add_option("--tip", a->tip, "recording: the tool's tip, from `livetet calibrate`");
    command->add_option("--tip-mm", a->tip_mm, "recording: the tool's tip as X Y Z in mm")
        ->expected(3);
    command->add_option(
        "--reference", a->reference,
        "recording: a sensor fixed to the organ; the registration is made in its frame");
    command->add_option(
        "--dwells", a->dwells,
        "recording: frames in which the tip rests, 80:150,175:245,... (default: detected)");
    command
        ->add_option(
            "--target-mm", a->targets_mm,
            "a point X Y Z in the image (mm) at which to state the expected error; may be repeated")
        ->expected(3, 300);
    command->add_flag("--scale", a->scale, "also estimate a scale");
    add_surface_options(command, a);
    add_deform_options(command, a);
    command->add_option("-o,--output", a->output,
                        "write the registration to this file (.json) for `livetet track`");
    command->callback([a, command, &status] {
        refuse_idle_options(*command, *a);
        if (!a->materials.scene.empty())
            status.value = register_materials(*a);
        else if (a->scene.empty())
            register_fiducials(*a);
        else
            status.value = register_deforming(*a);
    });
}

}  // namespace livetet
