#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/tracker_recorder.hpp"
#include "io/registration_file.hpp"
#include "io/surface_file.hpp"

namespace livetet {

/// What a user asks of `livetet register`.
struct RegisterArguments {
    std::string tracker;  ///< a list of points, or a source of poses
    double seconds = 0;   ///< of a stream: how long it is listened to; 0: until Ctrl-C
    std::filesystem::path image, tip, output;
    std::vector<double> tip_mm;
    std::string tool = "Stylus", reference, dwells;
    std::vector<std::string> weights;  ///< NAME=W
    std::vector<double> targets_mm;
    bool scale = false, any_order = false;
    std::filesystem::path surface;
    std::string surface_points, surface_frames;
    Space space = Space::ras;
    double surface_left_out = 0.1;
};

/// The fiducials in the image and in the tracker's (and the reference sensor's) frame, with their
/// weights; not registered yet. Throws Error where files cannot be read, fiducials are not as many,
/// or the tip does not rest where it should.
FiducialRegistration collect_fiducials(const RegisterArguments& a, const SourceReader& read);

/// Their places in the image, or in the frame that the registration is made in; their weights (none
/// where all are 1).
std::vector<Eigen::Vector3d> places_in_image(const FiducialRegistration& r);
std::vector<Eigen::Vector3d> places_in_base(const FiducialRegistration& r);
std::vector<double> weights_of(const FiducialRegistration& r);

/// Gives fiducial i of the image what was touched as number order[i].
void reorder_touched(FiducialRegistration& r, const std::vector<std::size_t>& order);

/// Points touched on the organ's surface, in the frame that the registration is made in: of a list,
/// or where the tip was in a recording or is in a stream.
std::vector<Eigen::Vector3d> collect_surface_points(const RegisterArguments& a,
                                                    const SourceReader& read);

/// The organ's surface in the image: of a mesh hierarchy (.h5) the boundary of its finest level,
/// else a surface file.
TriangleMesh read_organ_surface(const RegisterArguments& a);

}  // namespace livetet
