#include "apps/simulation/material_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <cmath>

#include "apps/scene/scene_forces.hpp"
#include "base/error.hpp"
#include "solvers/nonlinear/held_force.hpp"

namespace livetet {

namespace {

using Kind = SoughtValue::Kind;

/// The coordinate of a value: any number is possible, and equal steps are equal factors.
double coordinate_of(Kind kind, double value) {
    return kind == Kind::poisson ? std::log(value / (0.5 - value)) : std::log(value);
}

double value_at(Kind kind, double q) {
    return kind == Kind::poisson ? 0.5 / (1 + std::exp(-q)) : std::exp(q);
}

/// The scene with other values.
Scene with_values(const Scene& scene, const std::vector<SoughtValue>& sought,
                  const Eigen::VectorXd& q) {
    Scene changed = scene;
    for (std::size_t j = 0; j < sought.size(); ++j) {
        const double value = value_at(sought[j].kind, q[static_cast<Eigen::Index>(j)]);
        if (sought[j].kind == Kind::young) changed.materials[sought[j].index].young_Pa = value;
        if (sought[j].kind == Kind::poisson) changed.materials[sought[j].index].poisson = value;
        if (sought[j].kind == Kind::support) changed.fix[sought[j].index].stiffness_N_per_m = value;
    }
    return changed;
}

/// A body with its constraints and loads.
struct LoadedBody {
    std::unique_ptr<SceneBody> body;
    std::unique_ptr<SceneConstraints> constraints;

    LoadedBody(const Scene& scene, const MeshHierarchy& hierarchy)
        : body(std::make_unique<SceneBody>(
              make_body(PETSC_COMM_SELF, scene, MeshHierarchy(hierarchy), Use::solve))),
          constraints(std::make_unique<SceneConstraints>(scene, body->mesh())) {
        constraints->move_to_share(1);
        body->body->set_constraints(constraints->constraints());
        body->body->set_springs(constraints->springs());
        body->body->set_external_force(scene_forces(scene, body->mesh()));
    }
    const TetMesh& mesh() const { return body->mesh(); }
    /// f_int - f_springs at u, three numbers a node; at hard constraints without meaning.
    Eigen::VectorXd inner_force(std::span<const Vector3> u) {
        body->body->set_displacement(u);
        const std::vector<Vector3> force = held_force(*body->body);
        return Eigen::Map<const Eigen::VectorXd>(force.front().data(), 3 * std::ssize(force));
    }
};

/// The search; see fit_materials.
class MaterialSearch {
  public:
    MaterialSearch(const Scene& scene, const MeshHierarchy& hierarchy,
                   const std::vector<MeasuredLandmark>& landmarks,
                   const std::vector<SoughtValue>& sought)
        : scene_(scene), hierarchy_(hierarchy), sought_(sought) {
        error_m_ = scene.deform.value_or(DeformOptions{}).landmark_error_mm / 1e3;
        const auto n = static_cast<Eigen::Index>(sought.size());
        start_.resize(n);
        prior_.resize(n);
        for (Eigen::Index j = 0; j < n; ++j) {
            const SoughtValue& s = sought[static_cast<std::size_t>(j)];
            start_[j] = coordinate_of(s.kind, s.start);
            prior_[j] = s.prior;
        }
        std::vector<Vector3> at_rest;
        for (const MeasuredLandmark& l : landmarks) {
            at_rest.push_back(l.at_rest);
            measured_.push_back(l.measured);
        }
        places_ = places_in(hierarchy.levels.front(), at_rest);
    }

    MaterialFit run(const ProgressCallback& progress);

  private:
    /// Offsets of the landmarks from where they were measured, m, one after the other.
    Eigen::VectorXd offsets(const TetMesh& mesh, std::span<const Vector3> u) const {
        Eigen::VectorXd r(3 * std::ssize(places_));
        for (std::size_t l = 0; l < places_.size(); ++l)
            r.segment<3>(3 * static_cast<Eigen::Index>(l)) =
                places_[l].of(mesh.nodes) + places_[l].of(u) - measured_[l];
        return r;
    }
    double objective(const Eigen::VectorXd& r, const Eigen::VectorXd& q) const {
        return (r.squaredNorm() / (error_m_ * error_m_) +
                (q - start_).cwiseQuotient(prior_).squaredNorm()) /
               2;
    }
    Eigen::MatrixXd sensitivities(LoadedBody& body, const Eigen::VectorXd& q,
                                  std::span<const Vector3> u) const;
    bool take_step(const Eigen::VectorXd& step, double objective_now, MaterialFit& fit);
    void state_values(MaterialFit& fit, const Eigen::MatrixXd& information) const;

    const Scene& scene_;
    const MeshHierarchy& hierarchy_;
    const std::vector<SoughtValue>& sought_;
    double error_m_ = 0;
    std::vector<BodyPlace> places_;
    std::vector<Vector3> measured_;
    Eigen::VectorXd start_, prior_;  ///< q_0 and the diagonal of S

    Eigen::VectorXd q_;
    std::unique_ptr<LoadedBody> body_;
    std::vector<Vector3> u_;
};

/// G: change of the landmarks' places by each coordinate, m.
Eigen::MatrixXd MaterialSearch::sensitivities(LoadedBody& body, const Eigen::VectorXd& q,
                                              std::span<const Vector3> u) const {
    constexpr double step = 1e-4;
    Eigen::MatrixXd loads(3 * std::ssize(u), q.size());
    for (Eigen::Index j = 0; j < q.size(); ++j) {
        const auto force_at = [&](double by) {
            const Eigen::VectorXd other = q + by * Eigen::VectorXd::Unit(q.size(), j);
            return LoadedBody(with_values(scene_, sought_, other), hierarchy_).inner_force(u);
        };
        loads.col(j) = -(force_at(step) - force_at(-step)) / (2 * step);
    }
    body.body->body->linearise();
    Eigen::MatrixXd responses;
    const LinearReport report = body.body->body->responses(loads, 1e-8, responses);
    if (!report.converged)
        fail("register --materials: the responses to the values ended with {} after {} iterations",
             report.reason, report.iterations);
    Eigen::MatrixXd rows(3 * std::ssize(places_), q.size());
    for (std::size_t l = 0; l < places_.size(); ++l)
        rows.middleRows<3>(3 * static_cast<Eigen::Index>(l)) = places_[l].rows_of(responses);
    return rows;
}

/// Takes the largest of the step's halves that lowers J. Returns whether there was one.
bool MaterialSearch::take_step(const Eigen::VectorXd& step, double objective_now,
                               MaterialFit& fit) {
    constexpr int max_halvings = 6;
    const SolveControls controls = solve_controls(scene_);
    for (double share = 1; share > std::pow(0.5, max_halvings); share /= 2) {
        const Eigen::VectorXd q = q_ + share * step;
        auto next = std::make_unique<LoadedBody>(with_values(scene_, sought_, q), hierarchy_);
        next->body->body->set_displacement(u_);
        if (!next->body->body->solve(0, controls).converged) continue;
        std::vector<Vector3> u = next->body->body->displacement();
        const Eigen::VectorXd r = offsets(next->mesh(), u);
        if (!(objective(r, q) < objective_now)) continue;
        q_ = q;
        u_ = std::move(u);
        body_ = std::move(next);
        fit.rms_m = std::sqrt(r.squaredNorm() / static_cast<double>(places_.size()));
        return true;
    }
    return false;
}

void MaterialSearch::state_values(MaterialFit& fit, const Eigen::MatrixXd& information) const {
    constexpr double normal_95 = 1.96;
    const double numbers = 3 * static_cast<double>(places_.size());
    const double chi2 =
        fit.rms_m * fit.rms_m * static_cast<double>(places_.size()) / (error_m_ * error_m_);
    const double scale =
        std::max(1.0, chi2 / std::max(1.0, numbers - static_cast<double>(q_.size())));
    const Eigen::MatrixXd prior = prior_.array().square().inverse().matrix().asDiagonal();
    const Eigen::MatrixXd covariance =
        (information / scale + prior).ldlt().solve(Eigen::MatrixXd::Identity(q_.size(), q_.size()));
    for (Eigen::Index j = 0; j < q_.size(); ++j) {
        const SoughtValue& s = sought_[static_cast<std::size_t>(j)];
        const double spread = std::sqrt(covariance(j, j));
        fit.values.push_back({s, value_at(s.kind, q_[j]),
                              value_at(s.kind, q_[j] - normal_95 * spread),
                              value_at(s.kind, q_[j] + normal_95 * spread), spread / prior_[j]});
    }
}

MaterialFit MaterialSearch::run(const ProgressCallback& progress) {
    constexpr int max_iterations = 30;
    constexpr double tolerance = 1e-3, longest_step = 1;  // of a coordinate
    MaterialFit fit;
    q_ = start_;
    body_ = std::make_unique<LoadedBody>(with_values(scene_, sought_, q_), hierarchy_);
    fit.history = run_scene(scene_, *body_->body->body, *body_->constraints,
                            scene_forces(scene_, body_->body->mesh()), {});
    if (!fit.history.converged)
        fail("register --materials: the scene's own solve did not converge: {}",
             fit.history.failure);
    u_ = body_->body->body->displacement();
    Eigen::VectorXd r = offsets(body_->mesh(), u_);
    fit.rms_before_m = fit.rms_m = std::sqrt(r.squaredNorm() / static_cast<double>(places_.size()));
    fit.reason = "the iterations allowed are used up";
    Eigen::MatrixXd information;
    for (bool last = false; !last;) {
        const Eigen::MatrixXd g = sensitivities(*body_, q_, u_) / error_m_;
        information = g.transpose() * g;
        if (fit.converged || fit.iterations == max_iterations) break;
        const Eigen::VectorXd pull = (q_ - start_).array() / prior_.array().square();
        Eigen::MatrixXd hessian = information;
        hessian.diagonal().array() += prior_.array().square().inverse();
        Eigen::VectorXd step = -hessian.ldlt().solve(g.transpose() * r / error_m_ + pull);
        step *= std::min(1.0, longest_step / std::max(step.cwiseAbs().maxCoeff(), 1e-300));
        ++fit.iterations;
        const double size = step.cwiseAbs().maxCoeff();
        const bool took = size >= tolerance && take_step(step, objective(r, q_), fit);
        fit.converged = size < tolerance;
        fit.reason = fit.converged ? "no value changes by more than the tolerance"
                                   : "no step along the Gauss-Newton direction lowers the misfit";
        last = !took;
        if (took) {
            r = offsets(body_->mesh(), u_);
            fit.reason = "the iterations allowed are used up";
        }
        if (progress)
            progress(static_cast<double>(fit.iterations) / max_iterations,
                     fmt::format("iteration {}: {:.2f} mm RMS, last step {:.2g}", fit.iterations,
                                 1e3 * fit.rms_m, size));
    }
    state_values(fit, information);
    fit.scene = with_values(scene_, sought_, q_);
    fit.body = std::move(body_->body);
    return fit;
}

}  // namespace

std::vector<SoughtValue> sought_values(const Scene& scene, bool support) {
    const double factor_of_10 = std::log(10.0);
    std::vector<SoughtValue> sought;
    for (std::size_t i = 0; i < scene.materials.size(); ++i) {
        const Material& m = scene.materials[i];
        if (m.young_Pa.spread > 0)
            sought.push_back({Kind::young, i, fmt::format("materials[{}].young_Pa", i), m.young_Pa,
                              m.young_Pa.spread / m.young_Pa.value});
        if (m.poisson.spread > 0)
            sought.push_back({Kind::poisson, i, fmt::format("materials[{}].poisson", i), m.poisson,
                              m.poisson.spread * 0.5 / (m.poisson * (0.5 - m.poisson))});
    }
    for (std::size_t i = 0; support && i < scene.fix.size(); ++i)
        if (scene.fix[i].stiffness_N_per_m)
            sought.push_back({Kind::support, i, fmt::format("fix[{}].stiffness_N_per_m", i),
                              *scene.fix[i].stiffness_N_per_m, factor_of_10});
    if (sought.empty())
        fail(
            "register --materials: found no value with a spread, expected some that are sought, "
            "such as young_Pa: 3000 +- 2000{}",
            support ? " or a soft fix" : ", or --support");
    for (const SoughtValue& s : sought)
        if (s.kind == Kind::poisson && s.start <= 0)
            fail("{} = {}: is sought, expected more than 0", s.key, s.start);
    return sought;
}

bool FoundValue::is_determined() const {
    constexpr double open_ratio = 0.9;
    return spread_ratio <= open_ratio;
}

MaterialFit fit_materials(const Scene& scene, const MeshHierarchy& hierarchy,
                          const std::vector<MeasuredLandmark>& landmarks,
                          const std::vector<SoughtValue>& sought,
                          const ProgressCallback& progress) {
    if (scene.time.is_dynamic())
        fail("time.scheme: materials are found from an equilibrium, expected time.scheme: static");
    if (resolved_formulation(elastic_model(scene)) == Formulation::mixed)
        fail(
            "register --materials: found the mixed form (a poisson of 0.49 or more, or "
            "formulation), expected displacements alone (formulation: displacement)");
    if (scene.loads.empty() && scene.drive.empty() && scene.gravity_m_per_s2 == Vector3::Zero())
        fail("register --materials: nothing moves the body, expected loads, gravity or drive");
    if (3 * landmarks.size() < sought.size())
        fail("register --materials: found {} landmarks for {} values, expected at least {}",
             landmarks.size(), sought.size(), (sought.size() + 2) / 3);
    Scene of_displacements = scene;  // whatever Poisson's ratios the search comes to
    of_displacements.formulation = Formulation::displacement;
    return MaterialSearch(of_displacements, hierarchy, landmarks, sought).run(progress);
}

}  // namespace livetet
