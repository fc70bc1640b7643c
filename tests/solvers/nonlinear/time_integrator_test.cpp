#include "solvers/nonlinear/time_integrator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// The nodes of a block as masses, each on a spring to where it rests, of angular frequency `omega`
/// (0: free), under a force of `gravity` a mass. Nodes at x = 0 are constrained.
class Masses {
  public:
    explicit Masses(const TimeOptions& options, double omega = 0, double gravity = 0)
        : squared_(omega * omega), gravity_(gravity) {
        const TetMesh mesh = test::block({3, 2, 2}, test::beam_size);
        const int ranks = test::rank_count();
        const Material material{.young_Pa = 3000, .poisson = 0.3, .density_kg_per_m3 = 1000};
        level_.emplace(distribute_mesh(PETSC_COMM_WORLD, mesh, partition_tets(mesh.tets, ranks)),
                       std::span(&material, 1), "linear", Formulation::displacement,
                       MatrixLayout::blocks);
        std::vector<std::uint8_t> held;
        for (const Vector3& x : mesh.nodes) held.push_back(x.x() < 1e-9 ? 7 : 0);
        level_->set_constrained(local_part<std::uint8_t>(level_->share(), held));
        level_->find_mass();
        time.emplace(options, *level_, state, ThreadTeam::alone());
        balance_ = make_vector(level_->share());
    }
    /// Displacement and velocity of all free masses.
    void start(double u0, double v0) {
        WriteArray u(state.u.get()), v(state.v.get());
        for_all([&](std::size_t i, bool is_free) {
            u[i] = is_free ? u0 : 0;
            v[i] = is_free ? v0 : 0;
        });
    }
    /// External force less the springs' pull, N, at the present u.
    void add_forces(double factor, Vec to) const {
        const ReadArray u(state.u.get());
        WriteArray f(to);
        for_all(
            [&](std::size_t i, bool) { f[i] += factor * mass(i) * (gravity_ - squared_ * u[i]); });
    }
    void start_acceleration() {
        const PetscHandle<Vec> none = make_vector(level_->share()),
                               force = make_vector(level_->share());
        LIVETET_PETSC(VecSet(none.get(), 0));
        LIVETET_PETSC(VecSet(force.get(), 0));
        add_forces(1, force.get());
        time->start_acceleration(none.get(), force.get());
    }
    /// A step, the free masses' by one Newton iteration: the balance is linear. Constrained ones
    /// move by `prescribed`.
    double step(double dt, double prescribed = 0) {
        time->begin_step(dt);
        const double of_mass = time->mass_factor() + time->stiffness_factor() * squared_;
        {
            find_balance();
            const ReadArray r(balance_.get());
            WriteArray u(state.u.get());
            for_all([&](std::size_t i, bool is_free) {
                u[i] += is_free ? r[i] / (of_mass * mass(i)) : prescribed;
            });
        }
        find_balance();
        const ReadArray r(balance_.get());
        for_all([&](std::size_t i, bool is_free) {
            EXPECT_NEAR(is_free ? r[i] : 0, 0, 1e-10 * of_mass * mass(i));
        });
        return time->finish_step(dt);
    }
    /// Expects a displacement, velocity and acceleration of all free masses.
    void expect(double u1, double v1, double a1, double tolerance) const {
        const ReadArray u(state.u.get()), v(state.v.get()), a(state.a.get());
        for_all([&](std::size_t i, bool is_free) {
            if (!is_free) return;
            EXPECT_NEAR(u[i], u1, tolerance);
            EXPECT_NEAR(v[i], v1, 100 * tolerance);
            EXPECT_NEAR(a[i], a1, 1e4 * tolerance);
        });
    }
    /// (|v|^2 + omega^2 |u|^2) / 2 with the masses, J, on this rank.
    double energy() const {
        const ReadArray u(state.u.get()), v(state.v.get());
        double sum = 0;
        for_all([&](std::size_t i, bool) {
            sum += mass(i) * (v[i] * v[i] + squared_ * u[i] * u[i]) / 2;
        });
        return sum;
    }
    /// visit(component, whether it is free) of each owned node.
    template <class Visit>
    void for_all(Visit&& visit) const {
        for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(level_->share().owned); ++i)
            visit(i, !(level_->constrained()[i / 3] >> (i % 3) & 1));
    }

    BodyState state;
    std::optional<TimeIntegrator> time;

  private:
    double mass(std::size_t i) const { return level_->node_mass()[i / 3]; }
    void find_balance() {
        LIVETET_PETSC(VecSet(balance_.get(), 0));
        time->find_velocity();
        time->add_inertia(balance_.get());
        LIVETET_PETSC(VecScale(balance_.get(), -1));
        add_forces(1, balance_.get());
        if (state.end_force)
            LIVETET_PETSC(VecAXPY(balance_.get(), time->history_weight(), state.end_force.get()));
    }

    std::optional<LevelAssembler> level_;
    PetscHandle<Vec> balance_;
    double squared_, gravity_;  ///< 1/s^2, m/s^2
};

constexpr TimeScheme second_order[] = {TimeScheme::newmark, TimeScheme::generalized_alpha};

TEST(TimeIntegratorTest, FreeFallIsExactAndHasNoError) {
    for (const TimeScheme scheme : second_order) {
        Masses falling({.scheme = scheme}, 0, -9.81);
        falling.start(0.5, 2);
        falling.start_acceleration();
        double t = 0;
        for (const double dt : {0.02, 0.02, 0.05, 0.01}) {
            EXPECT_LT(falling.step(dt), 1e-12);
            t += dt;
            falling.expect(0.5 + 2 * t - 9.81 * t * t / 2, 2 - 9.81 * t, -9.81, 1e-12);
        }
    }
}

/// Euler's step goes dt v1: too far by g dt^2 / 2, which is the error that it reports.
TEST(TimeIntegratorTest, EulersFallHasAnExactVelocityAndTheErrorThatItReports) {
    Masses falling({.scheme = TimeScheme::implicit_euler}, 0, -9.81);
    falling.start(0.5, 2);
    EXPECT_NEAR(falling.step(0.02), 9.81 * 2e-4, 1e-12);
    falling.expect(0.5 + 0.02 * 2 - 9.81 * 4e-4, 2 - 9.81 * 0.02, -9.81, 1e-12);
}

TEST(TimeIntegratorTest, TheTrapezoidalRuleKeepsTheEnergyOfMassesOnSprings) {
    Masses swinging({.scheme = TimeScheme::newmark}, 30);
    swinging.start(0.01, 0.2);
    swinging.start_acceleration();
    const double before = swinging.energy();
    for (int k = 0; k < 40; ++k) (void)swinging.step(0.02);
    EXPECT_NEAR(swinging.energy(), before, 1e-10 * before);
}

TEST(TimeIntegratorTest, MassesOnSpringsSwingAsTheCosineToTheSchemesOrder) {
    constexpr double omega = 10, end = 0.4;
    const auto error = [&](TimeScheme scheme, int steps) {
        Masses swinging({.scheme = scheme}, omega);
        swinging.start(1, 0);
        swinging.start_acceleration();
        for (int k = 0; k < steps; ++k) (void)swinging.step(end / steps);
        const ReadArray u(swinging.state.u.get());
        double largest = 0;
        swinging.for_all([&](std::size_t i, bool is_free) {
            if (is_free) largest = std::max(largest, std::abs(u[i] - std::cos(omega * end)));
        });
        MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
        return largest;
    };
    for (const TimeScheme scheme : second_order)
        EXPECT_NEAR(std::log2(error(scheme, 20) / error(scheme, 40)), 2, 0.05);
    const double of_euler =
        error(TimeScheme::implicit_euler, 100) / error(TimeScheme::implicit_euler, 200);
    EXPECT_NEAR(std::log2(of_euler), 1, 0.1);
}

/// Damping by the mass alone: Euler's velocity falls by 1 / (1 + alpha dt) a step.
TEST(TimeIntegratorTest, DampingByTheMassSlowsAFreeBody) {
    Masses slowing({.scheme = TimeScheme::implicit_euler, .rayleigh_alpha = 3});
    slowing.start(0, 2);
    (void)slowing.step(0.1);
    slowing.expect(0.2 / 1.3, 2 / 1.3, (2 / 1.3 - 2) / 0.1, 1e-12);
}

TEST(TimeIntegratorTest, APrescribedMotionHasTheVelocityOfItsStep) {
    for (const TimeScheme scheme : second_order) {
        Masses driven({.scheme = scheme});
        driven.start(0, 0);
        driven.start_acceleration();
        for (const double way : {0.01, 0.01, 0.0}) {
            (void)driven.step(0.02, way);
            const ReadArray v(driven.state.v.get()), a(driven.state.a.get());
            driven.for_all([&](std::size_t i, bool is_free) {
                EXPECT_NEAR(v[i], is_free ? 0 : way / 0.02, 1e-12);
                EXPECT_NEAR(a[i], 0, 1e-12);
            });
        }
    }
}

TEST(TimeIntegratorTest, AStepThatIsGivenUpLeavesTheStateAsItWas) {
    Masses masses({.scheme = TimeScheme::newmark}, 5);
    masses.start(0.5, 2);
    masses.start_acceleration();
    masses.time->begin_step(0.02);
    LIVETET_PETSC(VecShift(masses.state.u.get(), 7));
    masses.time->find_velocity();
    masses.time->return_to_start();
    masses.expect(0.5, 2, -25 * 0.5, 1e-14);
}

}  // namespace
}  // namespace livetet
