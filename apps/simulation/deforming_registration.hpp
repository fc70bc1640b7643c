#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/scene/body_factory.hpp"
#include "apps/scene/targets.hpp"
#include "apps/simulation/measured_organ.hpp"
#include "geometry/transform.hpp"
#include "solvers/inverse/surface_registration.hpp"

namespace livetet {

/// Where a deforming registration puts a target, and how far that may be off by what the points
/// leave open and by the model's own error; of a region, its place with the largest radius.
struct TargetSpread {
    std::string name;
    BodyPlace place;
    Vector3 position = Vector3::Zero();  ///< in the image, deformed, m
    /// Of the position that is shown for what lies in the frame of the points, m^2.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double radius_95 = 0;    ///< m
    double by_pose_m2 = 0;   ///< what the covariance's trace would be by the pose alone
    double by_model_m2 = 0;  ///< and by model_error_percent alone
};

/// What a deforming registration found.
struct DeformedOrgan {
    SurfaceRegistrationReport report;
    StepReport equilibrium;  ///< of the last solve, to the scene's tolerance
    /// Maps the measured points into the image.
    RigidTransform<ImageFrame, ImageFrame> image_from_points;
    double rigid_rms_m = 0;   ///< of the points from the surface at rest, best rigid motion
    double fit_s = 0;         ///< time of the fit
    double first_step_s = 0;  ///< and of its set-up and first iteration
    // What the points determine; only where the fit converged:
    bool is_stated = false;
    double total_force_radius_95_N = 0;
    std::size_t directions = 0;            ///< independent directions of the forces
    std::size_t open_directions = 0;       ///< those of which the points say nothing
    std::vector<std::string> open_forces;  ///< the forces among them, by zone, place and axis
    std::size_t open_motions = 0;          ///< of the six rigid ones, if they are sought
    std::vector<TargetSpread> targets;
};

/// A direction is open if its standard deviation is more than this share of the one without points.
constexpr double open_ratio = 0.9;

/// The section `deform` of a scene, or its defaults.
DeformOptions deform_options(const Scene& scene);

/// Throws Error if the scene has what a deforming registration cannot take: loads, gravity, driven
/// nodes or a dynamic scheme.
void check_deform_scene(const Scene& scene);

/// Finds the forces on the stated part of the boundary, the displacement of all nodes and, unless
/// the frame is fixed, the rigid motion that bring the organ's surface to measured points. The body
/// is left at the equilibrium found. Throws Error for points that check_measured refuses, and where
/// the surface that the fit ends with is not that of the points. Collective.
DeformedOrgan register_deformation(const Scene& scene, SceneBody& body,
                                   const SceneConstraints& constraints,
                                   const MeasuredOrgan& measured, const ProgressCallback& progress);

}  // namespace livetet
