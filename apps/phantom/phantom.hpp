#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "apps/phantom/phantom_images.hpp"
#include "apps/phantom/truth_file.hpp"
#include "base/progress.hpp"
#include "mesh/tet_mesh.hpp"
#include "tracking/fiducials.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {

/// Options of a phantom. The same options give the same files, except for the truth's
/// displacements and the sweep over the displaced surface, which differ by the error of their mesh:
/// Gmsh does not repeat meshes exactly.
struct PhantomOptions {
    std::uint64_t seed = 1;
    double spacing_mm = 1.5;
    double position_noise_mm = 1.4;   ///< RMS error of a tracked position
    double rotation_noise_deg = 0.5;  ///< RMS error of a tracked rotation
    double rate_Hz = 15;
    int truth_tets = 16000;
};

/// Throws Error, naming the option, if one is invalid.
void check_options(const PhantomOptions& options);

/// Length of the phantom's scalpel, whose edge runs from its sensor against z, m.
inline constexpr double scalpel_edge = 0.06;

/// Recordings of the phantom, with the tracker's noise.
struct PhantomRecordings {
    Recording pivot, fiducials, press, resection;
};

/// The phantom as the tracker sees it: tool, motion of the organ, sensor positions, press.
SimulatedTrackerOptions phantom_tracker(const PhantomOptions& options);
PhantomRecordings record_phantom(const PhantomOptions& options,
                                 const std::vector<NamedPoint>& fiducials);

/// The stylus swept over the upper side of the organ while a thin plate presses it to the last
/// depth. `pressed`: displacement of the mesh's nodes there, m.
Recording record_sweep(const PhantomOptions& options, const TetMesh& mesh,
                       std::span<const Eigen::Vector3d> pressed);

/// The truth behind the recordings, without the targets' displacements, which `solve_truth` adds.
Truth true_motion(const SimulatedTrackerOptions& tracker, const Recording& press);

/// Scene files of the phantom: `scene.yaml` for track, `resection.yaml` for track on a grid that is
/// cut, `sweep.yaml` for register --deform, `solve.yaml` for solve.
std::string phantom_track_scene(const Truth& truth);
std::string phantom_sweep_scene(const Truth& truth);
std::string phantom_resection_scene(const Truth& truth);
std::string phantom_solve_scene(const Truth& truth);

/// Writes a phantom to `folder`: images, fiducials, recordings, scenes and, in a folder of its own,
/// the truth. No file takes its place before all are complete. Returns the files' names, relative
/// to the folder. Needs a PetscSession. Throws Error for invalid options or if the folder cannot be
/// written.
std::vector<std::filesystem::path> write_phantom(const std::filesystem::path& folder,
                                                 const PhantomOptions& options,
                                                 const ProgressCallback& progress = {});

}  // namespace livetet
