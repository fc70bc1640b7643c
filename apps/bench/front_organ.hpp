#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/phantom/phantom_images.hpp"
#include "apps/phantom/truth_file.hpp"
#include "base/progress.hpp"
#include "tracking/fiducials.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {

/// An organ that `bench realtime --size front` presses.
struct FrontOrgan {
    std::string name;
    PhantomImages images;  ///< its label map, 1 in the organ, and what is fixed; no grey values
    std::optional<PhantomImages> finer;  ///< the phantom in voxels for 60,000 hexahedra
    /// The motions of organ and press, and the sensor's place, without noise.
    SimulatedTrackerOptions tracker;
    std::vector<NamedPoint> targets;
};

/// The phantom.
FrontOrgan phantom_front_organ();

/// The organ of a label map (`label`, or all labels if that is 0) or of a closed surface in mm,
/// RAS: pressed at its front, held by the fifth of its depth that lies farthest back, with 30
/// targets inside within 45 mm of the sensor. Throws Error as read_label_image and read_surface do,
/// or if there are not so many places for targets.
FrontOrgan read_front_organ(const std::filesystem::path& file, int label,
                            const ProgressCallback& progress);

/// The truth of the press: neo-Hookean, a flat disc, about `tets` ten-node tets with edges of 2 mm
/// at the disc. Throws Error as solve_truth does.
Truth press_front_organ(const FrontOrgan& organ, int tets, double poisson,
                        std::vector<double> depths, const ProgressCallback& progress);

}  // namespace livetet
