// A soft block follows a tracked sensor, frame by frame.
//
// A simulated tracker sees a reference sensor on the moving block and a second one that presses its
// top: a patch of nodes goes with it, and one corotated solve a frame carries that through the
// block. The deepest frame is compared with the equilibrium under its constraints.
// Sample run:  tracked_block
#include <fmt/format.h>

#include "livetet/mesh/node_selection.hpp"
#include "livetet/mesh/shapes.hpp"
#include "livetet/mesh/surface_patch.hpp"
#include "livetet/solvers/nonlinear/deformable_body.hpp"
#include "livetet/solvers/parallel/petsc_session.hpp"
#include "livetet/tracking/live_registration.hpp"
#include "livetet/tracking/poses.hpp"
#include "livetet/tracking/sensor_drive.hpp"
#include "livetet/tracking/simulated_tracker.hpp"
using namespace livetet;

int main(int argc, char** argv) try {
    const PetscSession session(argv[0], {argv + 1, argv + argc});
    // 1. A block of 80 x 80 x 60 mm in two meshes, held at its bottom; a patch on its top.
    const Vector3 size(0.08, 0.08, 0.06), top(0.04, 0.04, 0.06);  // m
    const MeshHierarchy hierarchy =
        make_hierarchy({shapes::box(size, {12, 12, 9}), shapes::box(size, {4, 4, 3})}, "block");
    const TetMesh& mesh = hierarchy.levels.front();
    const Material soft{.young_Pa = 3000, .poisson = 0.45};
    const ElasticModel model{{&soft, 1}, "corotated"};
    const auto patch = surface_patch(mesh, top, 0.01).nodes;
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(nodes_in_half_space(mesh, {0, 0, 0}, {0, 0, 1}), Vector3::Zero());
    constraints.prescribe(patch, Vector3::Zero());
    DeformableBody body({PETSC_COMM_SELF, hierarchy}, model, {}, {.kind = SolverKind::live});
    body.set_constraints(constraints);
    // The first frame that moves sets up what the others use: make it before samples come.
    body.move_constraints(patch, std::vector<Vector3>(patch.size(), Vector3(0, 0, -1e-6)));
    (void)body.advance(0, {});

    // 2. A recording of the tools "Reference" and "Sensor", 20 samples a second.
    SimulatedTrackerOptions tracker{.position_rms_mm = 0.1, .rotation_rms_deg = 0};
    tracker.image_from_sensor_at_rest.translation = top;
    const Recording recording = simulate_press(tracker);

    // 3. Frame by frame: registration, sensor, constraints, one solve that aims at 20 ms.
    LiveRegistration registration(tracker.image_from_reference);
    SensorDrive drive;
    double time_s = 0, press = 0;  // deepest so far, m
    std::vector<Vector3> values(patch.size()), deepest_values, displacement;
    for (const TrackerSample& sample : recording.samples) {
        registration.update(sample.time_s, sample.poses[0]);
        drive.update(sample.time_s,
                     *registration.image_from_tracker() * tracker_from<Sensor>(sample.poses[1]));
        for (std::size_t k = 0; k < patch.size(); ++k)
            values[k] = drive.displacement(mesh.nodes[patch[k]]);
        body.move_constraints(patch, values);
        const auto deadline = Clock::now() + std::chrono::milliseconds(20);
        if (body.advance(sample.time_s - time_s, {.deadline = deadline}).kept_old) return 1;
        time_s = sample.time_s;
        if (-values[0].z() <= press) continue;
        press = -values[0].z();
        deepest_values = values;
        body.displacement(displacement);
    }

    // 4. The equilibrium under the deepest press, and how far that frame was from it.
    DeformableBody reference({PETSC_COMM_SELF, hierarchy}, model, {}, {});
    reference.set_constraints(constraints);
    reference.move_constraints(patch, deepest_values);
    if (!reference.solve(0, {.tolerance = 1e-8}).converged) return 1;
    const auto exact = reference.displacement();
    double error = 0;  // m, at the worst node
    for (std::size_t n = 0; n < exact.size(); ++n)
        error = std::max(error, (displacement[n] - exact[n]).norm());
    fmt::print("{} frames, pressed by {:.2f} of {:.2f} mm; that frame is off by {:.3f} mm\n",
               recording.samples.size(), 1e3 * press, 1e3 * tracker.press_depth, 1e3 * error);
    return std::abs(press - tracker.press_depth) < 5e-4 && error < 2e-4 ? 0 : 1;
} catch (const std::exception& error) {
    fmt::print(stderr, "tracked_block: {}\n", error.what());
    return 2;
}
