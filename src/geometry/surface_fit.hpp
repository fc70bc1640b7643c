#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

#include "geometry/transform.hpp"
#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// Options of `fit_to_surface`.
struct SurfaceFitOptions {
    /// Share of the points, the farthest from the surface, that is left out of the fit; below 0.5.
    double trimmed_share = 0.1;
    int max_iterations = 100;
    double tolerance = 1e-6;  ///< metres; converged if no point moves farther in an iteration
    /// Motions whose eigenvalue is below this are not constrained by the points.
    double min_constraint = 0.01;
};

/// An eigenvector of the fit's normal matrix: a rigid motion of unit size and how well the points
/// constrain it. The size is the norm of (RMS distance of the points from their centre times the
/// rotation, translation of the centre).
struct PointMotion {
    Eigen::Vector3d turn = Eigen::Vector3d::Zero(), slide = Eigen::Vector3d::Zero();
    /// Mean square of the distances from the surface that the motion causes: about 1/3 if the
    /// normals point in all directions, 0 if the points slide along the surface. A surface error
    /// `e` causes an error of the motion of `e / sqrt(constraint)`.
    double constraint = 0;
};

/// Result of `fit_to_surface`. `points`: all points, `used`: those that were not left out.
struct SurfaceFit {
    /// Moves the points from their start to where they fit.
    RigidTransform<ImageFrame, ImageFrame> image_from_start;
    double rms_before = 0,
           rms_after = 0;   ///< RMS distance of the points used from the surface, metres
    double rms_of_all = 0;  ///< the same after the fit, including the points left out
    std::size_t points = 0, used = 0;
    int iterations = 0;
    bool converged = false;
    std::vector<PointMotion> motions;  ///< six, the least constrained first
    /// Number of motions below `min_constraint`; the fit did not change these.
    std::size_t free_motions = 0;
};

/// Registers points (image frame, metres), already near their final position, to a surface: trimmed
/// iterative closest point (Chetverikov et al. 2005, "Robust Euclidean alignment of 3D point sets",
/// Image and Vision Computing 23). Each step is a Gauss-Newton step on the distances along the
/// surface normals (Chen, Medioni 1992), halved until the trimmed sum of squares decreases.
/// Converges to the nearest local minimum.
///
/// Motions that the points do not constrain are left unchanged and reported: the eigenvectors with
/// small eigenvalues of the mean of c c^T, c = ((y - centre) / size x n, n), for points y with
/// normals n (Gelfand et al. 2003, "Geometrically stable sampling for the ICP algorithm"). A plane
/// and a sphere each leave three.
///
/// Throws Error for fewer than 10 points, values that are not finite, a surface without triangles,
/// and options out of range.
SurfaceFit fit_to_surface(std::span<const Eigen::Vector3d> points, const TriangleMesh& surface,
                          const SurfaceFitOptions& options = {});

}  // namespace livetet
