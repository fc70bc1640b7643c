#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

#include "geometry/transform.hpp"
#include "geometry/triangle_mesh.hpp"

namespace livetet {

struct SurfaceFitOptions {
    double trimmed_share = 0.1;  ///< share of the points, the farthest from the surface, that does
                                 ///< not count; below 0.5
    int max_iterations = 100;
    double tolerance = 1e-6;  ///< metres: done when no point moves farther in an iteration
    double min_constraint =
        0.01;  ///< an eigenvalue below this is a motion that the points do not hold
};

/// A rigid motion that points on a surface hold well or badly. Its size is one: the points' RMS
/// distance from their centre times the turn, and the slide of the centre.
struct PointMotion {
    Eigen::Vector3d turn = Eigen::Vector3d::Zero(), slide = Eigen::Vector3d::Zero();
    /// The mean square of the points' distances from the surface that it makes: about 1/3 where
    /// normals point everywhere, 0 where the points slide along the surface. A surface that is `e`
    /// wrong makes it wrong by `e / sqrt(constraint)`.
    double constraint = 0;
};

struct SurfaceFit {
    RigidTransform<ImageFrame, ImageFrame>
        image_from_start;  ///< from where the points were to where they fit
    double rms_before = 0,
           rms_after = 0;   ///< distances of the points that count from the surface, metres
    double rms_of_all = 0;  ///< afterwards, of those left out as well
    std::size_t points = 0, used = 0;
    int iterations = 0;
    bool converged = false;
    std::vector<PointMotion> motions;  ///< six, the least held first
    std::size_t free_motions =
        0;  ///< how many of them are below `min_constraint`: these were left as they were
};

/// Moves points (image frame, metres; `start` has put them near) onto a surface: iterated closest
/// points, trimmed (Chetverikov et al. 2005, "Robust Euclidean alignment of 3D point sets", Image
/// and Vision Computing 23), each step by Gauss-Newton on the distances along the surface's normals
/// (Chen, Medioni 1992), halved until the trimmed sum of squares falls. Motions that the points do
/// not hold (Gelfand et al. 2003, "Geometrically stable sampling for the ICP algorithm":
/// eigenvalues of the mean of c c^T, c = ((y - centre) / size x n, n)) are not made, but told: on a
/// plane three, on a sphere three. Comes to the nearest minimum. Throws Error for fewer than 10
/// points, values that are not finite, a surface without triangles and options out of range.
SurfaceFit fit_to_surface(std::span<const Eigen::Vector3d> points, const TriangleMesh& surface,
                          const SurfaceFitOptions& options = {});

}  // namespace livetet
