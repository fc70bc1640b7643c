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

void carry_state(DeformableBody& from, DeformableBody& to,
                 std::span<const std::int32_t> originals) {
    BodySnapshot state = from.gather_state();
    if (state.nodal.size() > end_forces) {
        const std::span<const double> mass = from.node_mass();
        std::vector<double> inverse;
        for (const double m : mass) inverse.push_back(1 / m);
        scale_by_node(state.nodal[end_forces], inverse);
    }
    for (std::vector<double>& values : state.nodal)
        for (const std::int32_t n : originals)
            for (int c = 0; c < 3; ++c)
                values.push_back(double{values[3 * static_cast<std::size_t>(n) + c]});
    state.node_count += originals.size();
    if (state.nodal.size() > end_forces) scale_by_node(state.nodal[end_forces], to.node_mass());
    to.set_state(state);
}

}  // namespace livetet
