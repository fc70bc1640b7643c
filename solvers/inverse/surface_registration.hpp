#pragma once

#include "solvers/inverse/force_basis.hpp"
#include "solvers/inverse/surface_misfit.hpp"
#include "solvers/nonlinear/deformable_body.hpp"

namespace livetet {

/// How a deformation is sought from points of a surface.
struct SurfaceRegistrationOptions {
    double point_error_m = 0.0005;  ///< sigma, of the points and of the model together
    /// Energy of forces that the points need not: E0, J. Smaller: stiffer.
    double prior_energy_J = 1e-3;
    double tolerance_m = 0.0005;  ///< converged if no node moves farther in an iteration
    int max_iterations = 40;
    /// Of each forward solve: residual relative to the forces at work.
    double equilibrium_tolerance = 3e-3;
    /// Relative, of linear solves for responses and gradients.
    double linear_tolerance = 1e-6;
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
    double scale_m = 0;          ///< s at the end, see SurfaceMisfit
    std::size_t outliers = 0;    ///< points with a confidence below 1/4
    double gradient = 0;         ///< |d phi / d p + B^T K^-1 B p / E0|, 1/N, before the last step
    Vector3 total_force_N = {};  ///< sum of the forces found
};

/// Finds the forces on a stated part of a body's boundary, and with them the whole displacement,
/// from points of its deformed surface. The forces are f = B p with the smallest
///
///     J(p) = phi(x + u(p)) + 1/(2 E0) p^T R p,   R = B^T K_0^-1 B,
///
/// u(p) being the static equilibrium, phi the SurfaceMisfit with s no less than sigma, and p^T R p
/// / 2 the energy that these forces store in the body at rest (K_0: tangent there).
///
/// Gauss-Newton: the gradient is the adjoint's at each iterate; the Hessian is G^T W G + R / E0
/// with the rows G_i = n_i . sum_k w_k U_k, U = K^-1 B the responses. With up to 30 columns U is
/// found anew in each iteration. With more it is kept, across frames too, until a step falls short
/// of what it predicts: then U is the larger part of the work. A step is limited to 4 % of the
/// body's diagonal and halved until J falls. Mestdagh and Cotin (2022), "An optimal control problem
/// for elastic registration and force estimation in augmented surgery", solve the same problem by
/// L-BFGS on nodal forces.
///
/// A frame starts from the last one's result: calls of `fit` follow a sequence. The body's external
/// force is that of the registration.
class SurfaceRegistration {
  public:
    /// `body`: static, constrained; must outlive this and be changed by no one else. `rest`: its
    /// nodes at rest, m. Throws Error if an option is not above 0 or a column of the basis moves
    /// nothing, its nodes being fixed. Collective.
    SurfaceRegistration(DeformableBody& body, std::span<const Vector3> rest,
                        std::span<const Triangle> surface, ForceBasis basis,
                        const SurfaceRegistrationOptions& options);

    /// Throws Error for points that SurfaceMisfit refuses, and where their median distance from the
    /// surface is more than half of the body's diagonal: then unit or frame are others. If the
    /// report says that it did not converge, the body is at the best equilibrium found. Collective.
    SurfaceRegistrationReport fit(std::span<const Vector3> points);

    const Eigen::VectorXd& coefficients() const { return p_; }
    const std::vector<Vector3>& displacement() const { return u_; }
    std::vector<Vector3> forces() const { return basis_.force(p_, rest_.size()); }

  private:
    struct Step;
    void find_responses();
    std::vector<Vector3> moved(double length, const Step& step) const;
    std::vector<Vector3> positions(std::span<const Vector3> u) const;
    double prior(const Eigen::VectorXd& p) const { return p.dot(prior_ * p) / 2; }
    Step next_step(const SurfaceMatches& matches);
    /// Whether a share of the step lowered J; then it is taken.
    bool take(const SurfaceMisfit& misfit, const SurfaceMatches& before, Step& step,
              SurfaceRegistrationReport& report);
    void check_distance(const SurfaceMatches& start) const;

    DeformableBody& body_;
    std::vector<Vector3> rest_;
    std::vector<Triangle> surface_;
    ForceBasis basis_;
    SurfaceRegistrationOptions options_;
    double diagonal_ = 0;        ///< of the body at rest, m
    Eigen::MatrixXd responses_;  ///< U: 3 nodes x columns, m/N
    Eigen::MatrixXd prior_;      ///< R / E0
    bool is_fresh_ = false;      ///< the responses are those of the present state
    Eigen::VectorXd p_;
    std::vector<Vector3> u_;
};

}  // namespace livetet
