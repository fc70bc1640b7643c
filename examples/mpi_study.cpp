// How an uncertain material spreads into a force: a study of many small solves, shared among the
// ranks.
//
// A bar of length L and section A is stretched by d, its sides free. For linear elasticity the
// stress is uniaxial, so the force at its end is F = E A d / L exactly; E is drawn from a
// log-normal distribution, and so F is log-normal too, with the same logarithmic deviation.
//
// Sample runs:  mpi_study
//               mpirun -n 4 mpi_study
#include <fmt/format.h>

#include <cmath>
#include <random>

#include "livetet/mesh/node_selection.hpp"
#include "livetet/mesh/shapes.hpp"
#include "livetet/solvers/nonlinear/deformable_body.hpp"
#include "livetet/solvers/parallel/petsc_session.hpp"

using namespace livetet;

namespace {

const double length = 0.1, width = 0.02, stretch = 1e-3;  // m

/// The force that stretches a bar of this material, N. Solved on one rank, without the others.
double end_force(const MeshHierarchy& hierarchy, const Material& material) {
    const TetMesh& mesh = hierarchy.levels.front();
    DeformableBody body({PETSC_COMM_SELF, hierarchy}, {{&material, 1}, "linear"}, TimeOptions{},
                        SolverOptions{});
    const auto end = nodes_in_half_space(mesh, {length, 0, 0}, {-1, 0, 0});
    Constraints constraints(mesh.nodes.size());
    // x = 0 may not move along x; the edges at y = 0 and z = 0 keep it from sliding and turning.
    constraints.prescribe(nodes_in_half_space(mesh, {0, 0, 0}, {1, 0, 0}), Vector3::Zero(), 1);
    constraints.prescribe(nodes_in_half_space(mesh, {0, 0, 0}, {0, 1, 0}), Vector3::Zero(), 2);
    constraints.prescribe(nodes_in_half_space(mesh, {0, 0, 0}, {0, 0, 1}), Vector3::Zero(), 4);
    constraints.prescribe(end, {stretch, 0, 0}, 1);
    body.set_constraints(constraints);
    if (!body.solve(0, {.linear_tolerance = 1e-10}).converged) return std::nan("");
    const auto reactions = body.reactions();
    double force = 0;
    for (const std::int32_t n : end) force += reactions[n].x();
    return force;
}

}  // namespace

int main(int argc, char** argv) try {
    // 1. Every rank has the mesh and draws the same samples; it solves every ranks-th of them.
    const PetscSession session(argv[0], {argv + 1, argv + argc});
    const MeshHierarchy hierarchy =
        make_hierarchy({shapes::box({length, width, width}, {10, 2, 2})}, "bar");
    const int samples = 40;
    const double median = 3000, deviation = 0.3;  // Pa; of ln E
    std::mt19937_64 engine(1);
    std::lognormal_distribution<double> young(std::log(median), deviation);
    double sums[3] = {0, 0, 0};  // ln F, (ln F)^2, samples that are off
    for (int k = 0; k < samples; ++k) {
        const Material material{.young_Pa = young(engine), .poisson = 0.45};
        if (k % session.ranks() != session.rank()) continue;
        const double force = end_force(hierarchy, material);
        const double expected = material.young_Pa * width * width * stretch / length;
        sums[0] += std::log(force);
        sums[1] += std::log(force) * std::log(force);
        sums[2] += !(std::abs(force / expected - 1) < 1e-6);
    }

    // 2. The spread, on every rank.
    MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD);
    const double mean = sums[0] / samples, spread = std::sqrt(sums[1] / samples - mean * mean);
    if (session.rank() == 0)
        fmt::print(
            "{} solves on {} ranks: force {:.3f} mN (geometric mean), ln F deviates by {:.3f}; {} "
            "off\n",
            samples, session.ranks(), 1e3 * std::exp(mean), spread, sums[2]);
    return sums[2] == 0 && std::abs(spread - deviation) < 0.1 ? 0 : 1;
} catch (const std::exception& error) {
    fmt::print(stderr, "mpi_study: {}\n", error.what());
    return 2;
}
