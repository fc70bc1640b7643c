#include "solvers/inverse/surface_registration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "solvers/inverse/adjoint_gradient.hpp"

namespace livetet {

/// An increment of forces and displacement.
struct SurfaceRegistration::Step {
    Eigen::VectorXd dp;
    Eigen::VectorXd du;       ///< m, three numbers a node, to first order
    double size = 0;          ///< of the largest displacement, m
    double taken = 1;         ///< share
    double slope = 0;         ///< of J along dp: negative
    bool fell_short = false;  ///< J, or the imbalance at the predicted state, is not as predicted
    double gradient = 0;      ///< norm
};

namespace {

void check_positive(double value, const char* name) {
    if (!(value > 0 && std::isfinite(value)))
        fail("surface registration: {} = {}, expected more than 0", name, value);
}

/// Rows sqrt(w_i) / s n_i . U at the matched places.
Eigen::MatrixXd distance_rows(const SurfaceMatches& matches, const Eigen::MatrixXd& responses) {
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(std::ssize(matches.points), responses.cols());
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
        const SurfaceMatch& m = matches.points[static_cast<std::size_t>(i)];
        const double factor = std::sqrt(m.confidence) / matches.scale;
        for (int k = 0; k < 3; ++k)
            rows.row(i) += factor * m.weights[k] * m.direction.transpose() *
                           responses.middleRows<3>(3 * m.nodes[k]);
    }
    return rows;
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
      p_(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(basis_.size()))),
      u_(rest.size(), Vector3::Zero()) {
    check_positive(options.point_error_m, "point_error_m");
    check_positive(options.prior_energy_J, "prior_energy_J");
    check_positive(options.tolerance_m, "tolerance_m");
    check_positive(options.equilibrium_tolerance, "equilibrium_tolerance");
    check_positive(options.linear_tolerance, "linear_tolerance");
    check_positive(options.max_iterations, "max_iterations");
    if (basis_.size() == 0) fail("surface registration: found no column in the force basis");
    Eigen::AlignedBox3d box;
    for (const Vector3& x : rest_) box.extend(x);
    diagonal_ = box.diagonal().norm();
    body_.set_displacement(u_);
    body_.linearise();
    find_responses();
    prior_.resize(p_.size(), p_.size());
    std::vector<Vector3> column(rest_.size());
    for (Eigen::Index j = 0; j < p_.size(); ++j) {
        Eigen::Map<Eigen::VectorXd>(column.front().data(), responses_.rows()) = responses_.col(j);
        prior_.col(j) = basis_.project(column) / options_.prior_energy_J;
        if (!(prior_(j, j) > 0))
            fail(
                "surface registration: column {} of the force basis moves nothing, expected free "
                "nodes: are its {} nodes fixed?",
                j, basis_.column(static_cast<std::size_t>(j)).nodes.size());
    }
    prior_ = (prior_ + prior_.transpose()).eval() / 2;
}

void SurfaceRegistration::find_responses() {
    responses_.resize(3 * std::ssize(rest_), p_.size());
    std::vector<Vector3> x;
    for (Eigen::Index j = 0; j < p_.size(); ++j) {
        const std::vector<Vector3> f =
            basis_.force(Eigen::VectorXd::Unit(p_.size(), j), rest_.size());
        const LinearReport report = body_.response(f, options_.linear_tolerance, x);
        if (!report.converged)
            fail(
                "surface registration: the response to column {} ended with {} after {} "
                "iterations",
                j, report.reason, report.iterations);
        responses_.col(j) = Eigen::Map<const Eigen::VectorXd>(x.front().data(), responses_.rows());
    }
    is_fresh_ = true;
}

std::vector<Vector3> SurfaceRegistration::moved(double length, const Step& step) const {
    std::vector<Vector3> u = u_;
    for (std::size_t n = 0; n < u.size(); ++n)
        u[n] += length * step.du.segment<3>(3 * static_cast<Eigen::Index>(n));
    return u;
}

std::vector<Vector3> SurfaceRegistration::positions(std::span<const Vector3> u) const {
    std::vector<Vector3> x = rest_;
    for (std::size_t n = 0; n < x.size(); ++n) x[n] += u[n];
    return x;
}

SurfaceRegistration::Step SurfaceRegistration::next_step(const SurfaceMatches& matches) {
    const Eigen::VectorXd gradient =
        adjoint_gradient(body_, basis_, misfit_gradient(matches, rest_.size()),
                         options_.linear_tolerance) +
        prior_ * p_;
    const Eigen::MatrixXd rows = distance_rows(matches, responses_);
    const Eigen::MatrixXd hessian = rows.transpose() * rows + prior_;
    Step step;
    step.dp = -hessian.ldlt().solve(gradient);
    step.du = responses_ * step.dp;
    for (Eigen::Index n = 0; n < step.du.size(); n += 3)
        step.size = std::max(step.size, step.du.segment<3>(n).norm());
    step.gradient = gradient.norm();
    step.slope = gradient.dot(step.dp);
    return step;
}

bool SurfaceRegistration::take(const SurfaceMisfit& misfit, const SurfaceMatches& before,
                               Step& step, SurfaceRegistrationReport& report) {
    constexpr int max_halvings = 5;
    constexpr double max_share = 0.04;         // of the diagonal: beyond, tets invert
    constexpr double usable_imbalance = 0.02;  // of a forward solve that was not done
    const double old = before.value + prior(p_);
    body_.keep_state();  // with its pressures, which set_displacement drops
    step.taken = std::min(1.0, max_share * diagonal_ / step.size);
    for (int h = 0; h <= max_halvings; ++h, step.taken /= 2) {
        const Eigen::VectorXd p = p_ + step.taken * step.dp;
        body_.set_external_force(basis_.force(p, rest_.size()));
        body_.set_displacement(moved(step.taken, step));
        const StepReport solve =
            body_.solve(0, {.max_newton = 6, .tolerance = options_.equilibrium_tolerance});
        report.newton_iterations += solve.newton_iterations;
        if (!solve.converged && !(solve.imbalance < usable_imbalance)) continue;
        std::vector<Vector3> u = body_.displacement();
        const SurfaceMatches after = misfit.match(positions(u), before.scale);
        const double now = after.value + prior(p);
        if (!(now < old)) continue;
        const double predicted = -step.slope * step.taken * (1 - step.taken / 2);
        step.fell_short = old - now < predicted / 2 || solve.newton_iterations > 1;
        p_ = p;
        u_ = std::move(u);
        is_fresh_ = false;
        return true;
    }
    body_.set_external_force(forces());
    body_.return_to_kept_state();
    return false;
}

void SurfaceRegistration::check_distance(const SurfaceMatches& start) const {
    const double median = start.scale / 1.5;  // where that is more than the error
    if (median > diagonal_ / 2)
        fail(
            "surface points: found a median distance of {:.0f} mm from the surface, expected less "
            "than {:.0f} mm, half of the body's diagonal: unit and frame must be the mesh's",
            1e3 * median, 1e3 * diagonal_ / 2);
}

SurfaceRegistrationReport SurfaceRegistration::fit(std::span<const Vector3> points) {
    constexpr Eigen::Index few_columns = 30;  // as cheap as two Newton iterations
    const SurfaceMisfit misfit(surface_, points);
    SurfaceRegistrationReport report;
    bool renew = false;
    const auto match = [&] {
        return misfit.match_from_afar(positions(u_), options_.point_error_m);
    };
    SurfaceMatches matches = match();
    check_distance(matches);
    report.rms_before_m = matches.rms;
    report.reason = "the iterations allowed are used up";
    while (report.iterations < options_.max_iterations) {
        body_.linearise();
        if (renew || p_.size() <= few_columns) {
            find_responses();
            ++report.renewals;
        }
        Step step = next_step(matches);
        ++report.iterations;
        report.gradient = step.gradient;
        const bool took = take(misfit, matches, step, report);
        if (took) {
            const double scale = matches.scale;
            matches = match();
            // A cut step is no sign of an optimum. While s falls, J is another function at each
            // iterate.
            report.converged = step.size < options_.tolerance_m && matches.scale > 0.9 * scale;
        } else {
            report.converged = is_fresh_ && step.size < options_.tolerance_m;
        }
        if (report.converged) {
            report.reason = "no node moves farther than the tolerance";
            break;
        }
        if (!took && is_fresh_) {
            report.reason = "no step along the Gauss-Newton direction lowers the misfit";
            break;
        }
        renew = !took || step.taken < 1 || step.fell_short;
    }
    report.rms_m = matches.rms;
    report.scale_m = matches.scale;
    report.outliers = static_cast<std::size_t>(
        std::count_if(matches.points.begin(), matches.points.end(),
                      [](const SurfaceMatch& m) { return m.confidence < 0.25; }));
    report.total_force_N = basis_.total(p_);
    return report;
}

}  // namespace livetet
