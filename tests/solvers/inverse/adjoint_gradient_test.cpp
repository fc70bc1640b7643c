// The adjoint's gradient against finite differences of whole nonlinear solves, in every model.

#include "solvers/inverse/adjoint_gradient.hpp"

#include <gtest/gtest.h>

#include "solvers/inverse/block_fixture.hpp"
#include "solvers/inverse/surface_misfit.hpp"

namespace livetet {
namespace {

void expect_finite_differences(test::PulledBlock& block) {
    const std::size_t nodes = block.mesh().nodes.size();
    const ForceBasis basis = smooth_forces(block.mesh().nodes, block.zone, 3);
    Eigen::VectorXd p(9);
    p << 0.3, -0.1, 0.7, -0.2, 0.1, 0.8, 0.1, 0.2, 0.4;
    const std::vector<Vector3> x = block.equilibrium(basis, p);
    double largest = 0;
    for (std::size_t n = 0; n < nodes; ++n)
        largest = std::max(largest, (x[n] - block.mesh().nodes[n]).norm());
    EXPECT_GT(largest, 0.005);  // beyond small strain

    const SurfaceMisfit misfit(block.surface, block.points_on_top(x, 0.001));
    const double scale = 0.002;
    block.body.linearise();
    const Eigen::VectorXd gradient =
        adjoint_gradient(block.body, basis, misfit_gradient(misfit.match(x, scale), nodes), 1e-10);

    const double h = 1e-3;  // N
    for (Eigen::Index j = 0; j < p.size(); ++j) {
        // Four points: the error is of the order h^4.
        const auto at = [&](double step) {
            const Eigen::VectorXd moved = p + step * Eigen::VectorXd::Unit(p.size(), j);
            return misfit.match(block.equilibrium(basis, moved), scale).value;
        };
        const double difference = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
        EXPECT_NEAR(gradient[j], difference, 1e-6 * gradient.norm()) << "coefficient " << j;
    }
}

class AdjointGradientTest : public testing::TestWithParam<const char*> {};

TEST_P(AdjointGradientTest, AgreesWithFiniteDifferences) {
    test::PulledBlock block(GetParam());
    expect_finite_differences(block);
}

INSTANTIATE_TEST_SUITE_P(Models, AdjointGradientTest,
                         testing::Values("linear", "corotated", "green", "neohookean",
                                         "mooney_rivlin", "holzapfel_gasser_ogden"),
                         [](const auto& info) { return std::string(info.param); });

TEST(AdjointGradient, AgreesWithFiniteDifferencesInTheMixedForm) {
    test::PulledBlock block("neohookean", Formulation::mixed);
    expect_finite_differences(block);
}

TEST(AdjointGradient, IsOfStaticBodies) {
    const test::PulledBlock block("linear");
    DeformableBody body({PETSC_COMM_SELF, block.hierarchy}, {block.materials, "linear"},
                        {.scheme = TimeScheme::newmark}, {.kind = SolverKind::direct});
    EXPECT_THROW(body.linearise(), Error);
}

}  // namespace
}  // namespace livetet
