#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/phantom/phantom_images.hpp"
#include "apps/phantom/truth_file.hpp"
#include "base/progress.hpp"
#include "tracking/fiducials.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {

/// What a phantom is made from: the same options give the same files, but for the truth's
/// displacements, which differ by the error of their mesh: Gmsh does not make the same mesh twice.
struct PhantomOptions {
    std::uint64_t seed = 1;
    double spacing_mm = 1.5;
    double position_noise_mm = 1.4;   ///< RMS length of a tracked position's error
    double rotation_noise_deg = 0.5;  ///< RMS angle of a tracked rotation's error
    double rate_Hz = 15;
    int truth_tets = 150000;
};

/// Throws Error, naming the option, for one that cannot be used.
void check_options(const PhantomOptions& options);

/// What was recorded of the phantom, with the tracker's noise.
struct PhantomRecordings {
    Recording pivot, fiducials, press;
};

/// The phantom before the tracker: tool, organ's way and speed, where the sensors sit, how it is
/// pressed.
SimulatedTrackerOptions phantom_tracker(const PhantomOptions& options);
PhantomRecordings record_phantom(const PhantomOptions& options,
                                 const std::vector<NamedPoint>& fiducials);

/// The truth behind the recordings: all but the targets' displacements, which `solve_truth` adds.
Truth true_motion(const SimulatedTrackerOptions& tracker, const Recording& press);

/// The scenes that go with the phantom, as text: `scene.yaml` for track, `solve.yaml` for solve.
std::string phantom_track_scene(const Truth& truth);
std::string phantom_solve_scene(const Truth& truth);

/// Makes the phantom in `folder`: images, fiducials, recordings, scenes and, in a folder of its
/// own, the truth. All is made before the first file takes its place. Returns the files' names,
/// relative to the folder. Needs a PetscSession. Throws Error for options that cannot be used and a
/// folder that cannot be written to.
std::vector<std::filesystem::path> write_phantom(const std::filesystem::path& folder,
                                                 const PhantomOptions& options,
                                                 const ProgressCallback& progress = {});

}  // namespace livetet
