#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "apps/live/target_responses.hpp"
#include "apps/scene/targets.hpp"
#include "io/registration_file.hpp"
#include "tracking/pose_estimator.hpp"
#include "tracking/sensor_patch.hpp"

namespace livetet {

/// What makes a target's shown place err.
/// - `reference`: the estimate of the reference sensor's pose.
/// - `fiducials`: the registration to the image.
/// - `sensors`: the estimates of the deformation sensors' poses, now and when they were placed.
/// - `patches`: radius and place of the patches.
/// - `materials`: the stated spreads of material values.
/// - `fixed`: the stated spreads of the fixed nodes' borders and stiffness.
/// - `elements`: four-node elements against ten-node ones.
/// - `law`: a share of the displacement that linear responses do not explain: by large strain,
///   which another constitutive model would change, and by inertia.
/// - `solver`: the frame's linear solve.
enum class ErrorSource {
    reference,
    fiducials,
    sensors,
    patches,
    materials,
    fixed,
    elements,
    law,
    solver
};
inline constexpr std::size_t error_source_count = 9;
const char* name_of(ErrorSource source);

/// A set of error sources.
class ErrorSources {
  public:
    void add(ErrorSource source) { bits_ |= 1U << static_cast<unsigned>(source); }
    bool has(ErrorSource source) const { return bits_ >> static_cast<unsigned>(source) & 1; }
    void add(ErrorSources others) { bits_ |= others.bits_; }
    bool empty() const { return bits_ == 0; }
    std::uint32_t bits() const { return bits_; }
    static ErrorSources of_bits(std::uint32_t bits);
    static ErrorSources all() { return of_bits((1U << error_source_count) - 1); }

  private:
    std::uint32_t bits_ = 0;
};

/// Where a frame shows a target, and how far that may be off; of a region, its place with the
/// largest radius.
struct TargetStatement {
    Vector3 position = Vector3::Zero();  ///< in the image, deformed, m
    /// Of the error of the place at which it is shown, along the axes of the image, m^2.
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double radius_95 = 0;  ///< within which the target is with 95 %, m
    /// Mean square of the error by each source, m^2: the trace of its covariance.
    std::array<double, error_source_count> by_source{};
};

/// The error over the organ's surface, at the places of surface_places. A frame renews a share of
/// them, in turns.
struct SurfaceStatement {
    std::vector<double> radius_95;  ///< at each place, m; 0 before the first renewal
    /// Sources that some of the radii lack, as they could not be estimated when those were renewed.
    ErrorSources missing;
};

/// The targets of a frame.
struct FrameStatement {
    std::vector<TargetStatement> targets;  ///< in the order of the scene; empty: nothing to state
    /// Sources that are not, or not wholly, in the numbers, as they could not be estimated.
    ErrorSources missing;
    double computed = 1;  ///< share of the model's responses that are known
    SurfaceStatement surface;
};

/// What an ErrorStatement needs to know of the poses in a frame.
struct PoseErrors {
    const PoseEstimate* reference = nullptr;  ///< tracker_from_reference; null: not known
    RigidTransform<ImageFrame, Reference> image_from_reference;
    const ExpectedRegistrationError* registration = nullptr;  ///< null: not known
    /// There is no sensor, one is not placed yet, or a patch is being released for good: what the
    /// organ does there is not known.
    bool is_unknown_elsewhere = false;
};

/// What it needs to know of the frame's solve.
struct SolveErrors {
    std::optional<double>
        linear{};  ///< of its linear solve, m, RMS over the nodes; none: not known
    bool has_turned_elements = false;  ///< so that linear responses do not explain what it gave
};

/// So many frames renew all places of the surface: a place takes some microseconds.
inline constexpr std::size_t surface_turns = 6;

/// Whether errors are stated over the surface, too. They cost 0.1 ms a frame.
enum class SurfaceErrors { stated, left_out };

/// States the errors at targets and over the surface, frame by frame. With e the error of a target
/// at rest at x whose displacement is u, along the axes of the image and to first order,
///
///     e = d_f + a_f x (x - t)                           fiducials
///       + R J(x) e_r - sum_s G_s k_s R J(x_s) e_r       reference sensor now
///       + sum_s G_s l_s R J(x_s) e_b                    and when sensors were placed
///       + sum_s G_s e_s                                 sensors
///       + sum_s (dG_s/dr + c_s . grad G_s) d_s          patches: radius, place
///       + sum_s (dG_s/dm + dG_s/df + dG_s/dh) d_s       materials, fixed, elements
///       + law (u - sum_s G_s d_s) + solver,
///
/// with G_s the response of the target to the motion d_s of patch s (TargetResponses) and J(x) the
/// Jacobian of a point of the reference sensor's pose. A sensor's motion is taken relative to the
/// reference: the error of the reference's pose acts on both, and cancels where G_s is 1. k_s is
/// the part of it that the sensor's own filter passes. All sensors are taken to have been placed
/// with one error e_b, which is spread as e_r is but for the factor l_s. Moving the patch by c_s is
/// taken to be moving the target by -c_s. The sources are taken to be independent.
class ErrorStatement {
  public:
    ErrorStatement(const Scene& scene, MeshHierarchy hierarchy, const TetMesh& mesh,
                   SurfaceErrors surface = SurfaceErrors::stated);

    /// The patches or the fixed nodes have changed: responses are computed anew. `fix`: as
    /// TargetResponses::start.
    void start(std::span<const SensorPatch* const> patches, const std::vector<FixOptions>& fix);
    /// What depends on the body's mesh.
    struct OnMesh {
        TargetResponses responses;  ///< at the targets' places, then those of the surface
        PointSampler sampler;       ///< of the places in the body's mesh
    };
    /// That of a mesh that was cut: targets keep their places at rest. `scene`: its selections need
    /// no file; `before`: the body's mesh now; `after`: the next one.
    OnMesh on_mesh(const Scene& scene, MeshHierarchy hierarchy, const TetMesh& before,
                   const TetMesh& after) const;
    /// The body has that mesh now. Call `start` before the next frame.
    void set_mesh(OnMesh&& on_mesh);
    /// One unit of the responses' work; see TargetResponses::work.
    bool work() { return on_mesh_.responses.work(); }

    /// States the errors of a frame, and those of the surface's places whose turn it is.
    /// `patches`: those of the last `start`, in the same order. Allocates nothing.
    const FrameStatement& update(const PoseErrors& poses,
                                 std::span<const SensorPatch* const> patches,
                                 std::span<const Vector3> displacement, const SolveErrors& solve);

    const std::vector<Target>& targets() const { return targets_; }
    const TargetResponses& responses() const { return on_mesh_.responses; }

  private:
    /// What a patch does in a frame; the same for all places.
    struct PatchTerms {
        Eigen::Matrix<double, 6, 1> motion = Eigen::Matrix<double, 6, 1>::Zero();  ///< d_s, m, rad
        std::optional<PatchError> error;  ///< none: not known
        /// R J(x_s), times k_s: the error of the motion by that of the reference's pose.
        Eigen::Matrix<double, 3, 6> by_reference = Eigen::Matrix<double, 3, 6>::Zero();
        /// The same by that of its pose when the sensor was placed: times l_s.
        Eigen::Matrix<double, 3, 6> base_by_reference = Eigen::Matrix<double, 3, 6>::Zero();
        Eigen::Matrix3d place = Eigen::Matrix3d::Zero();  ///< covariance of its place, m^2
        bool is_firm = true;                              ///< not held by springs meanwhile
    };
    void find_terms(const PoseErrors& poses, std::span<const SensorPatch* const> patches);
    void find_missing(const PoseErrors& poses, const SolveErrors& solve);
    void renew_surface(const PoseErrors& poses, std::span<const Vector3> displacement,
                       double solver_error);
    /// `place`: index in the places of responses_.
    TargetStatement state(std::size_t place, const PoseErrors& poses, const Vector3& u,
                          double solver_error) const;

    std::vector<Target> targets_;
    OnMesh on_mesh_;
    std::vector<PatchTerms> terms_;
    /// Gravity, loads, driven nodes or a start, which the responses do not know.
    bool has_forces_;
    FrameStatement statement_;
    std::size_t turn_ = 0;  ///< of the surface, in the next frame
    /// What the radii lack that were renewed in each turn.
    std::array<ErrorSources, surface_turns> missing_of_turn_;
};

}  // namespace livetet
