#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "apps/verification/meshes.hpp"
#include "apps/verification/problem.hpp"

// Natural frequencies, and how time schemes change them.

namespace livetet::verification {

namespace {

using std::numbers::pi;

struct Mode {
    double frequency = 0;        ///< Hz
    std::vector<Vector3> shape;  ///< largest component 1, which need not be at every node of an end
};

/// The lowest mode of a held linear body with its lumped mass: inverse iteration, K x = M y.
Mode lowest_mode(Problem& problem, const std::function<Vector3(const Vector3& x)>& guess) {
    problem.apply();
    DeformableBody& body = problem.body();
    const auto mass = body.node_mass();
    std::vector<Vector3> y, force(problem.node_count());
    for (const Vector3& x : problem.mesh().nodes) y.push_back(guess(x));
    Mode mode;
    for (int k = 0; k < 40; ++k) {
        for (std::size_t n = 0; n < y.size(); ++n) force[n] = mass[n] * y[n];
        body.set_external_force(force);
        (void)body.solve(0, {.max_newton = 3, .tolerance = 1e-10, .linear_tolerance = 1e-10});
        const std::vector<Vector3> x = body.displacement();
        double xMy = 0, xMx = 0, largest = 0;  // Rayleigh's quotient: x K x = x M y
        for (std::size_t n = 0; n < x.size(); ++n) {
            xMy += mass[n] * x[n].dot(y[n]);
            xMx += mass[n] * x[n].squaredNorm();
            largest = std::max(largest, x[n].cwiseAbs().maxCoeff());
        }
        const double before = mode.frequency;
        mode.frequency = std::sqrt(xMy / xMx) / (2 * pi);
        for (std::size_t n = 0; n < x.size(); ++n) y[n] = x[n] / largest;
        if (std::abs(mode.frequency / before - 1) < 1e-9) break;
    }
    mode.shape = y;
    return mode;
}

const Isotropic bar_material{1e5, 0, 1000};
constexpr double bar_length = 0.2;

Problem bar(int n, const Discretisation& d, const TimeOptions& time = {}) {
    Problem problem({box({bar_length, 0.02, 0.02}, {n, 2, 2})}, bar_material, d, time);
    problem.hold("x0", "xyz");
    problem.prescribe([](const Vector3&) { return true; },
                      [](const Vector3&) { return Vector3(0, 0, 0); }, "yz");
    return problem;
}

std::vector<Outcome> frequencies() {
    std::vector<Outcome> outcomes;
    for (const bool quadratic : {false, true}) {
        const Discretisation d{"linear", quadratic};
        const double axial = bar_frequency(bar_material, bar_length, 1, Ends::clamped_free);
        Outcome o{.name = fmt::format("axial frequency of a clamped bar, {}", d.name()),
                  .source = "closed form, exact in 3-D",
                  .reference = axial,
                  .unit = "Hz",
                  .tolerance = 2e-3,
                  .runs = {}};
        for (const int n : {10, 20}) {
            Problem problem = bar(n, d);
            const Mode mode =
                lowest_mode(problem, [](const Vector3& x) { return Vector3(x.x(), 0, 0); });
            o.runs.push_back({nodes_text(problem.node_count()), 1.0 / n, mode.frequency,
                              std::abs(mode.frequency / axial - 1), problem.seconds()});
        }
        outcomes.push_back(std::move(o));

        if (!quadratic) continue;  // P1 bends too stiffly to be asked: 18 % on four layers
        // A square plate whose sides may move along their normals only: exact in 3-D.
        const Isotropic steel{200e9, 0.3, 8000};
        const double plate = lamb_plate_frequency(steel, 10, 1, 1, 1);
        Outcome p{.name = fmt::format("bending frequency of a thick plate, {}", d.name()),
                  .source = "Lamb, Srinivas 1970, exact in 3-D",
                  .reference = plate,
                  .unit = "Hz",
                  .tolerance = 0.01,
                  .runs = {}};
        for (const int n : {4, 8}) {
            Problem problem({box({10, 10, 1}, {n, n, 1})}, steel, d);
            for (const char* side : {"x0", "x1"}) problem.hold(side, "yz");
            for (const char* side : {"y0", "y1"}) problem.hold(side, "xz");
            const Mode mode = lowest_mode(problem, [](const Vector3& x) -> Vector3 {
                return Vector3(0, 0, std::sin(pi * x.x() / 10) * std::sin(pi * x.y() / 10));
            });
            p.runs.push_back({nodes_text(problem.node_count()), 1.0 / n, mode.frequency,
                              std::abs(mode.frequency / plate - 1), problem.seconds()});
        }
        outcomes.push_back(std::move(p));
    }
    return outcomes;
}

/// The bar swings in its lowest discrete mode, so each scheme acts on it as on a single degree of
/// freedom: period and decay against the eigenvalues of the amplification matrix.
std::vector<Outcome> time_schemes() {
    struct Scheme {
        std::string name;
        TimeOptions time;
        AlphaScheme reference;
    };
    const Scheme schemes[] = {
        {"newmark 1/4, 1/2", {.scheme = TimeScheme::newmark}, {0, 0, 0.25, 0.5}},
        {"newmark 0.3025, 0.6",
         {.scheme = TimeScheme::newmark, .beta = 0.3025, .gamma = 0.6},
         {0, 0, 0.3025, 0.6}},
        {"generalized-alpha, rho 0.5",
         {.scheme = TimeScheme::generalized_alpha, .rho_inf = 0.5},
         generalized_alpha(0.5)},
        // Implicit Euler has the eigenvalues 1 / (1 -+ i Omega) of Newmark at 1, 3/2.
        {"implicit Euler", {.scheme = TimeScheme::implicit_euler}, {0, 0, 1, 1.5}}};
    std::vector<Outcome> outcomes;
    const double Omega = 0.5;
    for (const Scheme& scheme : schemes) {
        Problem still = bar(12, {"linear", false});
        const Mode mode = lowest_mode(still, [](const Vector3& x) { return Vector3(x.x(), 0, 0); });
        const double omega = 2 * pi * mode.frequency, dt = Omega / omega;
        Problem problem = bar(12, {"linear", false}, scheme.time);
        problem.apply();
        std::vector<Vector3> start;
        for (const Vector3& v : mode.shape) start.push_back(1e-6 * v);
        problem.body().set_displacement(start);
        const std::int32_t tip = problem.node_at({bar_length, 0, 0});
        // Downward crossings of zero, at steps by linear interpolation of a sampled cosine's phase;
        // peaks by energy.
        std::vector<double> crossings, energies;
        double before = 1e-6;
        const int steps = 400;
        for (int k = 1; k <= steps; ++k) {
            (void)problem.body().solve(
                dt, {.max_newton = 2, .tolerance = 1e-11, .linear_tolerance = 1e-11});
            const double now = problem.body().displacement()[tip].x();
            if (before > 0 && now <= 0) crossings.push_back(k - 1 + before / (before - now));
            before = now;
            energies.push_back(problem.body().strain_energy() + problem.body().kinetic_energy());
            if (energies.back() < 1e-12 * energies.front()) break;
        }
        const SchemeResponse expected = response(scheme.reference, Omega);
        {
            const double swings =
                static_cast<double>(crossings.size()) - 1;  // none: not a number, and so not passed
            const double period =
                swings > 0 ? (crossings.back() - crossings.front()) / swings : std::nan("");
            const double elongation = period * Omega / (2 * pi) - 1;
            outcomes.push_back(
                {.name = fmt::format("{}: period elongation at omega dt = {}", scheme.name, Omega),
                 .source = "amplification matrix",
                 .reference = expected.period_elongation,
                 .unit = "1",
                 .tolerance = 3e-4,
                 .runs = {{fmt::format("{} swings", swings), 0, elongation,
                           std::abs(elongation - expected.period_elongation), problem.seconds()}}});
        }
        // Energy falls by rho^2 a step, but for a ripple; from crossing to crossing that is gone.
        const std::size_t a = 20, b = energies.size() - 1;
        const double radius = std::pow(energies[b] / energies[a], 0.5 / static_cast<double>(b - a));
        outcomes.push_back({.name = fmt::format("{}: amplitude kept a step", scheme.name),
                            .source = "spectral radius",
                            .reference = expected.spectral_radius,
                            .unit = "1",
                            .tolerance = 1e-3,
                            .runs = {{fmt::format("{} steps", b - a), 0, radius,
                                      std::abs(radius - expected.spectral_radius), 0}}});
    }
    return outcomes;
}

/// A free body that translates and spins: momentum, angular momentum and energy.
std::vector<Outcome> free_flight() {
    Problem problem({box({0.1, 0.06, 0.04}, {4, 3, 2})}, {1e5, 0.3, 1000}, {"corotated", false},
                    {.scheme = TimeScheme::newmark});
    problem.apply();
    DeformableBody& body = problem.body();
    const Vector3 flight(1, 2, -0.5), spin(3, -2, 12), centre(0.05, 0.03, 0.02);
    std::vector<Vector3> velocity;
    for (const Vector3& x : problem.mesh().nodes)
        velocity.push_back(flight + spin.cross(x - centre));
    body.set_velocity(velocity);
    const auto mass = body.node_mass();
    double total = 0;
    for (const double m : mass) total += m;
    const auto mean = [&] {
        Vector3 c = Vector3::Zero();
        const auto u = body.displacement();
        for (std::size_t n = 0; n < u.size(); ++n) c += mass[n] * u[n] / total;
        return c;
    };
    const auto spin_of = [&](const std::vector<Vector3>& u, const std::vector<Vector3>& v) {
        Vector3 L = Vector3::Zero();
        for (std::size_t n = 0; n < u.size(); ++n)
            L += mass[n] * (problem.mesh().nodes[n] + u[n]).cross(v[n]);
        return L;
    };
    const Vector3 spin_before = spin_of(body.displacement(), velocity);
    const double before = body.kinetic_energy(), dt = 2e-3;
    const int steps = 200;
    for (int k = 0; k < steps; ++k)
        (void)body.solve(dt, {.max_newton = 20, .tolerance = 1e-12, .linear_tolerance = 1e-8});
    const double drift = (mean() - steps * dt * flight).norm() / (steps * dt * flight.norm());
    const double after = body.kinetic_energy() + body.strain_energy();
    const double spin_lost =
        (spin_of(body.displacement(), body.velocity()) - spin_before).norm() / spin_before.norm();
    // A rigid rotation causes no forces.
    const Matrix3d R = Eigen::AngleAxisd(2.5, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
    std::vector<Vector3> turned;
    for (const Vector3& x : problem.mesh().nodes) turned.push_back(R * x - x);
    body.set_displacement(turned);
    double force = 0;
    for (const Vector3& f : body.elastic_force()) force = std::max(force, f.norm());
    const double unit = 1e5 * 0.02 * 0.02;  // E h^2
    return {{.name = "rigid turn by 2.5 rad, corotated P1: force over E h^2",
             .source = "no force",
             .reference = 0,
             .unit = "1",
             .tolerance = 1e-12,
             .runs = {{"1 state", 0, force / unit, force / unit, 0}}},
            {.name = "free flight and spin, corotated P1: angular momentum",
             .source = "it is kept",
             .reference = 0,
             .unit = "1",
             .tolerance = 1e-3,
             .runs = {{fmt::format("{} steps", steps), 0, spin_lost, spin_lost, 0}}},
            {.name = "free flight and spin, corotated P1: path of the centre",
             .source = "momentum is kept",
             .reference = 0,
             .unit = "1",
             .tolerance = 1e-9,
             .runs = {{fmt::format("{} steps", steps), 0, drift, drift, problem.seconds()}}},
            {.name = "free flight and spin, corotated P1: energy",
             .source = "energy is kept",
             .reference = 1,
             .unit = "1",
             .tolerance = 5e-3,
             .runs = {{fmt::format("{} steps", steps), 0, after / before,
                       std::abs(after / before - 1), 0}}}};
}

/// A beam with large rotations for 1,000 undamped steps of 1/200 of its period.
std::vector<Outcome> swinging_beam() {
    Problem problem({box({0.2, 0.05, 0.05}, {8, 2, 2})}, {5000, 0.4, 1000}, {"corotated", false},
                    {.scheme = TimeScheme::newmark});
    problem.hold("x0", "xyz");
    Problem still({box({0.2, 0.05, 0.05}, {8, 2, 2})}, {5000, 0.4, 1000}, {"linear", false});
    still.hold("x0", "xyz");
    const double dt = 0.005 / lowest_mode(still, [](const Vector3& x) -> Vector3 {
                                  return Vector3(0, 0, x.x() * x.x());
                              }).frequency;
    problem.apply();
    DeformableBody& body = problem.body();
    std::vector<Vector3> velocity;
    for (const Vector3& x : problem.mesh().nodes)
        velocity.push_back({0, 0, 0.3 * std::pow(x.x() / 0.2, 2)});
    body.set_velocity(velocity);
    const double before = body.kinetic_energy();
    double worst = 0, swing = 0;
    const std::int32_t tip = problem.node_at({0.2, 0.025, 0.025});
    for (int k = 0; k < 1000; ++k) {
        (void)body.solve(dt, {.max_newton = 20, .tolerance = 1e-10, .linear_tolerance = 1e-8});
        worst =
            std::max(worst, std::abs((body.kinetic_energy() + body.strain_energy()) / before - 1));
        swing = std::max(swing, std::abs(body.displacement()[tip].z()));
    }
    return {{.name = fmt::format(
                 "swinging corotated beam (tip {:.0f} % of its length): energy over 1,000 steps",
                 100 * swing / 0.2),
             .source = "energy is kept",
             .reference = 1,
             .unit = "1",
             .tolerance = 1e-3,
             .runs = {{"dt = T/200", 0, 1 + worst, worst, problem.seconds()}}}};
}

}  // namespace

std::vector<Case> dynamic_cases() {
    return {{"frequencies", frequencies},
            {"time schemes", time_schemes},
            {"free flight", free_flight},
            {"swinging beam", swinging_beam}};
}

}  // namespace livetet::verification
