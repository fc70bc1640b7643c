#pragma once

#include <optional>

#include "base/progress.hpp"
#include "solvers/inverse/body_place.hpp"
#include "solvers/inverse/force_basis.hpp"
#include "solvers/inverse/point_pose.hpp"
#include "solvers/inverse/prior_evidence.hpp"
#include "solvers/inverse/surface_misfit.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// How a deformation is sought from points of a surface.
struct SurfaceRegistrationOptions {
    double point_error_m = 0.0005;  ///< sigma, of the points and of the model together
    /// Points nearer to each other than about this share the error of the model's surface: m. 0:
    /// all errors are independent.
    double shared_error_m = 0;
    /// Energy of forces that need no reason in the points: E0, J. Smaller: stiffer. None: chosen
    /// by the evidence (see PriorEvidence) in each iteration.
    std::optional<double> prior_energy_J{};
    double tolerance_m = 0.0005;  ///< converged if nothing moves farther from then on
    /// Converged, too, if so little is left: of a standard deviation, RMS over the unknowns.
    double spread_share = 0.1;
    int max_iterations = 40;
    /// Whether the first iterations move each zone of the forces as a whole: they find their way
    /// where many patterns end in a poor minimum. Only for zones that are known.
    bool starts_whole = false;
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
    PriorWeight prior{};                ///< E0, J; the rest only where it was chosen
    double sharing_points = 1;          ///< nu: points that share an error, on average
};

/// What the points leave open: the Laplace approximation of the posterior at the result,
///
///     C = (G^T W G / nu + R / E0 + P)^-1,
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
///     J(q) = phi(x + u(p), T c) / nu + 1/2 sum_l |x_l + u_l(p) - T c_l|^2 / s_l^2
///            + 1/(2 E0) p^T R p + 1/2 m^T P m,   R = B^T K_0^-1 B,
///
/// u(p) being the static equilibrium, phi the SurfaceMisfit with s no less than sigma, l the
/// landmarks, whose s_l is their error times s / sigma, and p^T R p / 2 the energy that these
/// forces store in the body at rest (K_0: tangent there). nu is the mean number of points that
/// share an error,
///
///     nu = 1 + (s_m / sigma)^2 (1/N sum_ij exp(-|c_i - c_j|^2 / (2 l^2)) - 1),
///     l = shared_error_m,   s_m = min(sigma, 0.5 mm).
///
/// s_m is the model's part of a point's error; the rest is noise, which is each point's own.
///
/// E0 is stated, or the one of the largest evidence at the present linearisation, renewed in the
/// first 25 iterations by a factor of 4 at most. It starts where the prior alone lets the seen
/// surface move by 2 % of the body's diagonal, RMS, so that the first steps are stiff.
///
/// Gauss-Newton: the gradient is the adjoint's at each iterate; the Hessian is
/// G^T W G / nu + R / E0 + P with the rows G_i = n_i . (sum_k w_k U_k, -dT c_i/dm), U = K^-1 B the
/// responses. With up to 30 columns, or where the body's solver is a factorisation, U is found anew
/// in each iteration. Else it is kept, across frames too, until a step falls short of what it
/// predicts: then U is the larger part of the work.
/// A step is limited to 4 % of the body's diagonal and halved until J falls. Mestdagh and Cotin
/// (2022), "An optimal control problem for elastic registration and force estimation in augmented
/// surgery", solve the same problem by L-BFGS on nodal forces.
///
/// Where more than 5 % of the points are farther than 3 s at the start, s begins at the distance
/// that 95 % are within and falls by a factor of 0.7 an iteration at most (graduated non-convexity,
/// Blake and Zisserman 1987, Visual Reconstruction): else a part that is pulled far is left as
/// outliers.
///
/// With `starts_whole`, the first iterations seek the least J along p = Z z, the same force on each
/// pattern of a zone (ForceBasis::of_whole_zones), until no node moves farther than four times the
/// tolerance, J does not fall, or eight are done.
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
    /// report says that it did not converge, the body is at the best equilibrium found.
    /// `max_iterations`: none: that of the options. Collective.
    SurfaceRegistrationReport fit(std::span<const Vector3> points,
                                  std::span<const Landmark> landmarks = {},
                                  std::optional<int> max_iterations = {});

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
    void set_energy(double energy_J);
    /// Of the unknowns, linearised at the present state.
    LinearMisfit linear_misfit(const Fitted& fitted) const;
    void start_energy(const Fitted& fitted);
    /// Chooses E0 by the evidence. Returns whether it changed.
    bool choose_energy(const Fitted& fitted);
    std::vector<Vector3> moved(double length, const Step& step) const;
    double prior(const Eigen::VectorXd& q) const { return q.dot(prior_ * q) / 2; }
    /// Misfits at q and u. `scale`: s; none: from afar.
    Fitted at(const Eigen::VectorXd& q, std::span<const Vector3> u,
              std::optional<double> scale) const;
    /// One row a residual, so that the Hessian of the misfits is rows^T rows.
    Eigen::MatrixXd rows(const Fitted& fitted) const;
    /// Of the misfits by the coefficients of the forces. `by_u`: by the displacement.
    Eigen::VectorXd force_gradient(std::span<const Vector3> by_u) const;
    Step next_step(const Fitted& fitted);
    /// -H^-1 g, or its like along forces that move whole zones while that lasts.
    Eigen::VectorXd increment(const Eigen::MatrixXd& hessian,
                              const Eigen::VectorXd& gradient) const;
    /// Takes the points of the next fit. Returns the misfits before it.
    Fitted begin(std::span<const Vector3> points, std::span<const Landmark> landmarks);
    /// Whether a share of the step lowered J; then it is taken.
    bool take(const Fitted& before, Step& step, SurfaceRegistrationReport& report);
    /// Whether the optimum is near by the posterior's spread: what is left of the way to it, by a
    /// full step, in standard deviations (Newton's decrement; S. Boyd and L. Vandenberghe, Convex
    /// Optimization, 2004, section 9.5).
    bool is_within_spread(const Step& step) const;
    /// At the present state, with s no less than 0.7 `scale`.
    Fitted annealed(double scale) const;
    void check_distance(const Fitted& start) const;
    void finish(const Fitted& fitted, SurfaceRegistrationReport& report) const;

    DeformableBody& body_;
    std::vector<Vector3> rest_;
    std::vector<Triangle> surface_;
    ForceBasis basis_;
    SurfaceRegistrationOptions options_;
    double diagonal_ = 0;        ///< of the body at rest, m
    Eigen::MatrixXd responses_;  ///< U: 3 nodes x columns, m/N
    Eigen::MatrixXd shape_;      ///< R, J/N^2
    Eigen::MatrixXd prior_;      ///< R / E0 and P
    PriorWeight weight_;         ///< E0; 0 energy: not chosen yet
    double sharing_ = 1;         ///< nu
    int whole_left_ = 0;         ///< iterations that move each zone as a whole: at most
    bool is_fresh_ = false;      ///< the responses are those of the present state
    double reach_ = 0;           ///< m, of a step: it grows by those that are taken whole
    Eigen::VectorXd q_;          ///< p, and m if it is sought
    std::vector<Vector3> u_;
    std::vector<Vector3> points_;  ///< of the last fit
    std::vector<Landmark> landmarks_;
    Vector3 centre_ = Vector3::Zero();  ///< of the first points: c0
    bool has_centre_ = false;
};

}  // namespace livetet
