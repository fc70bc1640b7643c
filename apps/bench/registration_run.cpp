#include "apps/bench/registration_run.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <random>

#include "apps/simulation/deforming_registration.hpp"
#include "base/error.hpp"
#include "geometry/surface_fit.hpp"
#include "geometry/transform.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

FixOptions model_support(KnownSupport support, const PulledOrgan& organ) {
    FixOptions fix;
    if (support == KnownSupport::fixed) {
        fix.group = "fixed";
        return fix;
    }
    const Vector3 below = 1e3 * organ.below;
    fix.half_space_mm = {below.x(), below.y(), below.z(), organ.up.x(), organ.up.y(), organ.up.z()};
    fix.where = NodeScope::surface_only;
    fix.stiffness_N_per_m = 1000;
    return fix;
}

Scene model_scene(const RegistrationCell& cell, const PulledOrgan& organ,
                  const RegistrationPrior& prior) {
    Scene scene;
    scene.materials = {Material{.poisson = 0.40}};
    scene.strain = cell.law;
    scene.solver.kind = SolverKind::direct;  // each tangent serves for all patterns of forces
    scene.fix = {model_support(cell.support, organ)};
    DeformOptions deform;
    if (cell.forces != KnownForces::nowhere) {
        const bool is_wide = cell.forces == KnownForces::wide_zone;
        const Vector3 off = is_wide ? Vector3(6, -8, 0) : Vector3(3, -4, 0);
        const Vector3 centre = 1e3 * organ.place + off;
        ForceZoneOptions zone;
        zone.sphere_mm = {centre.x(), centre.y(), centre.z(), is_wide ? 40.0 : 30.0};
        deform.forces = {zone};
    }
    deform.point_error_mm = std::max(0.5, 1e3 * cell.sweep.noise_m);
    deform.energy_mJ = {prior.energy_mJ};
    deform.shared_error_mm = prior.shared_error_mm;
    deform.model_error_percent = prior.model_error_percent;
    deform.frame_error_mm = 2;
    deform.frame_error_deg = 1;
    for (const NamedPoint& t : organ.targets) {
        TargetOptions target;
        target.name = t.name;
        target.point_mm = 1e3 * t.position;
        deform.targets.push_back(target);
    }
    scene.deform = deform;
    return scene;
}

/// As after a rigid registration.
RigidTransform<ImageFrame, ImageFrame> frame_offset(std::uint64_t seed) {
    constexpr double shift_m = 0.002, turn_deg = 1;
    std::mt19937_64 engine(seed + 1000);
    std::normal_distribution<double> normal(0, 1);
    const auto direction = [&] {
        const double x = normal(engine), y = normal(engine), z = normal(engine);
        return Vector3(x, y, z).normalized();
    };
    const Vector3 turn = turn_deg * radians_per_degree * direction();
    return {rotation_of_vector(turn), shift_m * direction()};
}

}  // namespace

double rms_over(const std::vector<RegistrationRun>& runs, Vector3 RegisteredTarget::*vector) {
    double squares = 0, count = 0;
    for (const RegistrationRun& run : runs)
        for (const RegisteredTarget& t : run.targets) squares += (t.*vector).squaredNorm(), ++count;
    return std::sqrt(squares / count);
}

RegistrationRun run_registration(const RegistrationCell& cell, const PulledOrgan& organ,
                                 const MeshHierarchy& model, std::uint64_t seed,
                                 const RegistrationPrior& prior) {
    constexpr double within_95 = 7.815;  // chi-square of three degrees of freedom
    const std::size_t step = organ.step_of(cell.rms_m);
    RegistrationRun run;
    run.largest_m = organ.largest(step);
    SurfaceSweep sweep = cell.sweep;
    sweep.seed = seed;
    const RigidTransform<ImageFrame, ImageFrame> offset = frame_offset(seed);
    MeasuredOrgan measured{"the sweep", sweep_surface(organ, step, sweep), {}};
    for (Vector3& c : measured.points) c = offset * c;

    const Scene scene = model_scene(cell, organ, prior);
    SceneBody body = make_body(PETSC_COMM_WORLD, scene, model, Use::solve);
    const SceneConstraints constraints(scene, body.mesh());
    const TriangleMesh surface{body.mesh().nodes, boundary_triangles(body.mesh().tets)};
    const auto rigid =
        fit_to_surface(measured.points, surface, {.trimmed_share = 0.2}).image_from_start;
    for (std::size_t t = 0; t < organ.targets.size(); ++t) {
        const Vector3& rest = organ.targets[t].position;
        const Vector3 error = rigid * (offset * organ.moved[step][t]) - rest;
        run.targets.push_back({organ.moved[step][t] - rest, error, error});
    }
    try {
        const std::clock_t start = std::clock();
        const auto seconds = [&] {
            return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
        };
        const DeformedOrgan found =
            DeformingRegistration(scene, body, constraints)
                .finish(measured, [&](double /*fraction*/, std::string_view /*what*/) {
                    if (run.first_s == 0) run.first_s = seconds();
                });
        run.fit_s = seconds();
        run.converged = found.report.converged;
        run.reason = found.report.reason;
        run.is_stated = found.is_stated;
        run.directions = found.directions;
        run.open_directions = found.open_directions;
        run.iterations = found.report.iterations;
        run.energy_mJ = 1e3 * found.report.prior.energy;
        const std::vector<Vector3> u = PointSampler(body.mesh(), positions_of(organ.targets))
                                           .sample(body.body->displacement());
        for (std::size_t t = 0; t < u.size(); ++t) {
            RegisteredTarget& target = run.targets[t];
            target.deforming = found.image_from_points * (offset * organ.moved[step][t]) -
                               organ.targets[t].position - u[t];
            if (!found.is_stated) continue;
            target.radius_95 = found.targets[t].radius_95;
            target.within = target.deforming.dot(found.targets[t].covariance.inverse() *
                                                 target.deforming) < within_95;
        }
    } catch (const Error& e) {
        run.refusal = e.what();
    }
    return run;
}

}  // namespace livetet
