#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
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
    StepReport equilibrium;  ///< of the last solve, to the scene's tolerance; cut short: to 1e-4
    /// Maps the measured points into the image.
    RigidTransform<ImageFrame, ImageFrame> image_from_points;
    /// Of the points from the surface at rest, best rigid motion; of the first `finish` alone.
    double rigid_rms_m = 0;
    double fit_s = 0;         ///< time of the fit
    double first_step_s = 0;  ///< and of its set-up and first iteration
    bool is_stated = false;   ///< the fit converged: what follows counts
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

/// Patterns of forces that are sought, and how to name them.
struct SoughtForces {
    ForceBasis basis;
    std::vector<std::string> names;  ///< of each column
};

/// Finds the forces on the stated part of the boundary, the displacement of all nodes and, unless
/// the frame is fixed, the rigid motion that bring the organ's surface to measured points. Fits may
/// follow each other, as more points come: each starts from the last one's result, but after
/// `start_again` from rest. To use it: `fit` and `state_errors` as often as wanted; at the end
/// `finish`. All are collective.
class DeformingRegistration {
  public:
    /// Constrains the body as the scene says. Scene and body must outlive this. Throws Error for a
    /// zone of forces without free nodes of the surface, and for targets that are not in the body.
    DeformingRegistration(const Scene& scene, SceneBody& body, const SceneConstraints& constraints);

    /// Throws Error, naming their source, if the points cannot be of this organ at rest or
    /// deformed, or are too few for what is sought.
    void check(const MeasuredOrgan& measured) const;
    /// The body is left at the equilibrium found. `max_iterations`: none: as the scene says. Throws
    /// Error as SurfaceRegistration::fit does.
    DeformedOrgan fit(const MeasuredOrgan& measured, std::optional<int> max_iterations = {},
                      const ProgressCallback& progress = {});
    /// The next fit starts from rest, as the first.
    void start_again();
    /// Adds what the points determine, and the targets, linearised where the last fit ended.
    void state_errors(DeformedOrgan& found);
    /// Adds the targets alone, where the last fit puts them: the errors of a fit that did not
    /// converge are not stated.
    void place_targets(DeformedOrgan& found) const;
    /// Checks the points, fits them to the end, states the errors if that converged, and brings the
    /// body to equilibrium to the scene's tolerance. Throws Error where the surface that the fit
    /// ends with is not that of the points, too.
    DeformedOrgan finish(const MeasuredOrgan& measured, const ProgressCallback& progress = {},
                         std::optional<int> max_iterations = {});

  private:
    /// Points and landmarks about which the pose is sought.
    struct PlacedPoints {
        std::vector<Vector3> points;
        std::vector<Landmark> landmarks;
    };
    const TetMesh& mesh() const { return body_.mesh(); }
    PlacedPoints placed(const MeasuredOrgan& measured) const;
    void refuse_other_surface(const MeasuredOrgan& measured, const DeformedOrgan& found,
                              int max_iterations) const;

    /// A fit's states are in balance to a fraction of a per cent only. Where an exact solve leaves
    /// them for a far one (forces on a few nodes pull out a spike), the fit has not converged.
    void refuse_other_equilibrium(DeformedOrgan& found);
    /// The body's equilibrium under the forces found, or a state near it where the fit was cut
    /// short.
    void bring_to_rest(DeformedOrgan& found, int max_iterations);

    const Scene& scene_;
    SceneBody& body_;
    const DeformOptions deform_;
    const TriangleMesh surface_;  ///< at rest
    const SoughtForces sought_;
    /// By name; of a region some places.
    const std::vector<std::pair<std::string, std::vector<BodyPlace>>> targets_;
    std::unique_ptr<SurfaceRegistration> registration_;
    ProgressCallback progress_;  ///< of the present fit
    /// frame: surface: maps points to where the first ones fit the organ at rest best.
    std::optional<RigidTransform<ImageFrame, ImageFrame>> start_;
    double set_up_s_ = 0;  ///< of the construction, until the first fit counts it
    bool has_finished_ = false;
};

}  // namespace livetet
