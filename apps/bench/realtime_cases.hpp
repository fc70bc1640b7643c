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
    std::vector<std::string> sizes{"P60", "V68", "beamA", "beamB"};
    int frames = 1000;  ///< timed, of each phantom case
    int threads = 0;    ///< as solver.threads
    std::filesystem::path json, figure;
};

/// What is given to a frame that must end in time: two milliseconds less, which a machine now and
/// then takes for itself, or a tenth where that is more.
inline double budget_within(double seconds) {
    return std::max(0.5 * seconds, std::min(seconds - 0.002, 0.9 * seconds));
}

struct PhantomSize {
    std::string name;
    std::int64_t tets;
    double rate;  ///< frames a second asked for at nu = 0.45
    double mean_allowed, worst_allowed;
};

/// The phantom on a mesh of `mesh_phantom`, followed by a sensor: held as the demo's scene holds
/// it, damped as it is where the scheme has velocities.
Scene phantom_scene(TimeScheme scheme);

/// Levels from the phantom's label map; "fixed" is set.
MeshHierarchy mesh_phantom(const PhantomImages& images, const PhantomSize& size,
                           const ProgressCallback& progress);

/// Presses by 15 mm at 1 Hz with the tracker's noise: times of all frames, errors of some, the ten
/// after a jump.
RealtimeResult measure_phantom(const PhantomSize& size, const MeshHierarchy& hierarchy, double nu,
                               TimeScheme scheme, const RealtimeArguments& arguments,
                               double bandwidth, ProgressLine& progress);

/// Error of a static frame against its time, a line for each method, plain PETSc's among them, a
/// point for each number of iterations.
WorkPrecisionChart measure_methods(const PhantomSize& size, const MeshHierarchy& hierarchy,
                                   int threads, ProgressLine& progress);

/// `edge_m` gives about as many tets as the sizes of 5.4 and 2.935 mm that another engine was
/// measured at, whose surface Gmsh meshed; ours is a grid of triangles.
struct BeamSize {
    std::string name;
    double edge_m, budget_s, allowed;
    int iterations;  ///< of every step, as the other engine is told
};

/// Thirty Euler steps of 1/30 s, the beam's top driven by a sine of 20 mm; the error is that of the
/// last one.
RealtimeResult measure_beam(const BeamSize& size, const MeshHierarchy& hierarchy, int threads,
                            double bandwidth, ProgressLine& progress);

}  // namespace livetet
