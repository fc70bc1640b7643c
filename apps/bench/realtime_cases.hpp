#pragma once

#include "apps/bench/realtime_result.hpp"
#include "apps/phantom/phantom_images.hpp"
#include "apps/plots/pictures.hpp"
#include "apps/scene/scene.hpp"
#include "base/progress.hpp"
#include "mesh/hierarchy.hpp"

namespace livetet {

/// `livetet bench realtime`.
struct RealtimeArguments {
    std::vector<std::string> sizes{"P60", "V68", "beamA", "beamB", "front", "cut"};
    int frames = 10000;           ///< timed frames of each case and row
    int threads = 0;              ///< see solver.threads
    double poisson = 0.45;        ///< of the case front
    int truth_tets = 14000;       ///< ten-node tets of the true organ of the case front
    std::filesystem::path organ;  ///< of the case front; see read_front_organ
    int label = 0;
    std::filesystem::path json, figure;
};

/// Budget of a frame that must end in time: less two milliseconds, which a machine may take for
/// itself, or less a tenth if that is more.
inline double budget_within(double seconds) {
    return std::max(0.5 * seconds, std::min(seconds - 0.002, 0.9 * seconds));
}

struct PhantomSize {
    std::string name;
    std::int64_t tets;
    double rate;  ///< required frame rate at nu = 0.45
    double mean_allowed, worst_allowed;
};

/// The scene of the phantom on a mesh of `mesh_phantom`, with a sensor: fixed like the demo's
/// scene, and damped like it if the scheme has velocities.
Scene phantom_scene(TimeScheme scheme);

/// Meshes the phantom's label map; makes the set "fixed". `grading`: patches of its surface with
/// shorter edges.
MeshHierarchy mesh_phantom(const PhantomImages& images, const PhantomSize& size,
                           const ProgressCallback& progress, PatchGrading grading = {});

/// Presses by 15 mm at 1 Hz, with tracker noise. Measures the times of all frames, the errors of
/// some of the first thousand, and ten frames after a jump.
RealtimeResult measure_phantom(const PhantomSize& size, const MeshHierarchy& hierarchy, double nu,
                               TimeScheme scheme, const RealtimeArguments& arguments,
                               double bandwidth, ProgressLine& progress);

/// Error of a static frame against its time: a line for each method, plain PETSc included, a point
/// for each number of iterations.
WorkPrecisionChart measure_methods(const PhantomSize& size, const MeshHierarchy& hierarchy,
                                   int threads, ProgressLine& progress);

/// A size of the beam. `edge_m` gives about as many tets as the sizes of 5.4 and 2.935 mm for which
/// another engine was measured; its surface was meshed by Gmsh, ours is a grid of triangles.
struct BeamSize {
    std::string name;
    double edge_m, budget_s, allowed;
    int iterations;  ///< iterations of each step, as in the other engine
};

/// Thirty Euler steps of 1/30 s, again and again until there are enough frames, with the top of
/// the beam driven by a sine of 20 mm. The error is that of the last step.
RealtimeResult measure_beam(const BeamSize& size, const MeshHierarchy& hierarchy,
                            const RealtimeArguments& arguments, double bandwidth,
                            ProgressLine& progress);

}  // namespace livetet
