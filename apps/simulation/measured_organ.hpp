#pragma once

#include <span>
#include <string>
#include <vector>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// A landmark of the organ, and where it is measured now; m, both in the frame of the image.
struct MeasuredLandmark {
    std::string name;
    Vector3 at_rest, measured;
};

/// What was measured of a deformed organ, m, as far as is known in the frame of the image.
struct MeasuredOrgan {
    std::string source;  ///< for messages: the file of the points
    std::vector<Vector3> points;
    std::vector<MeasuredLandmark> landmarks;
};

/// Throws Error, naming the file, if points cannot be of this organ at rest or deformed: too few
/// for so many `unknowns`, of another unit, on one spot, mirrored (LPS for RAS), or far away.
void check_measured(const MeasuredOrgan& measured, const TriangleMesh& surface,
                    std::size_t unknowns);

/// Throws Error if landmarks cannot be of this organ: of another unit, mirrored (LPS for RAS), or
/// as far from their places at rest as the organ is wide. `rest`: nodes of its surface or body, m.
void check_landmarks(std::span<const MeasuredLandmark> landmarks, std::span<const Vector3> rest);

/// Median distance of points from a surface, m.
double median_distance(std::span<const Vector3> points, const TriangleMesh& surface);

}  // namespace livetet
