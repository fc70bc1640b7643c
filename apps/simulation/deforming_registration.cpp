#include "apps/simulation/deforming_registration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "apps/scene/node_selection.hpp"
#include "base/error.hpp"
#include "base/stopwatch.hpp"
#include "geometry/error_ellipsoid.hpp"
#include "geometry/surface_fit.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

constexpr std::size_t default_centres = 20;

/// Nodes of the surface that may take a force: not held. `nodes`: sorted; empty: all.
std::vector<std::int32_t> free_surface(const TetMesh& mesh, const SceneConstraints& constraints,
                                       const std::optional<std::vector<std::int32_t>>& nodes) {
    const std::vector<std::uint8_t>& held = constraints.constraints().components;
    std::vector<std::int32_t> free = surface_nodes(mesh);
    std::erase_if(free, [&](std::int32_t n) {
        return held[n] == 7 || (nodes && !std::binary_search(nodes->begin(), nodes->end(), n));
    });
    return free;
}

void add_zone(SoughtForces& sought, const std::string& key, const TetMesh& mesh,
              const std::vector<std::int32_t>& nodes, ForcePattern pattern, std::size_t centres) {
    if (nodes.empty())
        fail("{}: none of its nodes is on the surface and free to move, expected some", key);
    const std::size_t first = sought.basis.size();
    sought.basis.add(pattern == ForcePattern::uniform
                         ? uniform_forces(nodes)
                         : smooth_forces(mesh.nodes, nodes, std::min(centres, nodes.size())));
    for (std::size_t j = first; j < sought.basis.size(); ++j) {
        const ForceBasis::Column& column = sought.basis.column(j);
        Vector3 place = Vector3::Zero();
        for (std::size_t k = 0; k < column.nodes.size(); ++k)
            place += column.shares[k] * mesh.nodes[column.nodes[k]];
        place *= 1e3;
        sought.names.push_back(fmt::format("{} at ({:.0f}, {:.0f}, {:.0f}) mm along {}", key,
                                           place.x(), place.y(), place.z(), "xyz"[column.axis]));
    }
}

SoughtForces sought_forces(const DeformOptions& deform, const TetMesh& mesh,
                           const SceneConstraints& constraints) {
    SoughtForces sought;
    if (deform.forces.empty())
        add_zone(sought, "forces", mesh, free_surface(mesh, constraints, {}), ForcePattern::smooth,
                 default_centres);
    for (std::size_t i = 0; i < deform.forces.size(); ++i) {
        const ForceZoneOptions& zone = deform.forces[i];
        const std::string key = fmt::format("deform.forces[{}]", i);
        add_zone(sought, key, mesh, free_surface(mesh, constraints, select_nodes(mesh, zone, key)),
                 zone.pattern, static_cast<std::size_t>(zone.centres));
    }
    return sought;
}

SurfaceRegistrationOptions registration_options(const DeformOptions& deform) {
    SurfaceRegistrationOptions options;
    options.point_error_m = deform.point_error_mm / 1e3;
    options.landmark_error_m = deform.landmark_error_mm / 1e3;
    options.shared_error_m = deform.shared_error_mm / 1e3;
    if (deform.energy_mJ.number) options.prior_energy_J = *deform.energy_mJ.number / 1e3;
    options.starts_whole = !deform.forces.empty();
    options.tolerance_m = deform.tolerance_mm / 1e3;
    options.max_iterations = deform.max_iterations;
    if (deform.frame != PointFrame::fixed) {
        options.pose_error_m = deform.frame_error_mm / 1e3;
        options.pose_error_rad = deform.frame_error_deg * std::numbers::pi / 180;
    }
    return options;
}

/// The best rigid motion of the points to the surface at rest. A fifth of them is left out: the
/// deformation, and points of something else, are not rigid.
SurfaceFit fit_rigidly(const MeasuredOrgan& measured, const TriangleMesh& surface) {
    return with_context(measured.source, [&] {
        return fit_to_surface(measured.points, surface, {.trimmed_share = 0.2});
    });
}

RigidTransform<ImageFrame, ImageFrame> motion_of(const PointPose& pose) {
    const Eigen::Matrix3d rotation = rotation_of_vector(pose.turn);
    return {rotation, pose.centre + pose.translation - rotation * pose.centre};
}

/// `model_share`: standard deviation of the model's own error along an axis, of the displacement.
TargetSpread spread_at(const SurfaceRegistration& registration, const SurfacePosterior& posterior,
                       const BodyPlace& place, double model_share) {
    const Eigen::MatrixXd rows = registration.place_rows(place);
    const Eigen::Index forces = std::ssize(registration.coefficients());
    TargetSpread spread;
    spread.place = place;
    const Eigen::Matrix3d c = rows * posterior.covariance * rows.transpose();
    const double of_model = model_share * place.of(registration.displacement()).norm();
    spread.covariance = (c + c.transpose()) / 2 + of_model * of_model * Eigen::Matrix3d::Identity();
    spread.by_model_m2 = 3 * of_model * of_model;
    spread.radius_95 = error_ellipsoid(spread.covariance).radius_95;
    const Eigen::Index pose = rows.cols() - forces;
    if (pose > 0)
        spread.by_pose_m2 =
            (rows.rightCols(pose) * posterior.covariance.bottomRightCorner(pose, pose) *
             rows.rightCols(pose).transpose())
                .trace();
    return spread;
}

/// The places of each target of the scene, with its name.
std::vector<std::pair<std::string, std::vector<BodyPlace>>> places_of_targets(
    const Scene& scene, const DeformOptions& deform, const TetMesh& mesh) {
    std::vector<Target> targets;
    if (!deform.targets.empty())
        targets = read_targets(deform.targets, "deform.targets", mesh);
    else if (scene.track)
        targets = read_targets(scene, mesh);
    if (targets.empty()) return {};
    std::vector<Vector3> all;  // each search makes a tree of the mesh
    for (const Target& target : targets)
        all.insert(all.end(), target.places.begin(), target.places.end());
    const std::vector<BodyPlace> found = places_in(mesh, all);
    std::vector<std::pair<std::string, std::vector<BodyPlace>>> places;
    auto next = found.begin();
    for (const Target& target : targets) {
        const auto end = next + std::ssize(target.places);
        places.emplace_back(target.name, std::vector<BodyPlace>(next, end));
        next = end;
    }
    return places;
}

/// What the points determine, and what they do not.
void state_posterior(const SoughtForces& sought, const SurfacePosterior& posterior,
                     DeformedOrgan& found) {
    const auto n = static_cast<Eigen::Index>(sought.basis.size());
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(3, n);
    for (Eigen::Index j = 0; j < n; ++j)
        sum(sought.basis.column(static_cast<std::size_t>(j)).axis, j) = 1;
    const Eigen::Matrix3d c = sum * posterior.covariance.topLeftCorner(n, n) * sum.transpose();
    found.total_force_radius_95_N = error_ellipsoid((c + c.transpose()) / 2).radius_95;
    found.directions = sought.basis.size();
    const auto open = [](const Eigen::VectorXd& ratios) {
        return static_cast<std::size_t>((ratios.array() > open_ratio).count());
    };
    found.open_directions = open(posterior.direction_ratio);
    found.open_motions = open(posterior.pose_ratio);
    for (Eigen::Index j = 0; j < n; ++j)
        if (posterior.force_ratio[j] > open_ratio)
            found.open_forces.push_back(sought.names[static_cast<std::size_t>(j)]);
    found.is_stated = found.report.converged;
}

}  // namespace

DeformOptions deform_options(const Scene& scene) { return scene.deform.value_or(DeformOptions{}); }

void check_deform_scene(const Scene& scene) {
    const auto refuse = [](const char* key, const char* why) {
        fail("{}: a deforming registration finds {}, expected none", key, why);
    };
    if (scene.time.is_dynamic())
        fail("time.scheme: a deforming registration is static, expected time.scheme: static");
    if (!scene.loads.empty()) refuse("loads", "the forces itself");
    if (!scene.drive.empty()) refuse("drive", "the displacement itself");
    if (scene.gravity_m_per_s2 != Vector3::Zero())
        refuse("gravity_m_per_s2", "what changes from the image, where gravity acts already");
}

DeformingRegistration::DeformingRegistration(const Scene& scene, SceneBody& body,
                                             const SceneConstraints& constraints)
    : scene_(scene),
      body_(body),
      deform_(deform_options(scene)),
      surface_{mesh().nodes, boundary_triangles(mesh().tets)},
      sought_(sought_forces(deform_, mesh(), constraints)),
      targets_(places_of_targets(scene, deform_, mesh())) {
    body_.body->set_constraints(constraints.constraints());
    body_.body->set_springs(constraints.springs());
    start_again();
}

void DeformingRegistration::start_again() {
    Stopwatch watch;
    SurfaceRegistrationOptions options = registration_options(deform_);
    options.progress = [this](double fraction, std::string_view what) {
        if (progress_) progress_(fraction, what);
    };
    registration_ = std::make_unique<SurfaceRegistration>(
        *body_.body, mesh().nodes, surface_.triangles, sought_.basis, options);
    set_up_s_ = watch.lap();
}

void DeformingRegistration::check(const MeasuredOrgan& measured) const {
    const std::size_t motions = deform_.frame == PointFrame::fixed ? 0 : 6;
    check_measured(measured, surface_, sought_.basis.size() + motions);
}

DeformingRegistration::PlacedPoints DeformingRegistration::placed(
    const MeasuredOrgan& measured) const {
    PlacedPoints placed{measured.points, {}};
    std::vector<Vector3> at_rest;
    for (const MeasuredLandmark& l : measured.landmarks) at_rest.push_back(l.at_rest);
    if (!at_rest.empty()) {
        const std::vector<BodyPlace> places = places_in(mesh(), at_rest);
        for (std::size_t i = 0; i < places.size(); ++i)
            placed.landmarks.push_back({places[i], measured.landmarks[i].measured});
    }
    if (!start_) return placed;
    for (Vector3& c : placed.points) c = *start_ * c;
    for (Landmark& l : placed.landmarks) l.measured = *start_ * l.measured;
    return placed;
}

DeformedOrgan DeformingRegistration::fit(const MeasuredOrgan& measured,
                                         std::optional<int> max_iterations,
                                         const ProgressCallback& progress) {
    DeformedOrgan found;
    if (deform_.frame == PointFrame::surface && !start_)
        start_ = fit_rigidly(measured, surface_).image_from_start;
    const PlacedPoints points = placed(measured);
    const auto start = std::chrono::steady_clock::now();
    progress_ = [&](double fraction, std::string_view what) {
        if (found.first_step_s == 0) found.first_step_s = set_up_s_ + seconds_since(start);
        if (progress) progress(fraction, what);
    };
    found.report = with_context(measured.source, [&] {
        return registration_->fit(points.points, points.landmarks, max_iterations);
    });
    progress_ = {};
    found.fit_s = set_up_s_ + seconds_since(start);
    set_up_s_ = 0;
    found.image_from_points = motion_of(registration_->pose());
    if (start_) found.image_from_points = found.image_from_points * *start_;
    return found;
}

namespace {

/// Whether a fit was cut short, so that the next one goes on from there.
bool goes_on(const DeformedOrgan& found, int max_iterations) {
    return !found.report.converged && found.report.iterations == max_iterations;
}

}  // namespace

void DeformingRegistration::refuse_other_surface(const MeasuredOrgan& measured,
                                                 const DeformedOrgan& found,
                                                 int max_iterations) const {
    constexpr double most = 3;  // standard deviations: half of normal errors are within 0.67
    const SurfaceRegistrationReport& r = found.report;
    if (goes_on(found, max_iterations) || r.median_m < most * deform_.point_error_mm / 1e3) return;
    fail(
        "{}: the points are not of this surface, deformed as deform.forces allows: {:.1f} mm "
        "(median) from it ({:.1f} mm RMS where it is moved rigidly), expected less than {:.1f} mm "
        "for deform.point_error_mm = {:g}",
        measured.source, 1e3 * r.median_m, 1e3 * fit_rigidly(measured, surface_).rms_after,
        most * deform_.point_error_mm, deform_.point_error_mm);
}

void DeformingRegistration::refuse_other_equilibrium(DeformedOrgan& found) {
    constexpr double most = 5;  // tolerances; as a rule it is a hundredth of that
    const std::vector<Vector3> u = body_.body->displacement();
    double moved_m = 0;
    for (std::size_t n = 0; n < u.size(); ++n)
        moved_m = std::max(moved_m, (u[n] - registration_->displacement()[n]).norm());
    if (moved_m < most * deform_.tolerance_mm / 1e3) return;
    body_.body->return_to_kept_state();
    found.report.converged = found.is_stated = false;
    found.report.reason = "the forces found hold the organ in no equilibrium near what was fitted";
}

void DeformingRegistration::state_errors(DeformedOrgan& found) {
    const SurfacePosterior posterior = registration_->posterior();
    state_posterior(sought_, posterior, found);
    for (const auto& [name, places] : targets_) {
        TargetSpread worst;
        for (const BodyPlace& place : places) {
            TargetSpread spread =
                spread_at(*registration_, posterior, place, deform_.model_error_percent / 100);
            if (spread.radius_95 >= worst.radius_95) worst = std::move(spread);
        }
        worst.name = name;
        worst.position =
            worst.place.of(mesh().nodes) + worst.place.of(registration_->displacement());
        found.targets.push_back(std::move(worst));
    }
}

void DeformingRegistration::place_targets(DeformedOrgan& found) const {
    for (const auto& [name, places] : targets_) {
        TargetSpread& target = found.targets.emplace_back();
        target.name = name;
        target.place = places.front();
        target.position =
            target.place.of(mesh().nodes) + target.place.of(registration_->displacement());
    }
}

void DeformingRegistration::bring_to_rest(DeformedOrgan& found, int max_iterations) {
    constexpr int chords = 4;  // by the factorisation of the last tangent, of here or a step away
    const bool is_factored = body_.body->linear_solver().kind() == SolverKind::direct;
    body_.body->set_external_force(registration_->forces());
    SolveControls controls = solve_controls(scene_);
    if (is_factored) controls.old_tangents = chords;
    if (is_factored && goes_on(found, max_iterations)) {
        // What comes next moves it on: not worth a factorisation.
        controls.max_newton = chords;
        controls.tolerance = std::max(controls.tolerance, 1e-4);
    }
    body_.body->keep_state();
    found.equilibrium = body_.body->solve(0, controls);
    refuse_other_equilibrium(found);
}

DeformedOrgan DeformingRegistration::finish(const MeasuredOrgan& measured,
                                            const ProgressCallback& progress,
                                            std::optional<int> max_iterations) {
    const int most = max_iterations.value_or(deform_.max_iterations);
    check(measured);
    double rigid_rms_m = 0;
    if (!has_finished_) {
        const SurfaceFit rigid = fit_rigidly(measured, surface_);
        if (deform_.frame == PointFrame::surface && !start_) start_ = rigid.image_from_start;
        rigid_rms_m = rigid.rms_after;
        has_finished_ = true;
    }
    DeformedOrgan found = fit(measured, most, progress);
    found.rigid_rms_m = rigid_rms_m;
    refuse_other_surface(measured, found, most);
    if (found.report.converged) {
        if (progress) progress(1, "what the points determine");
        state_errors(found);
    }
    bring_to_rest(found, most);
    const std::vector<Vector3> u = body_.body->displacement();
    for (TargetSpread& t : found.targets) t.position = t.place.of(mesh().nodes) + t.place.of(u);
    return found;
}

}  // namespace livetet
