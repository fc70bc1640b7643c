#include "solvers/inverse/surface_registration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "solvers/inverse/adjoint_gradient.hpp"

namespace livetet {

/// An increment of forces, pose and displacement.
struct SurfaceRegistration::Step {
    Eigen::VectorXd dq;
    Eigen::VectorXd du;       ///< m, three numbers a node, to first order
    double size = 0;          ///< of the largest motion of a node or point, m
    double taken = 1;         ///< share
    double slope = 0;         ///< of J along dq: negative
    bool fell_short = false;  ///< J, or the imbalance at the predicted state, is not as predicted
    double gradient = 0;      ///< norm
};

/// A state's misfits.
struct SurfaceRegistration::Fitted {
    SurfaceMatches matches;
    std::vector<Vector3> offsets;  ///< of the landmarks: x_l + u_l - T c_l, m
    PointPose pose;
    double landmark_scale = 0;  ///< s_l, m
    double value = 0;           ///< of both misfits
};

namespace {

constexpr Eigen::Index pose_size = 6;
constexpr int max_whole_iterations = 8;
constexpr double max_share = 0.04;  // of the diagonal, that a step moves a node by: tets invert
constexpr double max_shared_m = 0.0005;  // of a point's error: the model's; the rest is noise

void check_positive(double value, const char* name) {
    if (!(value > 0 && std::isfinite(value)))
        fail("surface registration: {} = {}, expected more than 0", name, value);
}

void check_registration_options(const SurfaceRegistrationOptions& o) {
    check_positive(o.point_error_m, "point_error_m");
    if (o.prior_energy_J) check_positive(*o.prior_energy_J, "prior_energy_J");
    if (o.shared_error_m != 0) check_positive(o.shared_error_m, "shared_error_m");
    check_positive(o.tolerance_m, "tolerance_m");
    if (o.spread_share != 0) check_positive(o.spread_share, "spread_share");
    check_positive(o.equilibrium_tolerance, "equilibrium_tolerance");
    check_positive(o.linear_tolerance, "linear_tolerance");
    check_positive(o.max_iterations, "max_iterations");
    check_positive(o.landmark_error_m, "landmark_error_m");
    if (o.pose_error_m == 0 && o.pose_error_rad == 0) return;
    check_positive(o.pose_error_m, "pose_error_m");
    check_positive(o.pose_error_rad, "pose_error_rad");
}

/// Standard deviations of a covariance over those of `prior`, along the directions in which they
/// are independent, ascending: the generalised eigenvalues.
Eigen::VectorXd spread_ratios(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& prior) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
        (covariance + covariance.transpose()) / 2, (prior + prior.transpose()) / 2,
        Eigen::EigenvaluesOnly | Eigen::Ax_lBx);
    return eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
}

/// Inverse of a symmetric positive definite matrix of any scaling.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& a) {
    const Eigen::VectorXd scale = a.diagonal().cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd scaled = scale.asDiagonal() * a * scale.asDiagonal();
    return scale.asDiagonal() * scaled.ldlt().solve(Eigen::MatrixXd::Identity(a.rows(), a.cols())) *
           scale.asDiagonal();
}

}  // namespace

SurfaceRegistration::SurfaceRegistration(DeformableBody& body, std::span<const Vector3> rest,
                                         std::span<const Triangle> surface, ForceBasis basis,
                                         const SurfaceRegistrationOptions& options)
    : body_(body),
      rest_(rest.begin(), rest.end()),
      surface_(surface.begin(), surface.end()),
      basis_(std::move(basis)),
      options_(options),
      u_(rest.size(), Vector3::Zero()) {
    check_registration_options(options);
    if (basis_.size() == 0) fail("surface registration: found no column in the force basis");
    const Eigen::Index n = forces_count();
    if (options.starts_whole && basis_.of_whole_zones().cols() < n)
        whole_left_ = max_whole_iterations;
    const Eigen::Index all = n + (options.pose_error_m > 0 ? pose_size : 0);
    q_ = Eigen::VectorXd::Zero(all);
    Eigen::AlignedBox3d box;
    for (const Vector3& x : rest_) box.extend(x);
    diagonal_ = box.diagonal().norm();
    body_.set_displacement(u_);
    body_.linearise();
    find_responses();
    shape_ = basis_.project(responses_);
    for (Eigen::Index j = 0; j < n; ++j)
        if (!(shape_(j, j) > 0))
            fail(
                "surface registration: column {} of the force basis moves nothing, expected free "
                "nodes: are its {} nodes fixed?",
                j, basis_.column(static_cast<std::size_t>(j)).nodes.size());
    shape_ = (shape_ + shape_.transpose()).eval() / 2;
    prior_ = Eigen::MatrixXd::Zero(all, all);
    if (options_.prior_energy_J) set_energy(*options_.prior_energy_J);
    if (!seeks_pose()) return;
    prior_.diagonal().segment<3>(n).setConstant(1 / (options.pose_error_m * options.pose_error_m));
    prior_.diagonal().tail<3>().setConstant(1 / (options.pose_error_rad * options.pose_error_rad));
}

void SurfaceRegistration::set_energy(double energy_J) {
    weight_.energy = energy_J;
    prior_.topLeftCorner(forces_count(), forces_count()) = shape_ / energy_J;
}

PointPose SurfaceRegistration::pose_at(const Eigen::VectorXd& q) const {
    if (!seeks_pose()) return {};
    return {centre_, q.segment<3>(forces_count()), q.tail<3>()};
}

void SurfaceRegistration::find_responses() {
    const LinearReport report =
        body_.responses(basis_.matrix(rest_.size()), options_.linear_tolerance, responses_);
    if (!report.converged)
        fail("surface registration: the responses to forces ended with {} after {} iterations",
             report.reason, report.iterations);
    is_fresh_ = true;
}

std::vector<Vector3> SurfaceRegistration::moved(double length, const Step& step) const {
    std::vector<Vector3> u = u_;
    for (std::size_t n = 0; n < u.size(); ++n)
        u[n] += length * step.du.segment<3>(3 * static_cast<Eigen::Index>(n));
    return u;
}

SurfaceRegistration::Fitted SurfaceRegistration::at(const Eigen::VectorXd& q,
                                                    std::span<const Vector3> u,
                                                    std::optional<double> scale) const {
    Fitted fitted{.matches = {}, .offsets = {}, .pose = pose_at(q)};
    std::vector<Vector3> x = rest_, c = points_;
    for (std::size_t n = 0; n < x.size(); ++n) x[n] += u[n];
    for (Vector3& point : c) point = fitted.pose * point;
    const SurfaceMisfit misfit(surface_, c);
    fitted.matches =
        scale ? misfit.match(x, *scale) : misfit.match_from_afar(x, options_.point_error_m);
    fitted.value = fitted.matches.value / sharing_;
    fitted.landmark_scale =
        options_.landmark_error_m * fitted.matches.scale / options_.point_error_m;
    for (const Landmark& l : landmarks_) {
        fitted.offsets.push_back(l.place.of(x) - fitted.pose * l.measured);
        fitted.value += fitted.offsets.back().squaredNorm() /
                        (2 * fitted.landmark_scale * fitted.landmark_scale);
    }
    return fitted;
}

Eigen::MatrixXd SurfaceRegistration::rows(const Fitted& fitted) const {
    const Eigen::Index points = std::ssize(fitted.matches.points);
    Eigen::MatrixXd rows =
        Eigen::MatrixXd::Zero(points + 3 * std::ssize(fitted.offsets), q_.size());
    for (Eigen::Index i = 0; i < points; ++i) {
        const SurfaceMatch& m = fitted.matches.points[static_cast<std::size_t>(i)];
        const double factor = std::sqrt(m.confidence / sharing_) / fitted.matches.scale;
        for (int k = 0; k < 3; ++k)
            rows.row(i).head(forces_count()) += factor * m.weights[k] * m.direction.transpose() *
                                                responses_.middleRows<3>(3 * m.nodes[k]);
        if (seeks_pose())
            rows.row(i).tail<pose_size>() =
                -factor * m.direction.transpose() *
                fitted.pose.derivative(points_[static_cast<std::size_t>(i)]);
    }
    for (std::size_t l = 0; l < landmarks_.size(); ++l) {
        auto block = rows.middleRows<3>(points + 3 * static_cast<Eigen::Index>(l));
        block.leftCols(forces_count()) =
            landmarks_[l].place.rows_of(responses_) / fitted.landmark_scale;
        if (seeks_pose())
            block.rightCols<pose_size>() =
                -fitted.pose.derivative(landmarks_[l].measured) / fitted.landmark_scale;
    }
    return rows;
}

namespace {

/// d J / d m of the misfits: the same sum as rows^T r, without the responses.
Eigen::Matrix<double, pose_size, 1> pose_gradient(const SurfaceMatches& matches,
                                                  std::span<const Vector3> points,
                                                  std::span<const Landmark> landmarks,
                                                  std::span<const Vector3> offsets,
                                                  const PointPose& pose, double landmark_scale,
                                                  double sharing) {
    Eigen::Matrix<double, pose_size, 1> gradient = Eigen::Matrix<double, pose_size, 1>::Zero();
    for (std::size_t i = 0; i < points.size(); ++i) {
        const SurfaceMatch& m = matches.points[i];
        gradient += m.confidence * m.distance / (matches.scale * matches.scale * sharing) *
                    pose.derivative(points[i]).transpose() * m.direction;
    }
    for (std::size_t l = 0; l < landmarks.size(); ++l)
        gradient -= pose.derivative(landmarks[l].measured).transpose() * offsets[l] /
                    (landmark_scale * landmark_scale);
    return gradient;
}

}  // namespace

LinearMisfit SurfaceRegistration::linear_misfit(const Fitted& fitted) const {
    const Eigen::MatrixXd g = rows(fitted);
    Eigen::VectorXd y = g * q_;
    const Eigen::Index points = std::ssize(fitted.matches.points);
    for (Eigen::Index i = 0; i < points; ++i) {
        const SurfaceMatch& m = fitted.matches.points[static_cast<std::size_t>(i)];
        y[i] += std::sqrt(m.confidence / sharing_) / fitted.matches.scale * m.distance;
    }
    for (std::size_t l = 0; l < fitted.offsets.size(); ++l)
        y.segment<3>(points + 3 * static_cast<Eigen::Index>(l)) -=
            fitted.offsets[l] / fitted.landmark_scale;
    return {g.transpose() * g, g.transpose() * y, y.squaredNorm()};
}

void SurfaceRegistration::start_energy(const Fitted& fitted) {
    constexpr double motion_share = 0.02;  // of the diagonal: of the seen surface, by the prior
    set_energy(1);
    const Eigen::Index n = forces_count();
    const Eigen::MatrixXd g = rows(fitted).leftCols(n);
    // Mean square motion of the surface along the misfits for E0 = 1, in units of the errors; in m.
    const double s2 = fitted.matches.scale * fitted.matches.scale * sharing_;
    const double mean =
        s2 * shape_.ldlt().solve(g.transpose() * g).trace() / static_cast<double>(points_.size());
    const double motion = motion_share * diagonal_;
    set_energy(motion * motion / mean);
}

bool SurfaceRegistration::choose_energy(const Fitted& fitted) {
    constexpr double max_factor = 4;       // an iteration
    constexpr double least_change = 1.15;  // below, E0 is kept: J stays one function
    if (weight_.energy == 0) start_energy(fitted);
    const Eigen::Index poses = q_.size() - forces_count();
    const PriorEvidence evidence(linear_misfit(fitted), shape_,
                                 prior_.bottomRightCorner(poses, poses));
    const double old = weight_.energy;
    weight_ = evidence.best();
    weight_.energy = std::clamp(weight_.energy, old / max_factor, old * max_factor);
    const double change = weight_.energy / old;
    const bool is_kept = change < least_change && change > 1 / least_change;
    set_energy(is_kept ? old : weight_.energy);
    return !is_kept;
}

Eigen::VectorXd SurfaceRegistration::force_gradient(std::span<const Vector3> by_u) const {
    if (!is_fresh_) return adjoint_gradient(body_, basis_, by_u, options_.linear_tolerance);
    return responses_.transpose() *
           Eigen::Map<const Eigen::VectorXd>(by_u.front().data(), responses_.rows());
}

Eigen::VectorXd SurfaceRegistration::increment(const Eigen::MatrixXd& hessian,
                                               const Eigen::VectorXd& gradient) const {
    if (whole_left_ == 0) return -hessian.ldlt().solve(gradient);
    const Eigen::MatrixXd whole = basis_.of_whole_zones();
    const Eigen::Index poses = q_.size() - forces_count();
    Eigen::MatrixXd z = Eigen::MatrixXd::Zero(q_.size(), whole.cols() + poses);
    z.topLeftCorner(whole.rows(), whole.cols()) = whole;
    z.bottomRightCorner(poses, poses).setIdentity();
    return -z * (z.transpose() * hessian * z).ldlt().solve(z.transpose() * gradient);
}

SurfaceRegistration::Step SurfaceRegistration::next_step(const Fitted& fitted) {
    const double l2 = fitted.landmark_scale * fitted.landmark_scale;
    std::vector<Vector3> by_u = misfit_gradient(fitted.matches, rest_.size());
    for (Vector3& g : by_u) g /= sharing_;
    for (std::size_t l = 0; l < landmarks_.size(); ++l) {
        const BodyPlace& place = landmarks_[l].place;
        for (std::size_t k = 0; k < place.nodes.size(); ++k)
            by_u[place.nodes[k]] += place.weights[k] / l2 * fitted.offsets[l];
    }
    Eigen::VectorXd gradient = prior_ * q_;
    gradient.head(forces_count()) += force_gradient(by_u);
    if (seeks_pose())
        gradient.tail<pose_size>() +=
            pose_gradient(fitted.matches, points_, landmarks_, fitted.offsets, fitted.pose,
                          fitted.landmark_scale, sharing_);
    const Eigen::MatrixXd g = rows(fitted);
    const Eigen::MatrixXd hessian = g.transpose() * g + prior_;
    Step step;
    step.dq = increment(hessian, gradient);
    step.du = responses_ * step.dq.head(forces_count());
    for (Eigen::Index n = 0; n < step.du.size(); n += 3)
        step.size = std::max(step.size, step.du.segment<3>(n).norm());
    if (seeks_pose())
        for (const Vector3& c : points_)
            step.size =
                std::max(step.size, (fitted.pose.derivative(c) * step.dq.tail<pose_size>()).norm());
    step.gradient = gradient.norm();
    step.slope = gradient.dot(step.dq);
    return step;
}

bool SurfaceRegistration::take(const Fitted& before, Step& step,
                               SurfaceRegistrationReport& report) {
    constexpr int max_halvings = 5;
    constexpr int max_newton = 4;  // with new tangents: else the step is too long
    const int chords = body_.linear_solver().kind() == SolverKind::direct ? 3 : 0;
    const double old = before.value + prior(q_);
    body_.keep_state();  // with its pressures, which set_displacement drops
    step.taken = std::min(1.0, reach_ / step.size);
    for (int h = 0; h <= max_halvings; ++h, step.taken /= 2) {
        const Eigen::VectorXd q = q_ + step.taken * step.dq;
        body_.set_external_force(basis_.force(q.head(forces_count()), rest_.size()));
        body_.set_displacement(moved(step.taken, step));
        const StepReport solve = body_.solve(0, {.max_newton = max_newton + chords,
                                                 .tolerance = options_.equilibrium_tolerance,
                                                 .old_tangents = chords});
        report.newton_iterations += solve.newton_iterations;
        if (!solve.converged) continue;
        std::vector<Vector3> u = body_.displacement();
        const double now = at(q, u, before.matches.scale).value + prior(q);
        if (!(now < old)) continue;
        const double predicted = -step.slope * step.taken * (1 - step.taken / 2);
        step.fell_short = old - now < predicted / 2 || solve.newton_iterations > 1;
        q_ = q;
        u_ = std::move(u);
        is_fresh_ = false;
        reach_ = h > 0 ? step.taken * step.size : std::min(2 * reach_, max_share * diagonal_);
        return true;
    }
    reach_ = step.taken * step.size;
    body_.set_external_force(forces());
    body_.return_to_kept_state();
    return false;
}

namespace {

constexpr double outlier_scales = 3;  // beyond, rho takes a point rather for an outlier

/// The distance that this share of the points is within, m.
double distance_quantile(const SurfaceMatches& matches, double share) {
    std::vector<double> distances;
    for (const SurfaceMatch& m : matches.points) distances.push_back(std::abs(m.distance));
    const auto place = distances.begin() +
                       static_cast<std::ptrdiff_t>(share * static_cast<double>(distances.size()));
    std::nth_element(distances.begin(), place, distances.end());
    return *place;
}

}  // namespace

void SurfaceRegistration::check_distance(const Fitted& start) const {
    const double median = start.matches.scale / 1.5;  // where that is more than the error
    if (median > diagonal_ / 2)
        fail(
            "surface points: found a median distance of {:.0f} mm from the surface, expected less "
            "than {:.0f} mm, half of the body's diagonal: unit and frame must be the mesh's",
            1e3 * median, 1e3 * diagonal_ / 2);
}

SurfaceRegistration::Fitted SurfaceRegistration::annealed(double scale) const {
    constexpr double factor = 0.7;
    Fitted fitted = at(q_, u_, {});
    return fitted.matches.scale < factor * scale ? at(q_, u_, factor * scale) : fitted;
}

void SurfaceRegistration::finish(const Fitted& fitted, SurfaceRegistrationReport& report) const {
    const SurfaceMatches& matches = fitted.matches;
    report.rms_m = matches.rms;
    report.scale_m = matches.scale;
    report.outliers = static_cast<std::size_t>(
        std::count_if(matches.points.begin(), matches.points.end(),
                      [](const SurfaceMatch& m) { return m.confidence < 0.25; }));
    report.median_m = distance_quantile(matches, 0.5);
    double squares = 0;
    for (const Vector3& offset : fitted.offsets) {
        report.landmarks_m.push_back(offset.norm());
        squares += offset.squaredNorm() / static_cast<double>(fitted.offsets.size());
    }
    report.landmark_rms_m = std::sqrt(squares);
    report.total_force_N = basis_.total(coefficients());
    report.prior = weight_;
    report.sharing_points = sharing_;
}

namespace {

/// Mean over the points of sum_j exp(-|c_i - c_j|^2 / (2 l^2)); 1 for l = 0. Of many points, every
/// n-th stands for the mean.
double sharing_points(std::span<const Vector3> points, double length) {
    constexpr std::size_t max_means = 1000;
    if (length == 0) return 1;
    const std::size_t stride = 1 + (points.size() - 1) / max_means;
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < points.size(); i += stride, ++count)
        for (const Vector3& c : points)
            sum += std::exp(-(points[i] - c).squaredNorm() / (2 * length * length));
    return sum / count;
}

/// How far a fit still moves, by the sizes of its steps: full steps fall off geometrically, so that
/// the sum of all that are left is known.
class MotionLeft {
  public:
    /// After a step of this size, m, the next of the same function.
    double after(double size, bool is_full) {
        const double rate = is_full && last_ > 0 ? size / last_ : 1;
        last_ = is_full ? size : 0;
        return size * (rate < 0.5 ? rate / (1 - rate) : 1);
    }
    /// The function changed, or no step was taken: the next step's size tells nothing of the rate.
    void forget() { last_ = 0; }

  private:
    double last_ = 0;  ///< size of the step before, m; 0: not known
};

}  // namespace

SurfaceRegistration::Fitted SurfaceRegistration::begin(std::span<const Vector3> points,
                                                       std::span<const Landmark> landmarks) {
    points_.assign(points.begin(), points.end());
    landmarks_.assign(landmarks.begin(), landmarks.end());
    if (!has_centre_) {  // the pose's coordinates keep their meaning from frame to frame
        for (const Vector3& c : points_) centre_ += c / static_cast<double>(points_.size());
        has_centre_ = true;
    }
    reach_ = max_share * diagonal_;
    const double shared = std::min(1.0, max_shared_m / options_.point_error_m);
    sharing_ = 1 + shared * shared * (sharing_points(points_, options_.shared_error_m) - 1);
    Fitted start = at(q_, u_, {});
    check_distance(start);
    const double far = distance_quantile(start.matches, 0.95);
    return far > outlier_scales * start.matches.scale ? at(q_, u_, far) : start;
}

bool SurfaceRegistration::is_within_spread(const Step& step) const {
    const double share = options_.spread_share;
    return -step.slope < share * share * static_cast<double>(q_.size());
}

SurfaceRegistrationReport SurfaceRegistration::fit(std::span<const Vector3> points,
                                                   std::span<const Landmark> landmarks,
                                                   std::optional<int> max_iterations) {
    constexpr Eigen::Index few_columns = 30;  // one by one as cheap as two Newton iterations
    constexpr int max_choices = 25;           // of E0: then it stays, so that J has a minimum
    constexpr double coarsely = 4;            // tolerances: whole zones need no more
    // A factorisation takes all columns at once.
    const bool always_renews =
        forces_count() <= few_columns || body_.linear_solver().kind() == SolverKind::direct;
    const int allowed = max_iterations.value_or(options_.max_iterations);
    SurfaceRegistrationReport report;
    report.reason = "the iterations allowed are used up";
    Fitted fitted = begin(points, landmarks);
    report.rms_before_m = fitted.matches.rms;
    bool renew = false;
    MotionLeft motion;
    while (report.iterations < allowed) {
        if (!is_fresh_) body_.linearise();
        if (!is_fresh_ && (renew || always_renews)) {
            find_responses();
            ++report.renewals;
        }
        const bool changed =
            !options_.prior_energy_J && report.iterations < max_choices && choose_energy(fitted);
        Step step = next_step(fitted);
        ++report.iterations;
        report.gradient = step.gradient;
        const bool took = take(fitted, step, report);
        const double scale = fitted.matches.scale;
        if (took || is_fresh_) fitted = annealed(scale);
        // While s falls, J is another function at each iterate.
        const bool lowered = fitted.matches.scale < 0.9 * scale, is_same = !changed && !lowered;
        // A cut step is no sign of an optimum.
        const double left = took ? motion.after(step.size, step.taken == 1) : step.size;
        if (!took || !is_same) motion.forget();
        if (options_.progress)
            options_.progress(
                static_cast<double>(report.iterations) / allowed,
                fmt::format("iteration {}: {:.2f} mm RMS, last step {:.2f} mm", report.iterations,
                            1e3 * fitted.matches.rms, 1e3 * step.taken * step.size));
        if (whole_left_ > 0) {
            const bool is_near = is_same && step.size < coarsely * options_.tolerance_m;
            whole_left_ = took && !is_near ? whole_left_ - 1 : 0;
            motion.forget();
            renew = true;
            continue;
        }
        const bool is_at_end = left < options_.tolerance_m, is_within = is_within_spread(step);
        report.converged = (took || is_fresh_) && is_same && (is_at_end || is_within);
        if (report.converged) {
            report.reason = is_at_end ? "no node moves farther than the tolerance"
                                      : "what is left is small to the spread";
            break;
        }
        if (!took && is_fresh_ && !lowered) {
            report.reason = "no step along the Gauss-Newton direction lowers the misfit";
            break;
        }
        renew = !took || step.taken < 1 || step.fell_short;
    }
    finish(fitted, report);
    return report;
}

SurfacePosterior SurfaceRegistration::posterior() {
    if (points_.empty()) fail("surface registration: found no fit, expected one before posterior");
    if (!is_fresh_) {
        body_.linearise();
        find_responses();
    }
    const Eigen::MatrixXd g = rows(at(q_, u_, {}));
    SurfacePosterior posterior;
    posterior.covariance = inverse_of(g.transpose() * g + prior_);
    const Eigen::MatrixXd alone = inverse_of(prior_);
    const Eigen::Index n = forces_count();
    posterior.force_ratio =
        (posterior.covariance.diagonal().head(n).array() / alone.diagonal().head(n).array()).sqrt();
    posterior.direction_ratio =
        spread_ratios(posterior.covariance.topLeftCorner(n, n), alone.topLeftCorner(n, n));
    if (seeks_pose())
        posterior.pose_ratio =
            spread_ratios(posterior.covariance.bottomRightCorner<pose_size, pose_size>(),
                          alone.bottomRightCorner<pose_size, pose_size>());
    return posterior;
}

Eigen::MatrixXd SurfaceRegistration::place_rows(const BodyPlace& place) const {
    Eigen::MatrixXd rows(3, q_.size());
    rows.leftCols(forces_count()) = place.rows_of(responses_);
    if (!seeks_pose()) return rows;
    const PointPose t = pose();
    const Vector3 c = t.inverse(place.of(rest_) + place.of(u_));
    rows.rightCols<pose_size>() = -t.derivative(c);
    return rows;
}

}  // namespace livetet
