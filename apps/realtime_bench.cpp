#include "apps/realtime_bench.hpp"

#include <fmt/format.h>
#include <sys/resource.h>

#include <Eigen/Dense>

#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>

#include "apps/allocation_count.hpp"
#include "apps/live_model.hpp"
#include "apps/phantom.hpp"
#include "apps/phantom_shape.hpp"
#include "apps/pictures.hpp"
#include "base/distribution.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/progress.hpp"
#include "mesh/node_selection.hpp"
#include "meshing/gmsh_volume.hpp"
#include "meshing/image_surface.hpp"
#include "meshing/levels.hpp"
#include "solvers/petsc_session.hpp"
#include "tracking/poses.hpp"
#include "verification/meshes.hpp"

namespace livetet {

namespace {

using nlohmann::json;

// ---- what is measured ----

/// One frame, timed, and how far it was from the converged one.
struct Measured {
    double seconds = 0;
    StepReport step;
    double sensor_s = 0, output_s = 0;
    double largest = 0;                 ///< displacement of the converged frame, m
    double error = -1, node_error = 0;  ///< RMS over the nodes, and at the worst one, m; -1: not looked at
    bool reference_converged = true;    ///< what the errors are measured against
};

struct Result {
    std::string name, motion;
    double nu = 0;
    std::size_t tets = 0, nodes = 0;
    int threads = 1;
    bool is_beam = false;
    double rate_asked = 0, mean_allowed = 0, worst_allowed = 0;
    Distribution seconds;
    double error_mean = 0, error_worst = 0, estimate_mean = 0;  ///< RMS over the nodes, of the largest displacement
    double node_error_mean = 0, node_error_worst = 0;           ///< at the worst node, of the largest displacement
    double cycles_mean = 0;
    std::size_t cut_short = 0, frames = 0;
    std::size_t references_not_converged = 0;
    std::uint64_t allocations = 0;
    long blocked = 0;  ///< times that the simulation thread gave up its core of itself
    double bytes = 0;  ///< of a frame
    double bandwidth = 0;
    json stages;
    json jump;

    double rate() const { return 1 / seconds.p99; }
    /// Rates are asked for at the 99th percentile; of a beam's step, which no tracker waits for, the median.
    bool in_time() const { return 1 / (is_beam ? seconds.median : seconds.p99) >= rate_asked; }
    bool held() const {
        return in_time() && error_mean <= mean_allowed && error_worst <= worst_allowed && allocations == 0 &&
               blocked == 0;
    }
};

long times_blocked() {
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_nvcsw;
}

/// Bytes a second that the team reads from memory, far more than caches hold.
double measure_bandwidth(int threads) {
    ThreadTeam team(threads);
    const std::vector<double> values(32 << 20, 1.0);
    std::vector<double> sums(threads);
    double best = 1e300;
    for (int k = 0; k < 6; ++k) {
        const auto start = Clock::now();
        team.run([&](int t) {
            const std::size_t n = values.size() / threads;
            sums[t] += Eigen::Map<const Eigen::VectorXd>(values.data() + t * n, static_cast<Eigen::Index>(n)).sum();
        });
        best = std::min(best, std::chrono::duration<double>(Clock::now() - start).count());
    }
    if (!(sums[0] > 0)) fail("bench realtime: the bandwidth's sum is {}", sums[0]);
    return 8.0 * static_cast<double>(values.size()) / best;
}

/// What a frame has to move at least: every array once where it is used. Batches and rotations in double for the
/// rotations and for the forces; about forty passes over vectors of doubles in a step and eight more an iteration.
double bytes_of_frame(DeformableBody& body, std::size_t tets, std::size_t nodes, double iterations, bool dynamic) {
    const double batches = static_cast<double>(tets) / batch_width<double>;
    const double forces = batches * (2 * sizeof(TetBatch<double>) + 2 * sizeof(RotationBatch<double>));
    const double vectors = 24.0 * static_cast<double>(nodes) * ((dynamic ? 45 : 28) + 9 * iterations);
    ElasticOperator& op = body.elastic_operator();
    return forces + vectors + op.bytes_of_update() + op.bytes_of_solve(iterations);
}

struct Gap {
    double rms = 0, node = 0, largest = 0;
};

Gap gap_between(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
    Gap gap;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double d = (a[i] - b[i]).norm();
        gap.rms += d * d / static_cast<double>(a.size());
        gap.node = d > gap.node || std::isnan(d) ? d : gap.node;
        gap.largest = std::max(gap.largest, b[i].norm());
    }
    gap.rms = std::sqrt(gap.rms);
    return gap;
}

// ---- the phantom, pressed ----

/// What is given to a frame that must end in time: this machine now and then takes two milliseconds for itself.
double budget_within(double seconds) { return std::max(0.5 * seconds, seconds - 0.002); }

struct PhantomSize {
    std::string name;
    std::int64_t tets;
    double rate;  ///< frames a second asked for at nu = 0.45
    double mean_allowed, worst_allowed;
};

MeshHierarchy mesh_phantom(const PhantomImages& images, const PhantomSize& size, const ProgressCallback& progress) {
    MeshingOptions options;
    options.target_tets = size.tets;
    options.target_tolerance = 0.03;
    MeshHierarchy hierarchy =
        std::move(build_hierarchy(surface_of_labels(images.labels, options).surface, options, progress).hierarchy);
    hierarchy.levels.front().node_sets["fixed"] = nodes_in_mask(hierarchy.levels.front(), images.fixed_mask);
    return hierarchy;
}

Scene phantom_scene(double nu, TimeScheme scheme, double rate, int threads) {
    Scene scene;
    scene.materials = {{.young_Pa = 3000, .poisson = nu, .density_kg_per_m3 = 1060}};
    scene.fix.push_back({});
    scene.fix.back().group = "fixed";
    scene.time.scheme = scheme;
    scene.time.step_s = 1 / rate;
    if (scheme != TimeScheme::static_equilibrium) {
        scene.time.rayleigh_alpha = 10;
        scene.time.rayleigh_beta = 0.01;
    }
    scene.solver.threads = threads;
    scene.track = TrackOptions{};
    scene.track->reference_tool = "Reference";
    scene.track->sensor_tool = "Sensor";
    scene.track->base_window_s = 0.5;
    return scene;
}

std::vector<RegisteredFiducial> phantom_fiducials(const SimulatedTrackerOptions& tracker) {
    std::vector<RegisteredFiducial> fiducials;
    for (const NamedPoint& f : phantom::fiducials()) {
        RegisteredFiducial r;
        r.name = f.name;
        r.in_image = f.position;
        r.in_reference = tracker.image_from_reference.inverse() * f.position;
        fiducials.push_back(r);
    }
    return fiducials;
}

constexpr double base_s = 0.6;  ///< at rest, while the sensor's place is measured

/// The organ moves, the sensor is pressed by `depth(t)` metres, t from the end of the rest.
template <class Depth>
std::vector<TrackerSample> record_press(SimulatedTrackerOptions tracker, double rate, int frames, Depth&& depth) {
    TrackerNoise noise(tracker);
    std::vector<TrackerSample> samples;
    const int rest = static_cast<int>(std::ceil(base_s * rate));
    for (int k = 0; k < rest + frames; ++k) {
        const double t = k / rate, pressed = k < rest ? 0 : depth((k - rest) / rate);
        const auto tracker_from_image = true_tracker_from_image(tracker, t);
        auto image_from_sensor = tracker.image_from_sensor_at_rest;
        image_from_sensor.translation += pressed * tracker.press_direction.normalized();
        const auto reference = tracker_from_image * tracker.image_from_reference;
        const auto sensor = tracker_from_image * image_from_sensor;
        samples.push_back({t,
                           {noise({reference.rotation, reference.translation, PoseStatus::ok}),
                            noise({sensor.rotation, sensor.translation, PoseStatus::ok})}});
    }
    return samples;
}

/// What is asked of a frame.
struct FrameLimits {
    std::optional<double> budget_s;
    int iterations = 0;
};

/// A body on a phantom's mesh that follows samples, and one that solves the same steps to the end.
class Follower {
  public:
    Follower(const Scene& scene, const MeshHierarchy& hierarchy, const SimulatedTrackerOptions& tracker)
        : scene_(scene),
          body_(make_body(PETSC_COMM_SELF, scene_, MeshHierarchy(hierarchy), true)),
          model_(scene_, body_, {"Reference", "Sensor"}, phantom_fiducials(tracker)) {}

    Measured frame(const TrackerSample& sample, const FrameLimits& limits) {
        Measured m;
        const auto start = Clock::now();
        std::optional<Clock::time_point> deadline;
        if (limits.budget_s)
            deadline = start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(*limits.budget_s));
        const Frame& frame = model_.advance(sample, deadline, limits.iterations);
        m.seconds = std::chrono::duration<double>(Clock::now() - start).count();
        m.step = frame.step;
        m.sensor_s = frame.sensor_s;
        m.output_s = frame.output_s;
        return m;
    }

    /// The same, compared with the converged solve of the same step.
    Measured judged_frame(const TrackerSample& sample, const FrameLimits& limits, double dt) {
        if (!reference_) {  // the same kernels: they agree with the plain path (LiveSolver tests) and are twenty times as fast
            SolverOptions converged = scene_.solver;
            converged.kind = SolverKind::live;
            reference_ = std::make_unique<DeformableBody>(PETSC_COMM_SELF, body_.hierarchy, body_.parts,
                                                          elastic_model(scene_, true), scene_.time, converged);
        }
        const bool is_static = scene_.time.scheme == TimeScheme::static_equilibrium;
        if (!is_static) reference_->copy_state(*body_.body);
        Measured m = frame(sample, limits);
        if (is_static) reference_->copy_state(*body_.body);  // equilibrium has no past: from as near as can be
        reference_->set_constraints(model_.constraints());
        reference_->move_constraints(model_.driven(), model_.driven_to());
        m.reference_converged = reference_->step(dt, {.linearisations = 60, .tolerance = 1e-6, .linear_tolerance = 1e-2}).converged;
        const Gap gap = gap_between(body_.body->displacement(), reference_->displacement());
        m.error = gap.rms;
        m.node_error = gap.node;
        m.largest = gap.largest;
        return m;
    }

    DeformableBody& body() { return *body_.body; }
    const TetMesh& mesh() const { return body_.mesh(); }

  private:
    Scene scene_;
    SceneBody body_;
    LiveModel model_;
    std::unique_ptr<DeformableBody> reference_;
};

double press_depth(double t) { return 0.0075 * (1 - std::cos(2 * std::numbers::pi * t)); }

SimulatedTrackerOptions bench_tracker() { return phantom_tracker(PhantomOptions{}); }

json stages_of(const std::vector<Measured>& frames) {
    const auto median_ms = [&](auto&& part) {
        std::vector<double> values;
        for (const Measured& m : frames) values.push_back(1e3 * part(m));
        return distribution(std::move(values)).median;
    };
    return {{"sensor", median_ms([](const Measured& m) { return m.sensor_s; })},
            {"forces", median_ms([](const Measured& m) { return m.step.forces_s; })},
            {"operator", median_ms([](const Measured& m) { return m.step.operator_s; })},
            {"solve", median_ms([](const Measured& m) { return m.step.solve_s; })},
            {"finish", median_ms([](const Measured& m) { return m.step.finish_s; })},
            {"output", median_ms([](const Measured& m) { return m.output_s; })}};
}

void take_times(Result& result, const std::vector<Measured>& frames) {
    std::vector<double> seconds;
    for (const Measured& m : frames) {
        seconds.push_back(m.seconds);
        result.cycles_mean += m.step.iterations / static_cast<double>(frames.size());
        result.cut_short += m.step.cut_short;
    }
    result.frames = frames.size();
    result.seconds = distribution(std::move(seconds));
    result.stages = stages_of(frames);
}

void take_errors(Result& result, const std::vector<Measured>& frames) {
    double largest = 0, count = 0;
    for (const Measured& m : frames) largest = std::max(largest, m.largest);
    for (const Measured& m : frames) {
        if (m.error < 0) continue;
        ++count;
        result.references_not_converged += !m.reference_converged;
        result.error_mean += m.error / largest;
        result.error_worst = std::max(result.error_worst, m.error / largest);
        result.node_error_mean += m.node_error / largest;
        result.node_error_worst = std::max(result.node_error_worst, m.node_error / largest);
        result.estimate_mean += m.step.solve_error / largest;
    }
    for (double* mean : {&result.error_mean, &result.node_error_mean, &result.estimate_mean}) *mean /= std::max(count, 1.0);
}

/// One jump of 10 mm within a frame, the filter off so that nothing softens it: the ten frames after it.
json measure_jump(const Scene& pressed, const MeshHierarchy& hierarchy, double rate, int iterations) {
    Scene scene = pressed;
    scene.track->smoothing_Hz = 0;
    SimulatedTrackerOptions tracker = bench_tracker();
    tracker.position_rms_mm = tracker.rotation_rms_deg = 0;
    constexpr int before = 5, after = 10;
    const auto samples = record_press(tracker, rate, before + after, [&](double t) { return t * rate < before - 0.5 ? 0.0 : 0.01; });
    Follower follower(scene, hierarchy, tracker);
    json errors = json::array();
    bool finite = true;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        const bool judged = k + after >= samples.size();
        const Measured m = judged ? follower.judged_frame(samples[k], {{}, iterations}, 1 / rate)
                                  : follower.frame(samples[k], {{}, iterations});
        finite = finite && !m.step.kept_old && std::isfinite(m.error);
        if (judged) errors.push_back(m.error / 0.01);
    }
    return {{"error", errors}, {"finite", finite}};
}

Result measure_phantom(const PhantomSize& size, const MeshHierarchy& hierarchy, double nu, TimeScheme scheme,
                       const RealtimeArguments& arguments, double bandwidth, ProgressLine& progress) {
    Result result;
    result.name = size.name;
    result.motion = scheme == TimeScheme::static_equilibrium ? "static" : "newmark";
    result.nu = nu;
    result.bandwidth = bandwidth;
    result.rate_asked = size.rate * (nu > 0.47 ? 0.5 : 1);
    result.mean_allowed = size.mean_allowed;
    result.worst_allowed = size.worst_allowed;
    const double rate = result.rate_asked, budget = budget_within(1 / rate);
    const Scene scene = phantom_scene(nu, scheme, rate, arguments.threads);
    const SimulatedTrackerOptions tracker = bench_tracker();
    constexpr int warm_up = 20;
    const auto samples = record_press(tracker, rate, warm_up + arguments.frames, press_depth);
    const std::size_t first = samples.size() - arguments.frames;
    const std::string title = fmt::format("{} nu {} {}", size.name, nu, result.motion);

    // 1. the times, frame after frame
    std::vector<int> iterations;
    {
        Follower follower(scene, hierarchy, tracker);
        result.tets = follower.mesh().tets.size();
        result.nodes = follower.mesh().nodes.size();
        result.threads = follower.body().threads();
        std::vector<Measured> frames;
        frames.reserve(samples.size());
        iterations.reserve(samples.size());
        for (std::size_t k = 0; k < samples.size(); ++k) {
            if (k % 100 == 0) progress.update(0.5 * static_cast<double>(k) / samples.size(), title + ": times");
            const auto allocations = allocations_of_this_thread();
            const long blocked = times_blocked();
            const Measured m = follower.frame(samples[k], {budget, 0});
            iterations.push_back(std::max(1, m.step.iterations));
            if (k < first) continue;
            result.allocations += allocations_of_this_thread() - allocations;
            result.blocked += times_blocked() - blocked;
            frames.push_back(m);
        }
        take_times(result, frames);
        result.bytes = bytes_of_frame(follower.body(), result.tets, result.nodes, result.cycles_mean,
                                      scheme != TimeScheme::static_equilibrium);
    }
    // 2. the errors: the same frames with the same iterations, some of them judged
    const auto every = static_cast<std::size_t>(std::max(1, arguments.frames / (size.tets > 100000 ? 25 : 50)));
    Follower follower(scene, hierarchy, tracker);
    std::vector<Measured> frames;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        const bool judged = k >= first && (k - first) % every == every / 2;
        if (judged) progress.update(0.5 + 0.5 * static_cast<double>(k) / samples.size(), title + ": errors");
        frames.push_back(judged ? follower.judged_frame(samples[k], {{}, iterations[k]}, 1 / rate)
                                : follower.frame(samples[k], {{}, iterations[k]}));
    }
    take_errors(result, frames);
    result.jump = measure_jump(scene, hierarchy, rate, std::max(1, static_cast<int>(std::lround(result.cycles_mean))));
    return result;
}

// ---- the beam ----

/// `edge_m` gives about as many tets as the sizes of 5.4 and 2.935 mm that another engine was measured at, whose surface
/// Gmsh meshed; ours is a grid of triangles.
struct BeamSize {
    std::string name;
    double edge_m, budget_s, allowed;
};

TriangleMesh surface_of(const TetMesh& mesh) {
    TriangleMesh surface{{}, boundary_triangles(mesh.tets)};
    const std::vector<std::int32_t> nodes = nodes_of(surface.triangles);
    for (const std::int32_t n : nodes) surface.nodes.push_back(mesh.nodes[n]);
    for (Triangle& t : surface.triangles)
        for (std::int32_t& n : t)
            n = static_cast<std::int32_t>(std::lower_bound(nodes.begin(), nodes.end(), n) - nodes.begin());
    return surface;
}

/// The box 0.2 x 0.1 x 0.1 m: each level a surface of triangles of its size, filled by Gmsh.
MeshHierarchy mesh_beam(double edge, const ProgressCallback& progress) {
    const Vector3 extent(0.2, 0.1, 0.1);
    std::vector<TetMesh> levels;
    for (double h = edge; h < 0.06; h *= 2) {
        if (progress) progress(0.2 * static_cast<double>(levels.size()), fmt::format("level {}", levels.size()));
        std::array<int, 3> cells;
        for (int a = 0; a < 3; ++a) cells[a] = std::max(1, static_cast<int>(std::lround(extent[a] / h)));
        levels.push_back(fill_surface(surface_of(verification::box(extent, cells)), h));
    }
    return make_hierarchy(std::move(levels), "beam");
}

Constraints beam_constraints(const TetMesh& mesh, double t) {
    Constraints constraints(mesh.nodes.size());
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        const Vector3& x = mesh.nodes[i];
        const std::int32_t n = static_cast<std::int32_t>(i);
        if (x.x() < 1e-9) constraints.prescribe(std::span(&n, 1), Vector3::Zero());
        if (x.z() > 0.1 - 1e-9 && std::abs(x.x() - 0.1) <= 0.0165 && std::abs(x.y() - 0.05) <= 0.0165)
            constraints.prescribe(std::span(&n, 1), {0, 0, -0.02 * std::sin(2 * std::numbers::pi * 0.75 * t)});
    }
    return constraints;
}

Result measure_beam(const BeamSize& size, const MeshHierarchy& hierarchy, int threads, double bandwidth,
                    ProgressLine& progress) {
    constexpr double dt = 1.0 / 30;
    constexpr int steps = 30;
    const Material material{.young_Pa = 5000, .poisson = 0.45, .density_kg_per_m3 = 1000};
    const ElasticModel model{std::span(&material, 1), StrainModel::corotated, Formulation::displacement};
    const TimeOptions time{.scheme = TimeScheme::implicit_euler, .rayleigh_alpha = 0.1, .rayleigh_beta = 0.1};
    const TetMesh& mesh = hierarchy.levels.front();
    Result result;
    result.name = size.name;
    result.is_beam = true;
    result.motion = "euler";
    result.nu = 0.45;
    result.bandwidth = bandwidth;
    result.tets = mesh.tets.size();
    result.nodes = mesh.nodes.size();
    result.rate_asked = 1 / size.budget_s;
    result.mean_allowed = result.worst_allowed = size.allowed;

    std::vector<Vector3> reached;
    {
        DeformableBody body(PETSC_COMM_SELF, hierarchy, {}, model, time, {.kind = SolverKind::live, .threads = threads});
        result.threads = body.threads();
        reached.resize(mesh.nodes.size());
        std::vector<Measured> frames;
        for (int turn = 0; turn < 12; ++turn) {  // the same thirty steps, often enough for a 99th percentile
            body.set_displacement(std::vector<Vector3>(mesh.nodes.size(), Vector3::Zero()));
            body.set_velocity(std::vector<Vector3>(mesh.nodes.size(), Vector3::Zero()));
            for (int k = 1; k <= steps; ++k) {
                const Constraints constraints = beam_constraints(mesh, k * dt);
                const auto allocations = allocations_of_this_thread();
                const long blocked = times_blocked();
                Measured m;
                const auto start = Clock::now();
                body.set_constraints(constraints);
                m.step = body.step(dt, {.linear_tolerance = 1e-4,
                                        .deadline = start + std::chrono::duration_cast<Clock::duration>(
                                                                std::chrono::duration<double>(budget_within(size.budget_s)))});
                body.displacement(reached);
                m.seconds = std::chrono::duration<double>(Clock::now() - start).count();
                if (turn == 0) continue;
                result.allocations += allocations_of_this_thread() - allocations;
                result.blocked += times_blocked() - blocked;
                frames.push_back(m);
            }
            progress.update(0.3 * turn / 12, size.name + ": times");
        }
        take_times(result, frames);
        for (const Measured& m : frames) result.estimate_mean += m.step.solve_error / static_cast<double>(frames.size()) / 0.02;
        result.bytes = bytes_of_frame(body, result.tets, result.nodes, result.cycles_mean, true);
    }
    DeformableBody converged(PETSC_COMM_SELF, hierarchy, {}, model, time, {.kind = SolverKind::multigrid});
    for (int k = 1; k <= steps; ++k) {
        progress.update(0.3 + 0.7 * k / steps, size.name + ": converged run");
        converged.set_constraints(beam_constraints(mesh, k * dt));
        (void)converged.step(dt, {.linearisations = 30, .tolerance = 1e-8, .linear_tolerance = 1e-3});
    }
    const std::vector<Vector3> truth = converged.displacement();
    double gap = 0, size_of = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        gap += (truth[i] - reached[i]).squaredNorm();
        size_of += truth[i].squaredNorm();
    }
    result.error_mean = result.error_worst = std::sqrt(gap / size_of);
    const Gap worst = gap_between(reached, truth);
    result.node_error_mean = result.node_error_worst = worst.node / worst.largest;
    return result;
}

// ---- what is shown ----

json json_of(const Result& r) {
    return {{"case", r.name},
            {"motion", r.motion},
            {"tets", r.tets},
            {"nodes", r.nodes},
            {"nu", r.nu},
            {"frames", r.frames},
            {"ms_median", 1e3 * r.seconds.median},
            {"ms_p99", 1e3 * r.seconds.p99},
            {"fps_median", 1 / r.seconds.median},
            {"fps_p99", r.rate()},
            {"fps_asked", r.rate_asked},
            {"error_mean", r.error_mean},
            {"error_worst", r.error_worst},
            {"error_mean_allowed", r.mean_allowed},
            {"error_worst_allowed", r.worst_allowed},
            {"error_estimate_mean", r.estimate_mean},
            {"node_error_mean", r.node_error_mean},
            {"node_error_worst", r.node_error_worst},
            {"ms_by_stage", r.stages},
            {"cycles_mean", r.cycles_mean},
            {"frames_cut_short", r.cut_short},
            {"references_not_converged", r.references_not_converged},
            {"bytes_moved_per_frame", r.bytes},
            {"bandwidth_bytes_per_s", r.bandwidth},
            {"fraction_of_bandwidth", r.bytes / r.seconds.median / r.bandwidth},
            {"threads", r.threads},
            {"allocations", r.allocations},
            {"blocked", r.blocked},
            {"jump", r.jump},
            {"held", r.held()}};
}

void print_header() {
    fmt::print("{:<6} {:<8} {:>5} {:>8} {:>7} | {:>7} {:>7} {:>6} {:>6} | {:>15} {:>9} {:>15} | {:>6} {:>6} {:>6}  {}\n", "case", "motion", "nu",
               "tets", "nodes", "median", "p99", "fps", "asked", "error mean/worst", "estimate", "worst node", "cycles",
               "bytes", "alloc", "held");
    fmt::print("{:<6} {:<8} {:>5} {:>8} {:>7} | {:>7} {:>7} {:>6} {:>6} | {:>16} {:>9} {:>15} | {:>6} {:>6} {:>6}\n", "", "", "", "", "", "ms", "ms",
               "at p99", "", "% RMS of nodes", "%", "% mean/worst", "", "of bw", "+block");
}

void print_row(const Result& r) {
    fmt::print("{:<6} {:<8} {:>5} {:>8} {:>7} | {:>7.2f} {:>7.2f} {:>6.0f} {:>6.0f} | {:>7.3f} / {:>6.3f} {:>9.3f} {:>6.2f} / {:>6.2f} | {:>6.2f} {:>5.0f}% {:>6}  {}\n",
               r.name, r.motion, r.nu, r.tets, r.nodes, 1e3 * r.seconds.median, 1e3 * r.seconds.p99, r.rate(), r.rate_asked,
               100 * r.error_mean, 100 * r.error_worst, 100 * r.estimate_mean, 100 * r.node_error_mean, 100 * r.node_error_worst,
               r.cycles_mean, 100 * r.bytes / r.seconds.median / r.bandwidth, fmt::format("{}+{}", r.allocations, r.blocked),
               r.held() ? "yes" : "NO");
    std::string stages;
    for (const auto& [name, ms] : r.stages.items()) stages += fmt::format("  {} {:.2f}", name, ms.get<double>());
    fmt::print("       ms by stage:{}\n", stages);
    if (r.references_not_converged > 0)
        fmt::print("       {} of the frames' references did not converge: errors against what they reached\n",
                   r.references_not_converged);
    if (!r.jump.is_null()) {
        std::string errors;
        for (const auto& e : r.jump["error"]) errors += fmt::format(" {:.2f}", 100 * e.get<double>());
        fmt::print("       10 mm jump, % RMS in the ten frames after:{}{}\n", errors, r.jump["finite"].get<bool>() ? "" : "  NOT FINITE");
    }
    std::fflush(stdout);
}

// ---- error against time, method by method ----

struct Method {
    std::string name;
    SolverOptions solver;
    std::vector<int> iterations;  ///< a point for each
};

WorkPrecisionChart measure_methods(const PhantomSize& size, const MeshHierarchy& hierarchy, int threads,
                                   ProgressLine& progress) {
    const double rate = size.rate;
    const int frames = size.tets > 100000 ? 12 : 40, every = size.tets > 100000 ? 4 : 8;
    WorkPrecisionChart chart{fmt::format("{}: {} tets, static, nu = 0.45, {:.0f} Hz", size.name,
                                         hierarchy.levels.front().tets.size(), rate),
                             "mean error of a frame, % of the largest displacement", {}};
    const std::vector<Method> methods = {
        {"live", {.kind = SolverKind::live, .threads = threads}, {1, 2, 3, 5, 8}},
        {"live, one thread", {.kind = SolverKind::live, .threads = 1}, {1, 2, 3, 5, 8}},
        {"PCMG rediscretised", {.kind = SolverKind::multigrid}, {1, 2, 3, 5, 8}},
        {"PCMG Galerkin", {.kind = SolverKind::multigrid, .coarse = CoarseOperator::galerkin}, {1, 2, 3, 5}},
        {"GAMG", {.kind = SolverKind::gamg}, {2, 4, 8}},
        {"BoomerAMG", {.kind = SolverKind::boomeramg}, {2, 4, 8}}};
    const SimulatedTrackerOptions tracker = bench_tracker();
    for (const Method& method : methods) {
        WorkPrecisionLine line{method.name, {}, {}};
        for (const int iterations : method.iterations) {
            progress.update(0, fmt::format("figure: {} {}, {} iterations", size.name, method.name, iterations));
            Scene scene = phantom_scene(0.45, TimeScheme::static_equilibrium, rate, threads);
            const int scene_threads = method.solver.threads;
            scene.solver = method.solver;
            scene.solver.threads = scene_threads;
            scene.solver.relative_tolerance = 1e-9;
            scene.solver.tangent = TangentChoice::held_rotation;
            scene.track->base_window_s = 0.1;
            const auto samples = record_press(tracker, rate, frames, [](double t) { return press_depth(t + 0.2); });
            Follower follower(scene, hierarchy, tracker);
            std::vector<double> seconds;
            double error = 0, largest = 0, judged = 0;
            for (std::size_t k = samples.size() - frames; k < samples.size(); ++k) {
                const bool judge = (k + 1 - (samples.size() - frames)) % every == 0;
                const Measured m = judge ? follower.judged_frame(samples[k], {{}, iterations}, 1 / rate)
                                         : follower.frame(samples[k], {{}, iterations});
                if (k > samples.size() - frames + 2) seconds.push_back(m.seconds);
                if (!judge) continue;
                error += m.error;
                largest = std::max(largest, m.largest);
                ++judged;
            }
            line.seconds.push_back(distribution(std::move(seconds)).median);
            line.error.push_back(100 * error / judged / largest);
        }
        chart.lines.push_back(std::move(line));
    }
    return chart;
}

}  // namespace

int bench_realtime(const RealtimeArguments& arguments) {
    PetscSession session("livetet", {});
    if (session.ranks() > 1) fail("bench realtime runs on one rank, found {}: start it without mpirun", session.ranks());
    const PhantomSize phantoms[] = {{"P60", 60000, 150, 0.005, 0.02}, {"V68", 360000, 30, 0.01, 0.03}};
    const BeamSize beams[] = {{"beamA", 0.0050, 0.006, 0.006}, {"beamB", 0.00272, 0.06, 0.01}};
    const auto asked = [&](const std::string& name) {
        return std::find(arguments.sizes.begin(), arguments.sizes.end(), name) != arguments.sizes.end();
    };
    for (const std::string& name : arguments.sizes)
        if (name != "P60" && name != "V68" && name != "beamA" && name != "beamB")
            fail("--size {}: no such case, there are P60, V68, beamA, beamB", name);
    const int threads = arguments.threads > 0 ? arguments.threads : std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, 4);
    const double bandwidth = measure_bandwidth(threads);
    fmt::print("memory bandwidth, {} thread{}: {:.1f} GB/s\n\n", threads, threads == 1 ? "" : "s", bandwidth / 1e9);
    print_header();
    std::vector<Result> results;
    std::vector<WorkPrecisionChart> charts;
    ProgressLine progress("realtime");
    const auto keep = [&](Result result) {
        print_row(result);
        results.push_back(std::move(result));
    };
    for (const PhantomSize& size : phantoms) {
        if (!asked(size.name)) continue;
        const MeshHierarchy hierarchy = mesh_phantom(make_phantom_images(0.0015, 1), size, progress.callback());
        if (arguments.frames > 0)
            for (const double nu : {0.45, 0.49})
                for (const TimeScheme scheme : {TimeScheme::static_equilibrium, TimeScheme::newmark})
                    keep(measure_phantom(size, hierarchy, nu, scheme, arguments, bandwidth, progress));
        if (!arguments.figure.empty()) charts.push_back(measure_methods(size, hierarchy, threads, progress));
    }
    for (const BeamSize& size : beams)
        if (asked(size.name)) keep(measure_beam(size, mesh_beam(size.edge_m, progress.callback()), threads, bandwidth, progress));
    bool all = true;
    json list = json::array();
    for (const Result& r : results) {
        list.push_back(json_of(r));
        all = all && r.held();
    }
    if (!arguments.json.empty()) write_text_file(arguments.json, list.dump(2) + "\n");
    if (!charts.empty()) write_work_precision_picture(arguments.figure, charts);
    return all ? 0 : 1;
}

}  // namespace livetet
