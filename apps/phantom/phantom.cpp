#include "apps/phantom/phantom.hpp"

#include <unistd.h>

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <optional>
#include <system_error>

#include "apps/phantom/phantom_shape.hpp"
#include "apps/phantom/phantom_sweep.hpp"
#include "apps/phantom/phantom_truth.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "base/temporary_files.hpp"
#include "io/fiducial_file.hpp"
#include "io/image_file.hpp"
#include "io/points_csv.hpp"
#include "io/sequence_file.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

namespace fs = std::filesystem;
using Eigen::AngleAxisd;
using Eigen::Vector3d;

namespace {

template <class To, class From>
RigidTransform<To, From> turned(double degrees, const Vector3d& axis, const Vector3d& translation) {
    return {AngleAxisd(degrees * M_PI / 180, axis.normalized()).toRotationMatrix(), translation};
}

/// A folder being written, in place or, if it does not exist yet, beside its place: files are moved
/// into place one by one when all are complete. Without `commit` nothing is left, not even after a
/// signal.
class PendingFolder {
  public:
    explicit PendingFolder(fs::path target) : target_(std::move(target)) {
        if (!target_.has_filename()) target_ = target_.parent_path();
        std::error_code error;
        if (fs::exists(target_, error) && !fs::is_directory(target_, error))
            fail("{}: is a file, expected a folder", target_.string());
        const fs::path place =
            fs::exists(target_, error) ? target_ : fs::absolute(target_).parent_path();
        fs::create_directories(place, error);
        if (error) fail("{}: cannot be made: {}", place.string(), error.message());
        temporary_ = place / fmt::format(".phantom.part{}", ::getpid());
        if (!fs::create_directory(temporary_, error) && error)
            fail("{}: cannot be written to: {}", place.string(), error.message());
        signal_guard_.emplace(temporary_);
    }
    ~PendingFolder() {
        std::error_code ignored;
        fs::remove_all(temporary_, ignored);
    }
    PendingFolder(const PendingFolder&) = delete;
    PendingFolder& operator=(const PendingFolder&) = delete;

    /// Path at which to write the file `name`.
    fs::path add(const fs::path& name) {
        const fs::path path = temporary_ / name;
        fs::create_directories(path.parent_path());
        names_.push_back(name);
        return path;
    }
    std::vector<fs::path> commit() {
        for (const fs::path& name : names_) {
            std::error_code error;
            fs::create_directories((target_ / name).parent_path(), error);
            fs::rename(temporary_ / name, target_ / name, error);
            if (error)
                fail("{}: cannot be written: {}", (target_ / name).string(), error.message());
        }
        return names_;
    }

  private:
    fs::path target_, temporary_;
    std::optional<TemporaryPath> signal_guard_;
    std::vector<fs::path> names_;
};

/// A part of the total progress.
ProgressCallback part_of(const ProgressCallback& progress, double from, double to,
                         const std::string& what) {
    if (!progress) return {};
    return [=](double fraction, std::string_view words) {
        progress(from + (to - from) * fraction, fmt::format("{}: {}", what, words));
    };
}

}  // namespace

void check_options(const PhantomOptions& o) {
    const auto within = [](const char* name, double value, double low, double high) {
        if (!(value >= low && value <= high))
            fail("phantom: {} = {} must be from {} to {}", name, value, low, high);
    };
    within("spacing-mm", o.spacing_mm, 0.5, 4);
    within("position-noise-mm", o.position_noise_mm, 0, 50);
    within("rotation-noise-deg", o.rotation_noise_deg, 0, 30);
    within("rate-Hz", o.rate_Hz, 5, 200);
    within("truth-tets", o.truth_tets, 2000, 5'000'000);
}

SimulatedTrackerOptions phantom_tracker(const PhantomOptions& options) {
    SimulatedTrackerOptions t;
    t.rate_Hz = options.rate_Hz;
    t.position_rms_mm = options.position_noise_mm;
    t.rotation_rms_deg = options.rotation_noise_deg;
    t.seed = options.seed;
    t.tool_from_tip.translation = {0.0042, -0.0017, 0.1513};
    t.pivot_in_tracker = {0.210, -0.080, -0.130};
    t.tracker_from_image_at_start =
        turned<Tracker, ImageFrame>(118, {0.35, -0.2, 1}, {0.260, -0.040, -0.150});
    t.turn_centre_in_image = phantom::organ_centre();
    t.organ_travel = 0.028;
    t.organ_turn_deg = 24;
    t.image_from_reference =
        turned<ImageFrame, Reference>(155, {1, 0.3, -0.4}, phantom::reference_place());
    t.image_from_sensor_at_rest =
        turned<ImageFrame, Sensor>(40, {0.2, -1, 0.6}, phantom::sensor_place());
    t.press_direction = -phantom::organ_normal(phantom::sensor_place());
    t.press_depth = 0.015;
    t.presses = 3;
    t.ramp_s = 1.2;
    return t;
}

namespace {

/// A vertical blade cuts from y to -y beside the sensor while the organ is at rest; then the sensor
/// is pressed twice.
Recording record_resection(const PhantomOptions& options) {
    SimulatedTrackerOptions tracker = phantom_tracker(options);
    tracker.seed = 1'000'000 + options.seed;
    tracker.rest_s = 8;
    tracker.presses = 2;
    // The edge ends 44 mm below the sensor's place; the disc that is pressed ends 12 mm before it.
    const Vector3d middle = phantom::sensor_place() + Vector3d(0.027, -0.004, scalpel_edge - 0.044),
                   way(0, 0.07, 0);
    return simulate_resection(tracker,
                              {.from = middle + way, .to = middle - way, .begin_s = 2, .end_s = 6});
}

}  // namespace

PhantomRecordings record_phantom(const PhantomOptions& options,
                                 const std::vector<NamedPoint>& fiducials) {
    const std::vector<Vector3d> places = positions_of(fiducials);
    // Each recording has random errors of its own.
    SimulatedTrackerOptions tracker = phantom_tracker(options);
    tracker.seed = 4 * options.seed;
    PhantomRecordings recordings;
    ++tracker.seed;
    recordings.pivot = simulate_pivoting(tracker);
    ++tracker.seed;
    recordings.fiducials = simulate_touching(tracker, places);
    ++tracker.seed;
    recordings.press = simulate_press(tracker);
    recordings.resection = record_resection(options);
    return recordings;
}

Recording record_sweep(const PhantomOptions& options, const TetMesh& mesh,
                       std::span<const Vector3d> pressed) {
    constexpr double speed = 0.06;  // m/s
    TriangleMesh surface{mesh.nodes, boundary_triangles(mesh.tets)};
    for (std::size_t n = 0; n < pressed.size(); ++n) surface.nodes[n] += pressed[n];
    SimulatedTrackerOptions tracker = phantom_tracker(options);
    tracker.seed = 4 * options.seed + 4;
    SweepPath path;
    path.step_m = speed / options.rate_Hz;
    return simulate_sweep(tracker, sweep_path(surface, path));
}

Truth true_motion(const SimulatedTrackerOptions& tracker, const Recording& press) {
    Truth truth;
    truth.tip_in_tool = tracker.tool_from_tip.translation;
    truth.pivot_in_tracker = tracker.pivot_in_tracker;
    truth.sensor_rest = tracker.image_from_sensor_at_rest.translation;
    truth.reference_rest = tracker.image_from_reference.translation;
    truth.position_noise = tracker.position_rms_mm / 1e3;
    truth.rotation_noise = tracker.rotation_rms_deg * std::numbers::pi / 180;
    truth.press_direction = tracker.press_direction.normalized();
    constexpr int steps = 5;
    for (int k = 1; k <= steps; ++k) truth.depths.push_back(tracker.press_depth * k / steps);
    for (const TrackerSample& s : press.samples)
        truth.samples.push_back({s.time_s, true_press_depth(tracker, s.time_s),
                                 true_tracker_from_image(tracker, s.time_s)});
    return truth;
}

namespace {

/// Some of the hidden targets, as a surgeon would mark them in the image before the operation.
std::vector<NamedPoint> marked_targets() {
    constexpr std::size_t step = 4;
    const std::vector<NamedPoint> all = phantom::targets();
    std::vector<NamedPoint> some;
    for (std::size_t i = 0; i < all.size(); i += step) some.push_back(all[i]);
    return some;
}

}  // namespace

std::vector<fs::path> write_phantom(const fs::path& folder, const PhantomOptions& options,
                                    const ProgressCallback& progress) {
    check_options(options);
    PendingFolder pending(folder);
    if (progress) progress(0, "images");
    const PhantomImages images = make_phantom_images(options.spacing_mm / 1e3, options.seed);
    write_image(pending.add("image.nii.gz"), images.image);
    write_image(pending.add("labels.nii.gz"), images.labels);
    write_image(pending.add("fixed_mask.nii.gz"), images.fixed_mask);

    if (progress) progress(0.05, "recordings");
    const std::vector<NamedPoint> fiducials = phantom::fiducials();
    const PhantomRecordings recordings = record_phantom(options, fiducials);
    write_fiducials(pending.add("image_fiducials.mrk.json"), fiducials);
    write_sequence(pending.add("pivot.igs.mha"), recordings.pivot);
    write_sequence(pending.add("fiducials.igs.mha"), recordings.fiducials);
    write_sequence(pending.add("press.igs.mha"), recordings.press);
    write_sequence(pending.add("resection.igs.mha"), recordings.resection);

    Truth truth = true_motion(phantom_tracker(options), recordings.press);
    // Edges at the disc: 3 mm for the default number of tets, longer for fewer, so that the mesh
    // has about as many as were asked for.
    constexpr double usual = PhantomOptions{}.truth_tets;
    const double edge_at_patch = 0.003 * std::max(1., std::cbrt(usual / options.truth_tets));
    const FineSphere finer{truth.sensor_rest, 1.5 * truth.patch_radius, edge_at_patch};
    const MeshHierarchy meshed = with_quadratic_level(
        mesh_for_truth(images.labels, images.fixed_mask, options.truth_tets,
                       part_of(progress, 0.06, 0.2, "mesh of the truth"), finer));
    const std::vector<Vector3d> pressed = solve_truth(
        meshed, phantom::targets(), truth, part_of(progress, 0.2, 0.99, "truth"), {"neohookean"});
    write_truth(pending.add("truth/truth.json"), truth);
    write_sequence(pending.add("sweep.igs.mha"),
                   record_sweep(options, meshed.levels.front(), pressed));
    write_points_csv(pending.add("targets.csv"), marked_targets());
    write_text_file(pending.add("scene.yaml"), phantom_track_scene(truth));
    write_text_file(pending.add("resection.yaml"), phantom_resection_scene(truth));
    write_text_file(pending.add("sweep.yaml"), phantom_sweep_scene(truth));
    write_text_file(pending.add("solve.yaml"), phantom_solve_scene(truth));
    const auto names = pending.commit();
    if (progress) progress(1, "done");
    return names;
}

}  // namespace livetet
