#pragma once

#include "config/fields.hpp"

namespace livetet {

enum class TimeScheme { static_equilibrium, implicit_euler, newmark };

/// How a scene moves in time.
struct TimeOptions {
    TimeScheme scheme = TimeScheme::static_equilibrium;
    double step_s = 0.05;
    double duration_s = 1;
    double beta = 0.25;
    double gamma = 0.5;
    double rayleigh_alpha = 0;
    double rayleigh_beta = 0;
    int load_steps = 1;
};

template <class Visitor>
void visit_fields(Visitor& v, TimeOptions& t) {
    v.choice("scheme", t.scheme, "how the body moves in time",
             {{TimeScheme::static_equilibrium, "static", "equilibrium; no mass, no velocities"},
              {TimeScheme::implicit_euler, "euler", "implicit Euler: first order, damps"},
              {TimeScheme::newmark, "newmark", "Newmark with beta and gamma: second order at 1/4, 1/2"}});
    v.field("step_s", t.step_s, "s", "time step of `solve`; `track` steps from sample to sample", greater_than<0>());
    v.field("duration_s", t.duration_s, "s", "how long `solve` runs", greater_than<0>());
    v.field("beta", t.beta, "", "Newmark's beta",
            Check<double>{"above 0 and at most 1", [](const double& x) { return x > 0 && x <= 1; }});
    v.field("gamma", t.gamma, "", "Newmark's gamma; 1/2: no damping of its own",
            Check<double>{"from 0.5 to 1.5", [](const double& x) { return x >= 0.5 && x <= 1.5; }});
    v.field("rayleigh_alpha", t.rayleigh_alpha, "1/s", "Rayleigh damping: C = alpha M + beta K", at_least<0>());
    v.field("rayleigh_beta", t.rayleigh_beta, "s", "Rayleigh damping: C = alpha M + beta K", at_least<0>());
    v.field("load_steps", t.load_steps, "", "static: the loads and driven displacements are applied in this many steps",
            at_least<1, int>());
}

/// Acceleration and velocity at the end of a step as affine functions of its displacement increment du = u1 - u0:
/// a1 = a_u du - a_v v0 - a_a a0,  v1 = v_u du + v_v v0 + v_a a0.
struct TimeCoefficients {
    double a_u = 0, a_v = 0, a_a = 0;
    double v_u = 0, v_v = 0, v_a = 0;
};

/// Newmark 1959 in displacement form, implicit Euler as v1 = du / dt, a1 = (v1 - v0) / dt; all zero for static.
inline TimeCoefficients time_coefficients(const TimeOptions& t, double dt) {
    switch (t.scheme) {
        case TimeScheme::static_equilibrium:
            return {};
        case TimeScheme::implicit_euler:
            return {1 / (dt * dt), 1 / dt, 0, 1 / dt, 0, 0};
        case TimeScheme::newmark:
            return {1 / (t.beta * dt * dt),  1 / (t.beta * dt),    1 / (2 * t.beta) - 1,
                    t.gamma / (t.beta * dt), 1 - t.gamma / t.beta, dt * (1 - t.gamma / (2 * t.beta))};
    }
    return {};
}

}  // namespace livetet
