#pragma once

#include <optional>

#include "base/progress.hpp"
#include "solvers/inverse/body_place.hpp"
#include "solvers/inverse/force_basis.hpp"
#include "solvers/inverse/point_pose.hpp"
#include "solvers/inverse/surface_misfit.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// How a deformation is sought from points of a surface.
struct SurfaceRegistrationOptions {
    double point_error_m = 0.0005;  ///< sigma, of the points and of the model together
    /// Energy of forces that the points need not: E0, J. Smaller: stiffer.
    double prior_energy_J = 1e-3;
    double tolerance_m = 0.0005;  ///< converged if nothing moves farther in an iteration
    int max_iterations = 40;
    /// Of each forward solve: residual relative to the forces at work.
    double equilibrium_tolerance = 3e-3;
    /// Relative, of linear solves for responses and gradients.
    double linear_tolerance = 1e-6;
    double landmark_error_m = 0.002;  ///< of each axis, one standard deviation
    /// What the frame of the points may be off from the body's, one standard deviation of an axis:
    /// then a rigid motion of the points is sought, too. Both 0: the frames are the same.
    double pose_error_m = 0, pose_error_rad = 0;
    ProgressCallback progress{};
};

/// What a registration came to. The displacement is in the body.
struct [[nodiscard]] SurfaceRegistrationReport {
    bool converged = false;
    const char* reason = "";
    int iterations = 0;
    int newton_iterations = 0;  ///< of all forward solves
    int renewals = 0;           ///< of the responses
    double rms_before_m = 0;    ///< distance of the points from the surface
    double rms_m = 0;
    double scale_m = 0;                 ///< s at the end, see SurfaceMisfit
    double median_m = 0;                ///< median distance of the points from the surface
    double landmark_rms_m = 0;          ///< distance of the landmarks from where they are; 0: none
    std::size_t outliers = 0;           ///< points with a confidence below 1/4
    double gradient = 0;                ///< |dJ / dq| before the last step
    Vector3 total_force_N = {};         ///< sum of the forces found
    std::vector<double> landmarks_m{};  ///< the distance of each landmark
};

/// What the points leave open: the Laplace approximation of the posterior at the result,
///
///     C = (G^T W G + R / E0 + P)^-1,
///
/// of the coefficients p of the forces and, if it is sought, the pose (t, a) after them. P holds
/// the inverse variances of the pose.
struct SurfacePosterior {
    Eigen::MatrixXd covariance;
    /// Standard deviation of each coefficient of the forces over the one that the prior alone
    /// gives: near 1 if the points say nothing of it.
    Eigen::VectorXd force_ratio;
    /// The same along the independent directions of the forces, ascending.
    Eigen::VectorXd direction_ratio;
    /// And of the pose; empty if it is not sought.
    Eigen::VectorXd pose_ratio;
};

/// Finds the forces on a stated part of a body's boundary, and with them the whole displacement,
/// from points of its deformed surface. The forces are f = B p, the pose of the points T (see
/// PointPose) with the coordinates m = (t, a). Together q = (p, m) is the smallest of
///
///     J(q) = phi(x + u(p), T c) + 1/2 sum_l |x_l + u_l(p) - T c_l|^2 / s_l^2
///            + 1/(2 E0) p^T R p + 1/2 m^T P m,   R = B^T K_0^-1 B,
///
/// u(p) being the static equilibrium, phi the SurfaceMisfit with s no less than sigma, l the
/// landmarks, whose s_l is their error times s / sigma, and p^T R p / 2 the energy that these
/// forces store in the body at rest (K_0: tangent there).
///
/// Gauss-Newton: the gradient is the adjoint's at each iterate; the Hessian is G^T W G + R / E0 + P
/// with the rows G_i = n_i . (sum_k w_k U_k, -dT c_i/dm), U = K^-1 B the responses. With up to 30
/// columns U is found anew in each iteration. With more it is kept, across frames too, until a step
/// falls short of what it predicts: then U is the larger part of the work. A step is limited to 4 %
/// of the body's diagonal and halved until J falls. Mestdagh and Cotin (2022), "An optimal control
/// problem for elastic registration and force estimation in augmented surgery", solve the same
/// problem by L-BFGS on nodal forces.
///
/// A frame starts from the last one's result: calls of `fit` follow a sequence. The body's external
/// force is that of the registration.
class SurfaceRegistration {
  public:
    /// `body`: static, constrained; must outlive this and be changed by no one else. `rest`: its
    /// nodes at rest, m. Throws Error if an option is out of range or a column of the basis moves
    /// nothing, its nodes being fixed. Collective.
    SurfaceRegistration(DeformableBody& body, std::span<const Vector3> rest,
                        std::span<const Triangle> surface, ForceBasis basis,
                        const SurfaceRegistrationOptions& options);

    /// Throws Error for points that SurfaceMisfit refuses, and where their median distance from the
    /// surface is more than half of the body's diagonal: then unit or frame are others. If the
    /// report says that it did not converge, the body is at the best equilibrium found. Collective.
    SurfaceRegistrationReport fit(std::span<const Vector3> points,
                                  std::span<const Landmark> landmarks = {});

    /// Of the last `fit`. Collective: finds the responses at the result.
    SurfacePosterior posterior();
    /// After `posterior`: how the coordinates q change where the body shows a place, as seen in the
    /// frame of the points (3 x size of q): [U at the place, -dT c / dm], c = T^-1 (x + u).
    Eigen::MatrixXd place_rows(const BodyPlace& place) const;

    Eigen::VectorXd coefficients() const { return q_.head(forces_count()); }
    const std::vector<Vector3>& displacement() const { return u_; }
    std::vector<Vector3> forces() const { return basis_.force(coefficients(), rest_.size()); }
    /// Maps the frame of the points into the body's; the identity if it is not sought.
    PointPose pose() const { return pose_at(q_); }
    const ForceBasis& basis() const { return basis_; }

  private:
    struct Step;
    struct Fitted;
    Eigen::Index forces_count() const { return static_cast<Eigen::Index>(basis_.size()); }
    bool seeks_pose() const { return q_.size() > forces_count(); }
    PointPose pose_at(const Eigen::VectorXd& q) const;
    void find_responses();
    std::vector<Vector3> moved(double length, const Step& step) const;
    double prior(const Eigen::VectorXd& q) const { return q.dot(prior_ * q) / 2; }
    /// Misfits at q and u. `scale`: s; none: from afar.
    Fitted at(const Eigen::VectorXd& q, std::span<const Vector3> u,
              std::optional<double> scale) const;
    /// One row a residual, so that the Hessian of the misfits is rows^T rows.
    Eigen::MatrixXd rows(const Fitted& fitted) const;
    Step next_step(const Fitted& fitted);
    /// Whether a share of the step lowered J; then it is taken.
    bool take(const Fitted& before, Step& step, SurfaceRegistrationReport& report);
    void check_distance(const Fitted& start) const;
    void finish(const Fitted& fitted, SurfaceRegistrationReport& report) const;

    DeformableBody& body_;
    std::vector<Vector3> rest_;
    std::vector<Triangle> surface_;
    ForceBasis basis_;
    SurfaceRegistrationOptions options_;
    double diagonal_ = 0;        ///< of the body at rest, m
    Eigen::MatrixXd responses_;  ///< U: 3 nodes x columns, m/N
    Eigen::MatrixXd prior_;      ///< R / E0 and P
    bool is_fresh_ = false;      ///< the responses are those of the present state
    Eigen::VectorXd q_;          ///< p, and m if it is sought
    std::vector<Vector3> u_;
    std::vector<Vector3> points_;  ///< of the last fit
    std::vector<Landmark> landmarks_;
    Vector3 centre_ = Vector3::Zero();  ///< of the first points: c0
    bool has_centre_ = false;
};

}  // namespace livetet
