#include "solvers/nonlinear/doubled_nodes.hpp"

#include <vector>

namespace livetet {

namespace {

/// BodySnapshot::nodal has displacement, velocity, acceleration, and these.
constexpr std::size_t end_forces = 3;

void scale_by_node(std::vector<double>& values, std::span<const double> factors) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] *= factors[i / 3];
}

}  // namespace

void carry_state(DeformableBody& from, DeformableBody& to, const OpenedNodes& nodes) {
    BodySnapshot state = from.gather_state();
    if (state.nodal.size() > end_forces) {
        const std::span<const double> mass = from.node_mass();
        std::vector<double> inverse;
        for (const double m : mass) inverse.push_back(1 / m);
        scale_by_node(state.nodal[end_forces], inverse);
    }
    for (std::vector<double>& values : state.nodal) {
        std::vector<Eigen::Vector3d> vectors;
        for (std::size_t i = 0; i < values.size(); i += 3)
            vectors.emplace_back(values[i], values[i + 1], values[i + 2]);
        carry_values(vectors, nodes);
        values.clear();
        for (const Eigen::Vector3d& v : vectors) values.insert(values.end(), {v[0], v[1], v[2]});
    }
    state.node_count += nodes.originals.size();
    const bool is_grid = !from.linear_solver().fine().share().hexahedra.empty();
    if (is_grid) {
        if (!to.linear_solver().is_mixed()) {  // it eliminates its pressures: see HexSolver
            state.pressure.clear();
            state.pressure_count = 0;
        }
    } else if (!state.pressure.empty()) {
        carry_values(state.pressure, nodes);
        state.pressure_count += nodes.originals.size();
    }
    if (state.nodal.size() > end_forces) scale_by_node(state.nodal[end_forces], to.node_mass());
    to.set_state(state);
    to.learn_from(from);
}

}  // namespace livetet
