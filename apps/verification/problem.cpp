#include "apps/verification/problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "base/stopwatch.hpp"
#include "geometry/triangle_area.hpp"
#include "mechanics/mapped_hexahedron.hpp"
#include "mesh/quadratic_faces.hpp"

namespace livetet::verification {

namespace {

SolverOptions with_defaults(SolverOptions solver, std::size_t levels) {
    if (solver.kind == SolverKind::automatic)
        solver.kind = levels > 1 ? SolverKind::multigrid : SolverKind::direct;
    return solver;
}

std::uint8_t bits(const std::string& components) {
    std::uint8_t b = 0;
    for (const char c : components) b |= 1 << (c - 'x');
    return b;
}

/// Gauss's four points in [0, 1], exact to degree 7.
constexpr double outer = 0.861136311594052575, inner = 0.339981043584856265,
                 of_outer = 0.347854845137453857, of_inner = 1 - of_outer;
constexpr double gauss_places[4] = {(1 - outer) / 2, (1 - inner) / 2, (1 + inner) / 2,
                                    (1 + outer) / 2},
                 gauss_weights[4] = {of_outer / 2, of_inner / 2, of_inner / 2, of_outer / 2};

/// Visits points of a quadrature on the reference tet, exact to degree 7: Gauss points of the cube
/// collapsed onto it.
template <class Visit>
void visit_quadrature(Visit&& visit) {
    const auto& points = gauss_places;
    const auto& weights = gauss_weights;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
            for (int k = 0; k < 4; ++k) {
                const double x = points[i], y = points[j] * (1 - x),
                             z = points[k] * (1 - x) * (1 - points[j]);
                // Share of the volume: six times the Jacobian.
                visit(
                    Eigen::Vector4d(1 - x - y - z, x, y, z),
                    6 * weights[i] * weights[j] * weights[k] * (1 - x) * (1 - x) * (1 - points[j]));
            }
}

/// visit(place, its volume, the element's nodes, their shape functions) at points of a quadrature
/// of degree 7 in each element.
template <class Visit>
void visit_tets(const TetMesh& mesh, Visit&& visit) {
    const bool quadratic = !mesh.edge_nodes.empty();
    for (std::size_t e = 0; e < mesh.tets.size(); ++e) {
        const Tet& t = mesh.tets[e];
        const double volume = signed_volume(mesh, t);
        std::vector<std::int32_t> nodes(t.begin(), t.end());
        if (quadratic)
            nodes.insert(nodes.end(), mesh.edge_nodes[e].begin(), mesh.edge_nodes[e].end());
        std::vector<double> values(nodes.size());
        visit_quadrature([&](const Eigen::Vector4d& L, double share) {
            Vector3 x = Vector3::Zero();
            for (int i = 0; i < 4; ++i) {
                x += L[i] * mesh.nodes[t[i]];
                values[i] = quadratic ? L[i] * (2 * L[i] - 1) : L[i];
            }
            for (int k = 0; quadratic && k < 6; ++k)
                values[4 + k] = 4 * L[tet_edges[k][0]] * L[tet_edges[k][1]];
            visit(x, volume * share, nodes, values);
        });
    }
}

template <class Visit>
void visit_hexahedra(const TetMesh& mesh, Visit&& visit) {
    std::vector<double> values(27);
    for (std::size_t e = 0; e < mesh.quadratic_hexahedra.size(); ++e) {
        const auto& cell = mesh.quadratic_hexahedra[e];
        const std::vector<std::int32_t> nodes(cell.begin(), cell.end());
        const MappedHexahedron element = mapped_hexahedron(mesh, e);
        for (int p = 0; p < 64; ++p) {
            const Vector3 xi(gauss_places[p % 4], gauss_places[p / 4 % 4], gauss_places[p / 16]);
            const auto shape = quadratic_shape(xi);
            const Eigen::Matrix3d J = element.x * quadratic_slopes(xi).transpose();
            std::copy(shape.begin(), shape.end(), values.begin());
            visit(Vector3(element.x * shape),
                  gauss_weights[p % 4] * gauss_weights[p / 4 % 4] * gauss_weights[p / 16] *
                      J.determinant(),
                  nodes, values);
        }
    }
}

template <class Visit>
void visit_elements(const TetMesh& mesh, Visit&& visit) {
    if (mesh.quadratic_hexahedra.empty())
        visit_tets(mesh, visit);
    else
        visit_hexahedra(mesh, visit);
}

}  // namespace

std::string Discretisation::name() const {
    return fmt::format("{} {}{}", strain.name(),
                       hexahedral  ? "Q2"
                       : quadratic ? "P2"
                                   : "P1",
                       formulation == Formulation::mixed ? " mixed" : "");
}

std::string nodes_text(std::size_t nodes) {
    return nodes < 1000 ? fmt::format("{} nodes", nodes)
                        : fmt::format("{},{:03} nodes", nodes / 1000, nodes % 1000);
}

Problem::Problem(std::vector<TetMesh> levels, const Isotropic& m, const Discretisation& d,
                 const TimeOptions& time, SolverOptions solver)
    : hierarchy_(make_hierarchy(std::move(levels), "verification")),
      materials_{material(m)},
      constraints_(0) {
    if (d.quadratic && !d.hexahedral) hierarchy_ = with_quadratic_level(std::move(hierarchy_));
    const std::size_t own_levels =
        hierarchy_.levels.size() - (d.quadratic && !d.hexahedral ? 1 : 0);
    body_ = std::make_unique<DeformableBody>(DistributedHierarchy{PETSC_COMM_SELF, hierarchy_},
                                             ElasticModel{materials_, d.strain, d.formulation},
                                             time, with_defaults(solver, own_levels));
    constraints_ = Constraints(mesh().nodes.size());
    force_.assign(mesh().nodes.size(), Vector3::Zero());
}

void Problem::hold(const std::string& set, const std::string& components, const Vector3& value) {
    constraints_.prescribe(mesh().node_sets.at(set), value, bits(components));
}

void Problem::prescribe(const std::function<bool(const Vector3&)>& chosen,
                        const std::function<Vector3(const Vector3&)>& value,
                        const std::string& components) {
    for (std::size_t n = 0; n < mesh().nodes.size(); ++n)
        if (const auto node = static_cast<std::int32_t>(n); chosen(mesh().nodes[n]))
            constraints_.prescribe(std::span(&node, 1), value(mesh().nodes[n]), bits(components));
}

void Problem::prescribe_surface(const std::function<Vector3(const Vector3&)>& value) {
    for (const std::int32_t n : surface_nodes(mesh()))
        constraints_.prescribe(std::span(&n, 1), value(mesh().nodes[n]));
}

void Problem::traction(const std::string& set,
                       const std::function<Vector3(const Vector3&, const Vector3&)>& value) {
    // At the middles of edges with a third of the area each: exact to degree 2. On P2 those are the
    // edge nodes, and the corner's shape functions vanish there.
    const EdgeNodes edges(mesh());
    const std::vector<Triangle>& triangles = mesh().triangle_sets.at(set);
    if (!mesh().quadratic_hexahedra.empty()) {
        const QuadraticFaces faces(mesh(), triangles);
        for (const Triangle& t : triangles)
            for (const FacePoint& p : faces.points(mesh(), t))
                for (int i = 0; i < 9; ++i)
                    force_[p.nodes[i]] +=
                        p.shares[i] * p.area.norm() * value(p.place, p.area.normalized());
        return;
    }
    for (const Triangle& t : triangles) {
        const Vector3 area = area_vector(mesh().nodes, t);
        for (int k = 0; k < 3; ++k) {
            const std::int32_t a = t[k], b = t[(k + 1) % 3];
            const Vector3 share =
                value((mesh().nodes[a] + mesh().nodes[b]) / 2, area.normalized()) *
                (area.norm() / 3);
            if (edges.empty()) {
                force_[a] += share / 2;
                force_[b] += share / 2;
            } else {
                force_[edges.between(a, b)] += share;
            }
        }
    }
}

void Problem::body_force(const std::function<Vector3(const Vector3&)>& value) {
    visit_elements(mesh(),
                   [&](const Vector3& x, double volume, const auto& nodes, const auto& shape) {
                       const Vector3 f = volume * value(x);
                       for (std::size_t i = 0; i < nodes.size(); ++i)
                           force_[nodes[i]] += shape[i] * f;
                   });
}

void Problem::apply() {
    body_->set_constraints(constraints_);
    body_->set_external_force(force_);
}

void Problem::solve(int load_steps, double tolerance) {
    Constraints constraints = constraints_;
    std::vector<Vector3> force = force_;
    for (int step = 1; step <= load_steps; ++step) {
        const double share = static_cast<double>(step) / load_steps;
        for (std::size_t n = 0; n < force.size(); ++n) {
            constraints.values[n] = share * constraints_.values[n];
            force[n] = share * force_[n];
        }
        body_->set_constraints(constraints);
        body_->set_external_force(force);
        const StepReport report =
            body_->solve(0, {.max_newton = 100, .tolerance = tolerance, .linear_tolerance = 1e-4});
        if (!report.converged)
            throw std::runtime_error(
                fmt::format("no equilibrium at step {} of {}: imbalance {:.1e} after {} "
                            "linearisations",
                            step, load_steps, report.imbalance, report.newton_iterations));
    }
    u_ = body_->displacement();
}

std::int32_t Problem::node_at(const Vector3& x) const {
    std::size_t nearest = 0;
    for (std::size_t n = 1; n < mesh().nodes.size(); ++n)
        if ((mesh().nodes[n] - x).squaredNorm() < (mesh().nodes[nearest] - x).squaredNorm())
            nearest = n;
    return static_cast<std::int32_t>(nearest);
}

double Problem::l2_error(const std::function<Vector3(const Vector3&)>& exact) const {
    double difference = 0, size = 0;
    visit_elements(mesh(),
                   [&](const Vector3& x, double volume, const auto& nodes, const auto& shape) {
                       Vector3 u = Vector3::Zero();
                       for (std::size_t i = 0; i < nodes.size(); ++i) u += shape[i] * u_[nodes[i]];
                       difference += volume * (u - exact(x)).squaredNorm();
                       size += volume * exact(x).squaredNorm();
                   });
    return std::sqrt(difference / size);
}

double Problem::seconds() const { return seconds_since(start_); }

}  // namespace livetet::verification
