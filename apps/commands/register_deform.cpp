#include "apps/commands/register_deform.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <set>

#include "apps/commands/deform_result.hpp"
#include "apps/commands/deform_sequence.hpp"
#include "apps/commands/live_sweep.hpp"
#include "apps/commands/measured_landmarks.hpp"
#include "apps/commands/publish_option.hpp"
#include "apps/commands/read_until_signal.hpp"
#include "apps/live/statement_record.hpp"
#include "apps/scene/model_limits.hpp"
#include "apps/scene/outputs.hpp"
#include "apps/simulation/deforming_registration.hpp"
#include "apps/simulation/run_description.hpp"
#include "base/counted.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/stopwatch.hpp"
#include "config/yaml.hpp"
#include "solvers/parallel/petsc_session.hpp"

namespace livetet {

namespace {

using nlohmann::json;

/// What the command line does not name is taken from the scene.
void take_from_scene(RegisterArguments& a, const DeformOptions& deform) {
    if (a.surface_points.empty()) a.surface_points = deform.surface_points;
    if (a.follow.later_points.empty()) a.follow.later_points = deform.later_points;
    if (a.landmarks.empty()) a.landmarks = deform.landmarks;
    if (a.image.empty()) a.image = deform.landmarks_at_rest;
}

void check_deform_arguments(const RegisterArguments& a) {
    if (a.surface_points.empty())
        fail("--deform {}: no points, expected --surface-points FILE, or deform.surface_points",
             a.scene.string());
    const std::pair<const char*, bool> idle[] = {{"--tracker", !a.tracker.empty()},
                                                 {"--surface", !a.surface.empty()},
                                                 {"--scale", a.scale},
                                                 {"--any-order", a.any_order},
                                                 {"--weight", !a.weights.empty()},
                                                 {"--target-mm", !a.targets_mm.empty()},
                                                 {"--reference", !a.reference.empty()}};
    for (const auto& [name, given] : idle)
        if (given)
            fail(
                "{}: has no effect with --deform, expected --registration FILE, or the scene's "
                "section deform",
                name);
    if (a.landmarks.empty() != a.image.empty())
        fail("--landmarks are of the deformed organ and --image has them at rest, expected both");
    if (!a.output.empty() && a.registration.empty())
        fail(
            "-o {}: writes the registration with its rigid part renewed, expected --registration "
            "FILE",
            a.output.string());
    if (!a.output.empty()) expect_ending("--output", a.output, ".json");
    if (a.length_s && !is_stream(a.surface_points))
        fail("--for {:g}: has no effect here, expected points of a source openigtlink://host:port",
             *a.length_s);
    if (!a.follow.publish.empty() && !a.follow.live)
        fail("--publish {}: has no effect without --live", a.follow.publish);
    for (const std::string& later : a.follow.later_points)
        if (!is_point_list(later))
            fail("--later-points {}: expected a list of points (.csv, .mrk.json, .fcsv)", later);
    if (!a.follow.live) return;
    if (!a.follow.later_points.empty())
        fail("--later-points {}: has no effect with --live", a.follow.later_points.front());
    if (is_point_list(a.surface_points))
        fail(
            "--live: {} is a list of points, expected openigtlink://host:port, a recording or a "
            "script of a simulated tracker",
            a.surface_points);
    if (a.registration.empty())
        fail("--live: found no --registration FILE, expected that of the tracker's frame");
    if (!a.surface_frames.empty())
        fail("--surface-frames {}: has no effect with --live, which takes the whole sweep",
             a.surface_frames);
}

void check_outputs(const RegisterArguments& a, const Scene& scene) {
    std::set<std::filesystem::path> inputs{a.surface_points, a.landmarks, a.registration, a.image};
    inputs.insert(a.follow.later_points.begin(), a.follow.later_points.end());
    for (const auto& [name, path] :
         {std::pair{"--json", a.json}, std::pair{"--output", a.output}}) {
        refuse_to_overwrite(name, path, scene, a.scene);
        refuse_to_overwrite(name, path, inputs);
        if (!path.empty()) expect_writable(path);
    }
}

/// What the points are mapped by; the tool's poses are then taken in its frame.
std::optional<FiducialRegistration> read_frame(RegisterArguments& a) {
    if (a.registration.empty()) return {};
    const FiducialRegistration registration = read_registration(a.registration);
    if (!is_point_list(a.surface_points)) a.reference = registration.reference_tool;
    return registration;
}

/// Landmarks, and the points unless they come later, in the image.
MeasuredOrgan read_measured(const RegisterArguments& a,
                            const std::optional<FiducialRegistration>& registration) {
    MeasuredOrgan measured{a.surface_points, {}, matched_landmarks(a)};
    if (!a.follow.live) measured.points = collect_surface_points(a, read_until_signal);
    if (!registration) return measured;
    for (Vector3& c : measured.points) c = registration->image_from_base * c;
    map_landmarks(*registration, measured.landmarks);
    return measured;
}

/// The points, and from when on they are all there.
struct SweptPoints {
    MeasuredOrgan measured;
    double end_s = 1;
    std::optional<double> first_step_s{};
};

/// Fits while the tip is led over the surface.
SweptPoints follow_sweep(const RegisterArguments& a, const Scene& scene, SceneBody& body,
                         DeformingRegistration& registering, const FiducialRegistration& frame,
                         const std::vector<MeasuredLandmark>& landmarks, ResultWriter* writer) {
    constexpr double after_s = 0.001;  // of the last fit on the way: that of all points
    std::optional<PublishOptions> publish;
    take_publish(a.follow.publish, publish);
    LiveSweep live(a, scene, body, registering, frame, landmarks, {writer, publish});
    const auto read = [&](const std::string& source, RecordingOptions options) {
        const StopSignals signals;
        options.stop = signals.token();
        ProgressLine line(options.title);
        options.show = [&](std::optional<double> fraction, std::string_view what) {
            line.status()(fraction, fmt::format("{} | {}", live.text(), what));
        };
        options.watch = [&](const Recording& so_far) { live.take(so_far); };
        return read_source(source, options);
    };
    const Recording recording = read_surface_sweep(a, read);
    const double length_s = recording.samples.back().time_s - recording.samples.front().time_s;
    return {live.measured(recording), length_s + after_s, live.first_step_s()};
}

double turn_deg(const DeformedOrgan& found) {
    return Eigen::AngleAxisd(found.image_from_points.rotation).angle() * 180 / std::numbers::pi;
}

/// How far the rigid motion moves the points' centre, m.
double centre_motion(const DeformedOrgan& found, const MeasuredOrgan& measured) {
    Vector3 centre = Vector3::Zero();
    for (const Vector3& c : measured.points)
        centre += c / static_cast<double>(measured.points.size());
    return (found.image_from_points * centre - centre).norm();
}

json describe_deform(const DeformedOrgan& found, const MeasuredOrgan& measured, PointFrame frame) {
    const SurfaceRegistrationReport& r = found.report;
    const Eigen::Matrix3d& rotation = found.image_from_points.rotation;
    const Vector3 shift = 1e3 * found.image_from_points.translation;
    json matrix = json::array();
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 4; ++k) matrix.push_back(k < 3 ? rotation(i, k) : shift[i]);
    for (const double x : {0., 0., 0., 1.}) matrix.push_back(x);
    json landmarks = json::object();
    for (std::size_t i = 0; i < r.landmarks_m.size(); ++i)
        landmarks[measured.landmarks[i].name] = 1e3 * r.landmarks_m[i];
    json about{{"points", measured.points.size()},
               {"converged", r.converged},
               {"reason", r.reason},
               {"iterations", r.iterations},
               {"rms_before_mm", 1e3 * r.rms_before_m},
               {"rigid_rms_mm", 1e3 * found.rigid_rms_m},
               {"rms_mm", 1e3 * r.rms_m},
               {"median_mm", 1e3 * r.median_m},
               {"outliers", r.outliers},
               {"landmarks_mm", landmarks},
               {"image_from_points", matrix},
               {"total_force_N", {r.total_force_N.x(), r.total_force_N.y(), r.total_force_N.z()}},
               {"energy_mJ", 1e3 * r.prior.energy},
               {"points_sharing_error", r.sharing_points},
               {"young_modulus", "not determined: points show displacements alone"},
               {"first_step_s", found.first_step_s},
               {"fit_s", found.fit_s}};
    if (!found.is_stated) return about;
    about["total_force_radius_95_N"] = found.total_force_radius_95_N;
    about["directions"] = found.directions;
    about["open_directions"] = found.open_directions;
    about["open_forces"] = found.open_forces;
    about["open_motions"] = found.open_motions;
    about["statement"] = json_of(statement_of(found, frame), names_of_targets(found));
    return about;
}

void print_open(const DeformedOrgan& found) {
    constexpr std::size_t max_named = 4;
    if (!found.is_stated) {
        fmt::print("error            not stated: the fit did not converge\n");
        return;
    }
    fmt::print("determined       {} of {} independent directions of the forces\n",
               found.directions - found.open_directions, found.directions);
    if (!found.open_forces.empty()) {
        const std::size_t named = std::min(max_named, found.open_forces.size());
        const std::span<const std::string> first(found.open_forces.data(), named);
        fmt::print("not determined   {}{}: left to the prior\n", fmt::join(first, "; "),
                   named < found.open_forces.size()
                       ? fmt::format("; and {} more", found.open_forces.size() - named)
                       : "");
    }
    if (found.open_motions > 0)
        fmt::print("not determined   {} of the points' frame: left to frame_error_mm and _deg\n",
                   counted(found.open_motions, "rigid motion"));
    for (const TargetSpread& t : found.targets)
        fmt::print(
            "target           {}: 95 % within {:.2f} mm, {:.2f} mm RMS of it by "
            "model_error_percent\n",
            t.name, 1e3 * t.radius_95, 1e3 * std::sqrt(t.by_model_m2));
}

/// How far the data tell the energy of the prior; empty for one that the scene states.
std::string text_of_choice(const PriorWeight& prior) {
    if (prior.determined == 0) return "";
    if (prior.at_bound || !std::isfinite(prior.log_spread))
        return ", chosen at its bound: the points do not tell it";
    return fmt::format(", chosen, known to a factor of {:.1f}", std::exp(prior.log_spread));
}

void print_found(const DeformedOrgan& found, const MeasuredOrgan& measured, PointFrame frame,
                 double largest_m) {
    const SurfaceRegistrationReport& r = found.report;
    fmt::print("points           {}: {}, {}\n", measured.source,
               counted(measured.points.size(), "surface point"),
               counted(measured.landmarks.size(), "landmark"));
    fmt::print(
        "distance         {:.2f} mm RMS before; after: {:.2f} mm median, {:.2f} mm RMS, outliers "
        "included\nrigid            {:.2f} mm RMS by the best rigid motion, a fifth of the points "
        "left out\n",
        1e3 * r.rms_before_m, 1e3 * r.median_m, 1e3 * r.rms_m, 1e3 * found.rigid_rms_m);
    if (!r.landmarks_m.empty())
        fmt::print("landmarks        {:.2f} mm RMS, {:.2f} mm at most\n", 1e3 * r.landmark_rms_m,
                   1e3 * *std::ranges::max_element(r.landmarks_m));
    fmt::print("outliers         {}\n", r.outliers);
    fmt::print(
        "energy           {:.3g} mJ need no reason in the points{}; {:.1f} points share an error\n",
        1e3 * r.prior.energy, text_of_choice(r.prior), r.sharing_points);
    fmt::print("iterations       {}, {}\n", r.iterations,
               r.converged ? "converged" : "NOT converged");
    if (frame == PointFrame::fixed)
        fmt::print("frame            as given\n");
    else
        fmt::print("frame            moved by {:.2f} mm at the points' centre, {:.2f} degrees\n",
                   1e3 * centre_motion(found, measured), turn_deg(found));
    fmt::print("displacement     {:.2f} mm at most\n", 1e3 * largest_m);
    const Vector3& f = r.total_force_N;
    fmt::print("total force      ({:.3g}, {:.3g}, {:.3g}) N{}\n", f.x(), f.y(), f.z(),
               found.is_stated
                   ? fmt::format(", 95 % within {:.2g} N, if the scene's young_Pa is right",
                                 found.total_force_radius_95_N)
                   : "");
    fmt::print(
        "young_Pa         not determined: points show displacements alone, and forces scale "
        "with it\n");
    print_open(found);
    fmt::print("seconds          first step {:.2f}, fit {:.2f}\n", found.first_step_s, found.fit_s);
}

/// Adds a fit as a step of the run.
void add_fit(const std::string& source, const DeformedOrgan& found, double time_s,
             RunHistory& history) {
    const SurfaceRegistrationReport& r = found.report;
    history.steps.push_back({time_s, 1, found.equilibrium, true});
    if (!history.converged) return;
    history.converged = r.converged && found.equilibrium.converged;
    if (!r.converged)
        history.failure = fmt::format(
            "{}: the registration did not converge in {} ({}): the points are {:.2f} mm RMS from "
            "the surface, {:.2f} mm before; the result holds the state reached",
            source, counted(r.iterations, "iteration"), r.reason, 1e3 * r.rms_m,
            1e3 * r.rms_before_m);
    else if (!history.converged)
        history.failure =
            fmt::format("the forces found left an imbalance of {:.1e} (allowed {:.1e})",
                        found.equilibrium.imbalance, found.equilibrium.allowed_imbalance);
}

void write_refined(const RegisterArguments& a, FiducialRegistration registration,
                   const DeformedOrgan& found, std::size_t points) {
    auto& t = registration.image_from_base;
    t.rotation = found.image_from_points.rotation * t.rotation;
    t.translation = found.image_from_points * t.translation;
    registration.surface = RegisteredSurface{points,
                                             points - found.report.outliers,
                                             found.report.rms_before_m,
                                             found.report.rms_m,
                                             found.report.iterations,
                                             found.open_motions};
    registration.expected_error.reset();  // that of the fiducials alone
    write_registration(a.output, registration);
}

void close_result(ResultWriter& writer, const DeformedOrgan& found, const json& about,
                  const json& deform) {
    if (!found.targets.empty())
        writer.write_text("targets", text_of_targets(names_of_targets(found)));
    writer.write_text("solve", about.dump());
    writer.write_text("registration", deform.dump());
    writer.close();
}

/// Adds what is to be said of the state that the body is in.
void describe_state(const Scene& scene, SceneBody& body, const SceneConstraints& constraints,
                    RunFigures& figures) {
    const std::vector<Vector3> displacement = body.body->displacement();
    for (const Vector3& u : displacement)
        figures.largest_displacement_m = std::max(figures.largest_displacement_m, u.norm());
    figures.forces = constraints.forces(body.body->reactions(), displacement);
    figures.inverted_tets = body.body->inverted_tets();
    figures.beyond_model = beyond_model(scene, body.mesh(), displacement);
}

}  // namespace

int register_deforming(RegisterArguments a) {
    // 1. inputs
    PetscSession session("livetet", {});
    if (session.ranks() > 1) fail("register --deform: runs on one rank, found {}", session.ranks());
    const Scene scene = load_scene(a.scene);
    take_from_scene(a, deform_options(scene));
    check_deform_arguments(a);
    check_deform_scene(scene);
    check_outputs(a, scene);
    session.add_options(scene.solver.petsc_options);
    const std::optional<FiducialRegistration> registration = read_frame(a);
    SweptPoints points{read_measured(a, registration)};
    const std::vector<MeasuredOrgan> later = read_later_points(a.follow.later_points, registration);

    // 2. mesh, body
    std::optional<ProgressLine> progress;
    progress.emplace("register");
    RunFigures figures;
    const auto start = std::chrono::steady_clock::now();
    MeshHierarchy hierarchy = load_mesh(scene, progress->callback());
    refuse_hexahedra(hierarchy, "register --deform");
    figures.mesh_s = seconds_since(start);
    SceneBody body = make_body(PETSC_COMM_WORLD, scene, std::move(hierarchy), Use::solve);
    const SceneConstraints constraints(scene, body.mesh());
    check_no_free_motion(scene, body.mesh(), constraints);
    figures.setup_s = seconds_since(start) - figures.mesh_s;
    std::optional<ResultWriter> writer;
    if (scene.output.has_file())
        writer.emplace(scene.output.file, body.mesh(), to_yaml(scene), Precision::full,
                       PETSC_COMM_WORLD);

    // 3. registration
    const PointFrame frame = deform_options(scene).frame;
    DeformingRegistration registering(scene, body, constraints);
    if (a.follow.live) {
        progress.reset();
        points = follow_sweep(a, scene, body, registering, *registration, points.measured.landmarks,
                              writer ? &*writer : nullptr);
        progress.emplace("register");
        registering.start_again();  // so that what is found does not hang on the sweep's pace
    }
    const MeasuredOrgan& measured = points.measured;
    DeformedOrgan found = registering.finish(measured, progress->callback());
    if (a.follow.live) found.first_step_s = points.first_step_s.value_or(found.first_step_s);
    if (!found.is_stated && found.targets.empty() && (a.follow.live || !later.empty()))
        registering.state_errors(found);  // every frame of a result has the targets
    RunHistory history;
    add_fit(measured.source, found, points.end_s, history);
    if (writer) append_found(*writer, scene, body, found, points.end_s);
    const std::vector<LaterFit> fits = fit_later(later, points.end_s, scene, body, registering,
                                                 writer ? &*writer : nullptr, progress->callback());
    for (const LaterFit& fit : fits)
        if (!fit.goes_on) add_fit(fit.source, fit.found, fit.time_s, history);
    progress.reset();
    describe_state(scene, body, constraints, figures);
    figures.sum = sum_of(history);

    // 4. results
    json about = describe_run(scene, body, history, figures, 0);
    json deform = describe_deform(found, measured, frame);
    for (const LaterFit& fit : fits) deform["later"].push_back(describe_later(fit));
    if (writer) close_result(*writer, found, about, deform);
    if (!a.output.empty()) write_refined(a, *registration, found, measured.points.size());
    about["registration"] = deform;
    if (!a.json.empty()) write_text_file(a.json, about.dump(2) + "\n");
    print_found(found, measured, frame, figures.largest_displacement_m);
    print_later(fits);
    for (const std::string& sentence : figures.beyond_model)
        fmt::print("warning          {}\n", sentence);
    fmt::print(
        "written          {}{}\n",
        scene.output.has_file() ? scene.output.file.string() : "no result (output.file: none)",
        a.output.empty() ? "" : ", " + a.output.string());
    if (!history.converged) fmt::print(stderr, "livetet: {}\n", history.failure);
    return history.converged ? 0 : 3;
}

}  // namespace livetet
