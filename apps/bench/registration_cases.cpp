#include "apps/bench/registration_cases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "apps/simulation/scene_run.hpp"
#include "base/error.hpp"
#include "geometry/triangle_area.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace {

double rms_of(std::span<const Vector3> vectors) {
    double squares = 0;
    for (const Vector3& v : vectors) squares += v.squaredNorm();
    return std::sqrt(squares / static_cast<double>(vectors.size()));
}

/// The organ's scene, gripped about a place by springs whose other ends move.
Scene gripped_scene(const Vector3& place, const Vector3& motion, const ModelChoice& strain,
                    int steps) {
    constexpr double radius_mm = 25, stiffness_N_per_m = 500;  // about thrice the organ's
    Scene scene;
    scene.materials = {Material{.poisson = 0.45}};
    scene.strain = strain;
    scene.elements = Elements::p2;
    FixOptions fix;
    fix.group = "fixed";
    scene.fix = {fix};
    DriveOptions grip;
    grip.sphere_mm = {1e3 * place.x(), 1e3 * place.y(), 1e3 * place.z(), radius_mm};
    grip.where = NodeScope::surface_only;
    grip.displacement_mm = 1e3 * motion;
    grip.stiffness_N_per_m = stiffness_N_per_m;
    scene.drive = {grip};
    scene.time.load_steps = steps;
    scene.solver.newton_tolerance = 1e-5;
    return scene;
}

/// Displacements at each load step that comes to rest. `mesh`: of ten nodes, on return.
std::vector<std::vector<Vector3>> solve_pull(const Scene& scene, MeshHierarchy hierarchy,
                                             TetMesh& mesh, const ProgressCallback& progress) {
    SceneBody body = make_body(PETSC_COMM_WORLD, scene, std::move(hierarchy), Use::solve);
    mesh = body.mesh();
    SceneConstraints constraints(scene, mesh);
    std::vector<std::vector<Vector3>> kept;
    RunHooks hooks;
    hooks.progress = progress;
    hooks.keep = [&](std::size_t, double) { kept.push_back(body.body->displacement()); };
    (void)run_scene(scene, *body.body, constraints, {},
                    hooks);  // the steps that came to rest count
    if (kept.empty())
        fail(
            "bench registration: the organ does not come to rest, expected rest under the "
            "first load step");
    return kept;
}

}  // namespace

double PulledOrgan::target_rms(std::size_t step) const {
    std::vector<Vector3> motion;
    for (std::size_t t = 0; t < targets.size(); ++t)
        motion.push_back(moved[step][t] - targets[t].position);
    return rms_of(motion);
}

std::size_t PulledOrgan::step_of(double rms_m) const {
    std::size_t best = 0;
    for (std::size_t k = 1; k < moved.size(); ++k)
        if (std::abs(target_rms(k) - rms_m) < std::abs(target_rms(best) - rms_m)) best = k;
    return best;
}

double PulledOrgan::largest(std::size_t step) const {
    double largest = 0;
    for (const Vector3& u : displacements[step]) largest = std::max(largest, u.norm());
    return largest;
}

PulledOrgan pull_organ(const BenchOrgan& from, int tets, std::uint64_t seed, double max_rms_m,
                       const ProgressCallback& progress) {
    constexpr double probe_m = 0.001;
    constexpr int load_steps = 6;
    std::mt19937_64 engine(seed);
    PulledOrgan organ;
    const auto [place, direction] = from.grip(engine);
    organ.place = place;
    organ.below = from.below;
    organ.up = from.up;
    const MeshHierarchy hierarchy = from.mesh(tets, progress);
    organ.targets = from.targets(hierarchy.levels.front(), place);
    std::vector<Vector3> rest;
    for (const NamedPoint& t : organ.targets) rest.push_back(t.position);
    const auto places = [&](std::span<const Vector3> u) {
        return PointSampler(organ.mesh, rest).sample(u);
    };
    const auto linear = solve_pull(gripped_scene(organ.place, probe_m * direction, "linear", 1),
                                   hierarchy, organ.mesh, progress);
    const double motion = max_rms_m / rms_of(places(linear.front())) * probe_m;
    organ.displacements =
        solve_pull(gripped_scene(organ.place, motion * direction, "neohookean", load_steps),
                   hierarchy, organ.mesh, progress);
    for (const std::vector<Vector3>& u : organ.displacements) {
        std::vector<Vector3> moved = places(u);
        for (std::size_t t = 0; t < moved.size(); ++t) moved[t] += rest[t];
        organ.moved.push_back(std::move(moved));
    }
    return organ;
}

std::vector<Vector3> sweep_surface(const PulledOrgan& organ, std::size_t step,
                                   const SurfaceSweep& sweep) {
    const std::vector<Triangle> triangles = boundary_triangles(organ.mesh.tets);
    const auto& rest = organ.mesh.nodes;
    const auto& u = organ.displacements[step];
    const auto area = [&](const Triangle& t) { return area_vector(rest, t).norm(); };
    const auto distance = [&](const Triangle& t) {
        return ((rest[t[0]] + rest[t[1]] + rest[t[2]]) / 3 - organ.place).norm();
    };
    // The part about the place of the pull, grown until it has its share of the area.
    std::vector<Triangle> seen = triangles;
    std::sort(seen.begin(), seen.end(),
              [&](const Triangle& a, const Triangle& b) { return distance(a) < distance(b); });
    double all = 0;
    for (const Triangle& t : triangles) all += area(t);
    std::vector<double> areas;
    double sum = 0;
    for (const Triangle& t : seen) {
        if (sum >= sweep.coverage * all) break;
        areas.push_back(area(t));
        sum += areas.back();
    }
    std::mt19937_64 engine(sweep.seed);
    std::discrete_distribution<std::size_t> choose(areas.begin(), areas.end());
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<Vector3> points;
    for (std::size_t i = 0; i < sweep.points; ++i) {
        const Triangle& t = seen[choose(engine)];
        const double root = std::sqrt(uniform(engine)), b = root * uniform(engine);
        const double weights[] = {1 - root, root - b, b};
        Vector3 c = Vector3::Zero();
        for (int k = 0; k < 3; ++k) c += weights[k] * (rest[t[k]] + u[t[k]]);
        c += sweep.noise_m * normal_vector(engine);
        if (uniform(engine) < sweep.outliers)
            c += (0.01 + 0.03 * uniform(engine)) * normal_vector(engine).normalized();
        points.push_back(c);
    }
    return points;
}

}  // namespace livetet
