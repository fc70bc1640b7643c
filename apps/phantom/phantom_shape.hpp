#pragma once

#include <Eigen/Core>

#include <vector>

#include "tracking/fiducials.hpp"

namespace livetet {

/// The liver phantom as an implicit solid: a large right and a small left lobe over a hollow lower
/// side, about 150 x 110 x 80 mm, inside a rounded container. Positions in m, RAS, in the world of
/// its image.
namespace phantom {

/// Centre of the organ's bounding box, and half its extents.
Eigen::Vector3d organ_centre();
Eigen::Vector3d organ_half_extents();

/// Approximate distance to the organ's surface, m: negative inside, exact on the surface.
double organ_distance(const Eigen::Vector3d& place);
/// The same for the container.
double body_distance(const Eigen::Vector3d& place);
/// The same for the vessels in the organ.
double vessel_distance(const Eigen::Vector3d& place);

/// The organ's outward unit normal at (or near) its surface.
Eigen::Vector3d organ_normal(const Eigen::Vector3d& place);

/// Where a ray from `inside` leaves the organ. Precondition: organ_distance(inside) < 0;
/// `direction` may have any length.
Eigen::Vector3d organ_exit(const Eigen::Vector3d& inside, const Eigen::Vector3d& direction);

/// Whether a point is in the fixed layer: within 4 mm of the organ's surface where that faces down
/// and lies low.
bool is_held(const Eigen::Vector3d& place);

/// Position of the deformation sensor, on the upper side of the right lobe.
Eigen::Vector3d sensor_place();
/// Position of the reference sensor, on the fixed lower side.
Eigen::Vector3d reference_place();

/// Each fiducial is a visible ball of fluid in an invisible casing; m.
inline constexpr double marker_radius = 0.005, marker_casing = 0.0015;

/// F1 to F5 on the container: not coplanar, and with distinct distances.
std::vector<NamedPoint> fiducials();

/// The hidden targets, at least 5 mm inside the organ: the first are below the sensor at growing
/// depths and to its sides, the others spread through the organ.
std::vector<NamedPoint> targets();

}  // namespace phantom

}  // namespace livetet
