#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/tracker_recorder.hpp"
#include "io/registration_file.hpp"
#include "io/surface_file.hpp"
#include "io/tip_file.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// Options of `livetet register --materials`.
struct MaterialArguments {
    std::filesystem::path scene;
    bool support = false;  ///< soft `fix` are sought, too
};

/// Options of `livetet register --deform` for an organ that is followed.
struct FollowArguments {
    bool live = false;                      ///< fit while the tip is led over the surface
    std::string publish;                    ///< where `live` serves its fits
    std::vector<std::string> later_points;  ///< lists, as the organ moves on
};

/// Options of `livetet register`.
struct RegisterArguments {
    std::string tracker;               ///< file of points, recording or stream
    std::optional<double> length_s{};  ///< of a stream: recording time; none: until stopped
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
    std::filesystem::path scene;  ///< --deform
    std::filesystem::path landmarks, registration, json;
    FollowArguments follow{};
    MaterialArguments materials{};
};

/// The fiducials in the image and in the frame of the tracker (and of the reference sensor), with
/// their weights, and what is known of the tool that touched them.
struct CollectedFiducials {
    FiducialRegistration registration;  ///< not yet fitted
    /// Covariance of the tip in the tool's frame, m^2. Empty for points of a list, and if --tip is
    /// not given or does not hold it.
    std::optional<Eigen::Matrix3d> tip_covariance;
    /// base_from_tool at each fiducial, `Dwell::mean_turn`. Empty for points of a list.
    std::vector<Eigen::Matrix3d> base_from_tool;
};

/// Reads the fiducials. Throws Error if a file cannot be read, the numbers of fiducials differ, or
/// the tip did not rest as often as there are fiducials.
CollectedFiducials collect_fiducials(const RegisterArguments& a, const SourceReader& read);

/// Positions in the image, positions in the frame of the registration, and weights (empty if all
/// are 1).
std::vector<Eigen::Vector3d> places_in_image(const FiducialRegistration& r);
std::vector<Eigen::Vector3d> places_in_base(const FiducialRegistration& r);
std::vector<double> weights_of(const FiducialRegistration& r);

/// Pairs fiducial i of the image with the point touched as number order[i].
void reorder_touched(CollectedFiducials& fiducials, const std::vector<std::size_t>& order);

/// Whether this is a list of points by its name, not a recording or stream.
bool is_point_list(const std::filesystem::path& path);

/// A list of named points: .mrk.json, .fcsv or .csv, m.
std::vector<NamedPoint> read_point_list(const std::filesystem::path& path);

/// The tip of the tool that touches points. `source`: what needs it. Throws Error if it is not
/// given, or given twice.
ToolTip tip_of(const RegisterArguments& a, const std::string& source);

/// The poses of the tool that is led over the surface, and of the reference sensor. Throws Error if
/// the tip is not known.
Recording read_surface_sweep(const RegisterArguments& a, const SourceReader& read);

/// Points touched on the organ's surface, in the frame of the registration: from a list, or the
/// tip's positions in a recording or stream.
std::vector<Eigen::Vector3d> collect_surface_points(const RegisterArguments& a,
                                                    const SourceReader& read);

/// The tip's positions in a recording, likewise.
std::vector<Eigen::Vector3d> surface_points_of(const RegisterArguments& a,
                                               const Recording& recording);

/// The organ's surface in the image: the boundary of the finest level of a mesh hierarchy (.h5),
/// else a surface file.
TriangleMesh read_organ_surface(const RegisterArguments& a);

}  // namespace livetet
