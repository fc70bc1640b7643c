#include "solvers/assembly/pressure_coupling.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/quadratic.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

struct CoupledModel {
    const char* model;
    bool quadratic;
};

void PrintTo(const CoupledModel& c, std::ostream* out) {
    *out << c.model << (c.quadratic ? " P2" : " P1");
}

/// A bent beam whose face x = 0 is constrained in x and z.
class PressureCouplingTest : public testing::TestWithParam<CoupledModel> {
  protected:
    PressureCouplingTest() {
        if (GetParam().quadratic) whole = quadratic_mesh(whole);
        const int ranks = test::rank_count();
        level.emplace(distribute_mesh(PETSC_COMM_WORLD, whole, partition_tets(whole.tets, ranks)),
                      std::span(&material, 1), GetParam().model, Formulation::mixed,
                      MatrixLayout::blocks);
        std::vector<std::uint8_t> held(whole.nodes.size(), 0);
        for (std::size_t n = 0; n < held.size(); ++n) held[n] = whole.nodes[n].x() < 1e-9 ? 5 : 0;
        level->set_constrained(local_part<std::uint8_t>(level->share(), held));
        rotations = level->make_rotations();
        coupling.emplace(*level);
        for (PetscHandle<Vec>* v : {&u, &w}) *v = make_vector(level->share());
        for (PetscHandle<Vec>* v : {&p, &q}) *v = make_vector(*level->pressure_space());
        std::vector<Vector3> bent;
        for (const Vector3& x : whole.nodes)
            bent.push_back(x.x() * Vector3(0.1, -x.x(), 2 * x.x() + x.y()));
        test::fill(level->share(), bent, u.get());
        update_ghosts(u.get());
        set_wave(p.get(), 30);
        set_wave(q.get(), 20);
    }
    /// Values between -size and size; of each number of ranks its own.
    static void set_wave(Vec v, double size) {
        PetscInt begin = 0;
        LIVETET_PETSC(VecGetOwnershipRange(v, &begin, nullptr));
        {
            WriteArray values(v);
            for (std::size_t i = 0; i < values.span().size(); ++i)
                values[i] = size * std::sin(1.0 + 1.7 * static_cast<double>(begin + i));
        }
        update_ghosts(v);
    }
    /// w: a direction, at constrained components zero unless they are asked for.
    void set_direction(bool constrained_too) {
        set_wave(w.get(), 1e-3);
        WriteArray values(w.get());
        if (constrained_too) return;
        for (std::size_t i = 0; i < values.span().size(); ++i)
            if (level->constrained()[i / 3] >> (i % 3) & 1) values[i] = 0;
    }
    Configuration at() {
        update_ghosts(u.get());
        level->update_rotations(u.get(), rotations);
        return {u.get(), p.get(), &rotations};
    }
    PetscHandle<Vec> pressures() const { return make_vector(*level->pressure_space()); }
    /// The residual's derivative along w, by a central difference at u.
    PetscHandle<Vec> difference() {
        constexpr double h = 1e-3;
        PetscHandle<Vec> ahead = pressures(), behind = pressures();
        LIVETET_PETSC(VecAXPY(u.get(), h, w.get()));
        coupling->residual(at(), ahead.get());
        LIVETET_PETSC(VecAXPY(u.get(), -2 * h, w.get()));
        coupling->residual(at(), behind.get());
        LIVETET_PETSC(VecAXPY(u.get(), h, w.get()));
        LIVETET_PETSC(VecAXPY(ahead.get(), -1, behind.get()));
        LIVETET_PETSC(VecScale(ahead.get(), 0.5 / h));
        return ahead;
    }
    static double norm(Vec v) {
        PetscReal size = 0;
        LIVETET_PETSC(VecNorm(v, NORM_2, &size));
        return size;
    }
    static double gap(Vec a, Vec b) {
        PetscHandle<Vec> rest;
        LIVETET_PETSC(VecDuplicate(a, rest.out()));
        LIVETET_PETSC(VecWAXPY(rest.get(), -1, a, b));
        return norm(rest.get());
    }
    /// x^T (-C) y.
    double minus_c(Vec x, Vec y) const {
        const PetscHandle<Vec> image = pressures();
        LIVETET_PETSC(MatMult(coupling->minus_c(), y, image.get()));
        PetscScalar product = 0;
        LIVETET_PETSC(VecDot(x, image.get(), &product));
        return product;
    }

    TetMesh whole = test::block({4, 3, 2}, test::beam_size);
    const Material material{.young_Pa = 3000, .poisson = 0.49};
    std::optional<LevelAssembler> level;
    ElementRotations rotations;
    std::optional<PressureCoupling> coupling;
    PetscHandle<Vec> u, w, p, q;
};

TEST_P(PressureCouplingTest, BIsTheDerivativeOfTheResidual) {
    coupling->assemble(at());
    set_direction(false);
    const PetscHandle<Vec> image = pressures();
    LIVETET_PETSC(MatMult(coupling->b(), w.get(), image.get()));
    const PetscHandle<Vec> expected = difference();
    EXPECT_LT(gap(image.get(), expected.get()), 1e-7 * norm(expected.get()));
}

TEST_P(PressureCouplingTest, ColumnsOfConstrainedComponentsAreZeroButNotTheirIncrement) {
    coupling->assemble(at());
    set_direction(true);
    const PetscHandle<Vec> increment = pressures(), by_columns = pressures();
    update_ghosts(w.get());
    LIVETET_PETSC(VecSet(increment.get(), 0));
    coupling->add_residual_increment(at(), w.get(), increment.get());
    const PetscHandle<Vec> expected = difference();
    EXPECT_LT(gap(increment.get(), expected.get()), 1e-7 * norm(expected.get()));
    {
        WriteArray values(w.get());
        for (std::size_t i = 0; i < values.span().size(); ++i)
            if (!(level->constrained()[i / 3] >> (i % 3) & 1)) values[i] = 0;
    }
    EXPECT_GT(norm(w.get()), 0);
    LIVETET_PETSC(MatMult(coupling->b(), w.get(), by_columns.get()));
    EXPECT_EQ(norm(by_columns.get()), 0);
}

TEST_P(PressureCouplingTest, MinusCIsTheDerivativeOfTheResidualByThePressure) {
    const PetscHandle<Vec> before = pressures(), after = pressures(), image = pressures();
    coupling->residual(at(), before.get());
    LIVETET_PETSC(VecAXPY(p.get(), coupling->scale(), q.get()));  // q: of the scaled unknown
    coupling->residual(at(), after.get());
    LIVETET_PETSC(VecAXPY(after.get(), -1, before.get()));
    LIVETET_PETSC(MatMult(coupling->minus_c(), q.get(), image.get()));
    EXPECT_LT(gap(image.get(), after.get()), 1e-9 * norm(image.get()));
}

TEST_P(PressureCouplingTest, MinusCIsSymmetricAndNegative) {
    const double of_p = minus_c(p.get(), p.get());
    EXPECT_LT(of_p, 0);
    EXPECT_LT(minus_c(q.get(), q.get()), 0);
    EXPECT_NEAR(minus_c(p.get(), q.get()), minus_c(q.get(), p.get()), 1e-12 * std::abs(of_p));
    // The stabilisation knows no constant pressure: 1^T C 1 = scale^2 volume / lambda.
    LIVETET_PETSC(VecSet(q.get(), 1));
    const double scale = coupling->scale(), volume = test::beam_size.prod(),
                 expected = scale * scale * volume / material.lambda();
    EXPECT_NEAR(minus_c(q.get(), q.get()), -expected, 1e-10 * expected);
}

INSTANTIATE_TEST_SUITE_P(
    , PressureCouplingTest,
    testing::Values(CoupledModel{"linear", false}, CoupledModel{"corotated", false},
                    CoupledModel{"neohookean", false}, CoupledModel{"corotated", true},
                    CoupledModel{"neohookean", true}),
    [](const auto& info) {
        return info.param.model + std::string(info.param.quadratic ? "_P2" : "_P1");
    });

}  // namespace
}  // namespace livetet
