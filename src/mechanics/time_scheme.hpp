#pragma once

#include <algorithm>
#include <cmath>

#include "config/fields.hpp"

namespace livetet {

/// Time integration; `static_equilibrium` has no mass and no velocities.
enum class TimeScheme { static_equilibrium, implicit_euler, newmark, generalized_alpha };

/// How a body or a scene moves in time. Some fields are of a scene only: a DeformableBody is given
/// the length of each step, and loads as they are.
struct TimeOptions {
    TimeScheme scheme = TimeScheme::static_equilibrium;
    bool is_dynamic() const { return scheme != TimeScheme::static_equilibrium; }
    double step_s = 0.05;   ///< of a scene: a body's is the argument of `solve` and `advance`
    double duration_s = 1;  ///< of a scene
    double beta = 0.25;
    double gamma = 0.5;
    double rho_inf = 0.8;
    double adaptive_tolerance_mm = 0;  ///< of a scene
    double rayleigh_alpha = 0;
    double rayleigh_beta = 0;
    int load_steps = 1;  ///< of a scene
};

template <class Visitor>
void visit_fields(Visitor& v, TimeOptions& t) {
    v.choice(
        "scheme", t.scheme, "how the body moves in time",
        {{TimeScheme::static_equilibrium, "static", "equilibrium; no mass, no velocities"},
         {TimeScheme::implicit_euler, "euler", "implicit Euler: first order, damps"},
         {TimeScheme::newmark, "newmark", "Newmark with beta and gamma: second order at 1/4, 1/2"},
         {TimeScheme::generalized_alpha, "generalized_alpha",
          "second order, damps what the step cannot resolve, by rho_inf"}});
    v.field("step_s", t.step_s, "s", "time step of `solve`; `track` steps from sample to sample",
            greater_than<0>());
    v.field("adaptive_tolerance_mm", t.adaptive_tolerance_mm, "mm",
            "`solve`: steps grow and shrink (from step_s / 1000 to 100 step_s) so that each makes "
            "about this error; 0: "
            "all are step_s",
            at_least<0>());
    v.field("duration_s", t.duration_s, "s", "how long `solve` runs", greater_than<0>());
    v.field("beta", t.beta, "", "Newmark's beta", within({0, 1, Ends::low_excluded}));
    v.field("gamma", t.gamma, "", "Newmark's gamma; 1/2: no damping of its own",
            within({0.5, 1.5}));
    v.field("rho_inf", t.rho_inf, "",
            "spectral radius at infinite frequency: 0 damps most, 1 not at all", within({0, 1}));
    v.field("rayleigh_alpha", t.rayleigh_alpha, "1/s", "Rayleigh damping: C = alpha M + beta K",
            at_least<0>());
    v.field("rayleigh_beta", t.rayleigh_beta, "s", "Rayleigh damping: C = alpha M + beta K",
            at_least<0>());
    v.field("load_steps", t.load_steps, "",
            "static: the loads and driven displacements are applied in this many steps",
            at_least<1, int>());
}

/// Acceleration and velocity at the end of a step as affine functions of its displacement increment
/// du = u1 - u0: a1 = a_u du - a_v v0 - a_a a0,  v1 = v_u du + v_v v0 + v_a a0; and the balance
/// that the step solves for, with h the forces f_ext - f_int - C v: (1 - alpha_f) h1 + alpha_f h0 =
/// M ((1 - alpha_m) a1 + alpha_m a0).
struct TimeCoefficients {
    double a_u = 0, a_v = 0, a_a = 0;
    double v_u = 0, v_v = 0, v_a = 0;
    double alpha_m = 0, alpha_f = 0;
    double error = 0,
           error_from =
               1;  ///< the step's error of displacement is about error |a1 - error_from a0|
};

/// Newmark 1959 in displacement form, implicit Euler as v1 = du / dt, a1 = (v1 - v0) / dt,
/// generalized-alpha after Chung and Hulbert 1993; all zero for static. The error of a step:
/// Zienkiewicz and Xie 1991 for Newmark's form, |beta - 1/6| dt^2 (at least dt^2 / 12, so that a
/// lucky beta hides nothing); Euler's dt^2 / 2.
inline TimeCoefficients time_coefficients(const TimeOptions& t, double dt) {
    double beta = t.beta, gamma = t.gamma, alpha_m = 0, alpha_f = 0;
    switch (t.scheme) {
        case TimeScheme::static_equilibrium:
            return {};
        case TimeScheme::implicit_euler:
            return {1 / (dt * dt), 1 / dt, 0, 1 / dt, 0, 0, 0, 0, dt * dt / 2, 0};
        case TimeScheme::generalized_alpha:
            alpha_m = (2 * t.rho_inf - 1) / (t.rho_inf + 1);
            alpha_f = t.rho_inf / (t.rho_inf + 1);
            gamma = 0.5 - alpha_m + alpha_f;
            beta = (1 - alpha_m + alpha_f) * (1 - alpha_m + alpha_f) / 4;
            break;
        case TimeScheme::newmark:
            break;
    }
    return {1 / (beta * dt * dt),
            1 / (beta * dt),
            1 / (2 * beta) - 1,
            gamma / (beta * dt),
            1 - gamma / beta,
            dt * (1 - gamma / (2 * beta)),
            alpha_m,
            alpha_f,
            std::max(std::abs(beta - 1.0 / 6), 1.0 / 12) * dt * dt,
            1};
}

}  // namespace livetet
