// A clamped beam bends under its own weight.
//
// Solves -div sigma(u) = rho g with u = 0 at x = 0: linear elasticity on ten-node tetrahedra,
// multigrid on two meshes. The deflection of the tip is compared with Timoshenko's beam of length
// L, section h x h:
//     w = q L^4 / (8 E I) + q L^2 / (2 kappa G A),  q = rho g h^2, I = h^4 / 12, kappa = 5/6.
//
// Sample runs:  static_beam
//               static_beam -ksp_monitor
//               mpirun -n 2 static_beam
#include <fmt/format.h>

#include <cmath>

#include "livetet/mechanics/gravity_load.hpp"
#include "livetet/mesh/node_selection.hpp"
#include "livetet/mesh/quadratic.hpp"
#include "livetet/mesh/shapes.hpp"
#include "livetet/solvers/nonlinear/deformable_body.hpp"
#include "livetet/solvers/parallel/partition.hpp"
#include "livetet/solvers/parallel/petsc_session.hpp"

using namespace livetet;

int main(int argc, char** argv) try {
    // 1. MPI and PETSc, which takes the options of the command line.
    const PetscSession session(argv[0], {argv + 1, argv + argc});

    // 2. A beam of 200 x 20 x 20 mm: ten-node tets, and the same tets with four nodes below them.
    const double length = 0.2, height = 0.02;
    const MeshHierarchy hierarchy = with_quadratic_level(
        make_hierarchy({shapes::box({length, height, height}, {20, 2, 2})}, "beam"));
    const TetMesh& mesh = hierarchy.levels.front();

    // 3. Cork does not thicken where it is pressed, so that the clamp adds nothing to the formula;
    // each rank takes a part of the tets.
    const std::vector<Material> cork{{.young_Pa = 2e7, .poisson = 0, .density_kg_per_m3 = 200}};
    const auto parts = partition_levels(PETSC_COMM_WORLD, hierarchy, Partitioner::metis);
    DeformableBody body({PETSC_COMM_WORLD, hierarchy, parts}, {cork, "linear"}, TimeOptions{},
                        SolverOptions{});

    // 4. Clamped at x = 0; gravity along -z. A body takes arrays of the nodes that its rank has.
    const double g = 9.81;
    const PartitionedMesh& share = body.linear_solver().fine().share();
    const TetMesh part = local_mesh(share);
    Constraints constraints(part.nodes.size());
    constraints.prescribe(nodes_in_half_space(part, {0, 0, 0}, {1, 0, 0}), Vector3::Zero());
    body.set_constraints(constraints);
    body.set_external_force(gravity_load(part, cork, {0, 0, -g}));

    // 5. The static solve: the time step of 0 s is not used.
    const StepReport report = body.solve(0, {.linear_tolerance = 1e-8});

    // 6. Mean deflection of the end face.
    const auto displacement = whole_values(share, body.displacement());
    const auto tip = nodes_in_half_space(mesh, {length, 0, 0}, {-1, 0, 0});
    double deflection = 0;
    for (const std::int32_t n : tip) deflection -= displacement[n].z() / std::ssize(tip);

    // 7. The formula.
    const double E = cork[0].young_Pa, G = cork[0].mu(), A = height * height, I = A * A / 12;
    const double q = cork[0].density_kg_per_m3 * g * A;
    const double expected =
        q * std::pow(length, 4) / (8 * E * I) + q * length * length / (2 * 5. / 6 * G * A);
    const double error = deflection / expected - 1;
    if (session.rank() == 0) {
        fmt::print(
            "{} nodes, {} iterations: tip deflection {:.4f} mm, beam formula {:.4f} mm ({:+.2f} "
            "%)\n",
            mesh.nodes.size(), report.iterations, 1e3 * deflection, 1e3 * expected, 1e2 * error);
    }
    return report.converged && std::abs(error) < 2e-3 ? 0 : 1;
} catch (const std::exception& error) {
    fmt::print(stderr, "static_beam: {}\n", error.what());
    return 2;
}
