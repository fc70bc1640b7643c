#pragma once

#include <Eigen/Core>

#include <vector>

#include "tracking/fiducials.hpp"

namespace livetet {

/// The liver phantom as a solid of formulas: a large right and a small left lobe over a hollow
/// lower side, about 150 x 110 x 80 mm, inside a rounded container. Positions in metres, RAS, in
/// the world of its image.
namespace phantom {

/// The middle of the organ's bounding box, and half its extents.
Eigen::Vector3d organ_centre();
Eigen::Vector3d organ_half_extents();

/// About the distance to the organ's surface, m: negative inside, exact on the surface.
double organ_distance(const Eigen::Vector3d& place);
/// The same for the container around it.
double body_distance(const Eigen::Vector3d& place);
/// The same for the vessels, which run through the organ.
double vessel_distance(const Eigen::Vector3d& place);

/// The organ's outward unit normal at (or near) its surface.
Eigen::Vector3d organ_normal(const Eigen::Vector3d& place);

/// Where a ray from `inside` the organ leaves it. Precondition: organ_distance(inside) < 0;
/// `direction` of any length.
Eigen::Vector3d organ_exit(const Eigen::Vector3d& inside, const Eigen::Vector3d& direction);

/// Whether a place belongs to the layer that a scene holds fixed: within 4 mm of the organ's
/// surface where that looks down and lies low.
bool is_held(const Eigen::Vector3d& place);

/// Where the deformation sensor rests: on the upper side of the right lobe.
Eigen::Vector3d sensor_place();
/// Where the reference sensor sits: on the lower side, which is held.
Eigen::Vector3d reference_place();

/// Each fiducial is a ball of fluid that shows in the image, in a casing that does not. Metres.
inline constexpr double marker_radius = 0.005, marker_casing = 0.0015;

/// F1 to F5 on the container: not in one plane, no two alike in their distances.
std::vector<NamedPoint> fiducials();

/// The hidden targets, all of them at least 5 mm inside the organ: T01 on are under the sensor at
/// growing depths and to its sides, the later ones spread through the rest of the organ.
std::vector<NamedPoint> targets();

}  // namespace phantom

}  // namespace livetet
