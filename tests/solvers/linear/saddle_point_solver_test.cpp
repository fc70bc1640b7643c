#include "solvers/linear/saddle_point_solver.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/quadratic.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/petsc_options.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// A nearly incompressible beam, bent, held at x = 0, under forces and with volumes that are off.
class SaddlePoint : public testing::Test {
  protected:
    struct Solution {
        std::unique_ptr<LinearSolver> solver;
        LinearReport report;
        ElementRotations rotations;
        PetscHandle<Vec> u, p, b_u, b_p, x_u, x_p;
        Configuration at() const { return {u.get(), p.get(), &rotations}; }
    };
    /// Held where `x` is at most `held_to`, m.
    Solution solve(const LinearControls& controls, double held_to = 1e-9) const {
        const int ranks = test::rank_count();
        std::vector<std::vector<std::int32_t>> parts;
        for (const TetMesh& level : hierarchy.levels)
            parts.push_back(partition_tets(level.tets, ranks));
        Solution s;
        s.solver = make_linear_solver({PETSC_COMM_WORLD, hierarchy, parts},
                                      {materials, "corotated", Formulation::mixed},
                                      {.kind = SolverKind::multigrid});
        const TetMesh& mesh = hierarchy.levels.front();
        std::vector<std::uint8_t> held;
        std::vector<Vector3> bent, force;
        for (const Vector3& x : mesh.nodes) {
            held.push_back(x.x() <= held_to ? 7 : 0);
            bent.push_back({0, 0, -2 * x.x() * x.x()});
            force.push_back(held.back() ? Vector3::Zero() : Vector3(0.1, 0, -0.2 - x.y()));
        }
        s.solver->set_constrained(local_part<std::uint8_t>(s.solver->fine().share(), held));
        const PartitionedMesh& share = s.solver->fine().share();
        const PressureSpace& space = *s.solver->fine().pressure_space();
        for (PetscHandle<Vec>* v : {&s.u, &s.b_u, &s.x_u}) *v = make_vector(share);
        for (PetscHandle<Vec>* v : {&s.p, &s.b_p, &s.x_p}) *v = make_vector(space);
        test::fill(share, bent, s.u.get());
        update_ghosts(s.u.get());
        test::fill(share, force, s.b_u.get());
        {
            WriteArray values(s.b_p.get());
            for (std::size_t i = 0; i < values.span().size(); ++i)
                values[i] = 0.01 * std::sin(share.nodes[i]);
        }
        s.rotations = s.solver->fine().make_rotations();
        s.solver->update_rotations(s.u.get(), s.rotations);
        s.solver->assemble(s.at(), {});
        s.solver->set_up_preconditioner();
        s.report = s.solver->solve(s.b_u.get(), s.b_p.get(), s.x_u.get(), s.x_p.get(), controls);
        return s;
    }
    static double norm(Vec v) {
        PetscReal size = 0;
        LIVETET_PETSC(VecNorm(v, NORM_2, &size));
        return size;
    }
    /// Type of the preconditioner of the split's displacements (0) or pressures (1).
    static std::string part_type(Solution& s, int part) {
        PC pc = nullptr, of_part = nullptr;
        PetscInt count = 0;
        KSP* parts = nullptr;
        PCType type = nullptr;
        LIVETET_PETSC(KSPGetPC(s.solver->krylov({}), &pc));
        LIVETET_PETSC(PCFieldSplitSchurGetSubKSP(pc, &count, &parts));
        LIVETET_PETSC(KSPGetPC(parts[part], &of_part));
        LIVETET_PETSC(PCGetType(of_part, &type));
        LIVETET_PETSC(PetscFree(parts));
        return type;
    }

    MeshHierarchy hierarchy = make_hierarchy(
        {test::block({8, 4, 4}, test::beam_size), test::block({4, 2, 2}, test::beam_size)},
        "a beam");
    std::vector<Material> materials{{.young_Pa = 4000, .poisson = 0.499}};
};

TEST_F(SaddlePoint, SolvesBothRows) {
    const Solution s = solve({.relative_tolerance = 1e-8});
    ASSERT_TRUE(s.report.converged) << s.report.reason;
    PressureCoupling& coupling = *s.solver->coupling();
    coupling.assemble(s.at());  // what the solver must have done
    // K x_u + B^T x_p / scale = b_u and B x_u - C x_p / scale = -b_p.
    const PetscHandle<Vec> row = make_vector(s.solver->fine().share()),
                           row_p = make_vector(*s.solver->fine().pressure_space());
    const double size = std::hypot(norm(s.b_u.get()), norm(s.b_p.get()));
    LIVETET_PETSC(VecScale(s.x_p.get(), 1 / coupling.scale()));
    LIVETET_PETSC(VecScale(s.b_u.get(), -1));
    LIVETET_PETSC(MatMultTransposeAdd(coupling.b(), s.x_p.get(), s.b_u.get(), row.get()));
    LIVETET_PETSC(MatMultAdd(s.solver->fine().matrix(), s.x_u.get(), row.get(), row.get()));
    EXPECT_LT(norm(row.get()), 1e-7 * size);
    LIVETET_PETSC(MatMultAdd(coupling.b(), s.x_u.get(), s.b_p.get(), row_p.get()));
    LIVETET_PETSC(MatMultAdd(coupling.minus_c(), s.x_p.get(), row_p.get(), row_p.get()));
    EXPECT_LT(norm(row_p.get()), 1e-7 * size);
    EXPECT_GT(norm(s.x_u.get()), 1e-4);
}

/// Tets whose nodes are all held have no part in B; neither they nor Poisson's ratio may cost
/// iterations.
TEST_F(SaddlePoint, HeldTetsAndPoissonsRatioCostNoIterations) {
    hierarchy = with_quadratic_level(std::move(hierarchy));
    for (const double nu : {0.49, 0.4999}) {
        materials.front().poisson = nu;
        const Solution at_face = solve({.relative_tolerance = 1e-8});
        const Solution half = solve({.relative_tolerance = 1e-8}, test::beam_size.x() / 2);
        ASSERT_TRUE(at_face.report.converged && half.report.converged) << nu;
        EXPECT_LE(at_face.report.iterations, 40) << nu;
        EXPECT_LE(half.report.iterations, at_face.report.iterations + 3) << nu;
    }
}

TEST_F(SaddlePoint, OptionsReachTheOuterSolverAndBothParts) {
    Solution plain = solve({.relative_tolerance = 1e-6});
    EXPECT_EQ(plain.solver->name().substr(0, 7), "fgmres ");
    EXPECT_EQ(part_type(plain, 0), PCMG);
    EXPECT_EQ(part_type(plain, 1), PCKSP);
    const test::PetscOptions set({{"-ksp_type", "gcr"},
                                  {"-ksp_max_it", "3"},
                                  {"-fieldsplit_displacement_pc_type", "jacobi"},
                                  {"-fieldsplit_pressure_pc_type", "none"}});
    Solution chosen = solve({.relative_tolerance = 1e-6});
    EXPECT_EQ(chosen.solver->name().substr(0, 4), "gcr ");
    EXPECT_EQ(chosen.report.iterations, 3);
    EXPECT_TRUE(chosen.report.cut_short);
    EXPECT_EQ(part_type(chosen, 0), PCJACOBI);
    EXPECT_EQ(part_type(chosen, 1), PCNONE);
}

}  // namespace
}  // namespace livetet
