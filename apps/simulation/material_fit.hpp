#pragma once

#include <memory>
#include <string>
#include <vector>

#include "apps/simulation/measured_organ.hpp"
#include "apps/simulation/scene_run.hpp"
#include "solvers/inverse/body_place.hpp"

namespace livetet {

/// A value of the scene that is sought.
struct SoughtValue {
    enum class Kind { young, poisson, support };
    Kind kind = Kind::young;
    std::size_t index = 0;  ///< in `materials`, or in `fix`
    std::string key;        ///< "materials[0].young_Pa"
    double start = 0;       ///< what the scene says, in the key's unit
    /// Standard deviation before the measurement of the coordinate that is sought: the logarithm of
    /// a stiffness, log(nu / (1/2 - nu)) of a Poisson's ratio.
    double prior = 0;
};

/// The values of a scene that have a spread, young_Pa and poisson of its materials; with `support`
/// the stiffness of each soft `fix`, too, known to a factor of 10. Throws Error if there are none.
std::vector<SoughtValue> sought_values(const Scene& scene, bool support);

/// A value that was found.
struct FoundValue {
    SoughtValue sought;
    double value = 0, low_95 = 0, high_95 = 0;  ///< in the key's unit
    /// Standard deviation of its coordinate over the one before: near 1 if the data say nothing.
    double spread_ratio = 1;
    bool is_determined() const;
};

/// What a fit of materials came to. The body is at the equilibrium found, with the values found.
struct [[nodiscard]] MaterialFit {
    bool converged = false;
    const char* reason = "";
    int iterations = 0;
    double rms_before_m = 0;  ///< distance of the landmarks with the values of the scene
    double rms_m = 0;
    std::vector<FoundValue> values;
    Scene scene;  ///< with the values found
    std::unique_ptr<SceneBody> body;
    RunHistory history;  ///< of the first solve, from rest
};

/// Finds material values from named points of a body under known loads and displacements. With q
/// the coordinates of the values, q_0 and S their means and standard deviations before, u(q) the
/// static equilibrium and m_l the measured places of the landmarks x_l, q is the smallest of
///
///     J(q) = 1/2 sum_l |x_l + u_l(q) - m_l|^2 / s^2 + 1/2 |S^-1 (q - q_0)|^2
///
/// by Gauss-Newton: from F(u, q) = f_int(u, q) - f_springs(u, q) = f_ext,
///
///     du/dq = -K^-1 dF/dq,
///
/// with dF/dq by central differences of the forces at the same u. A step is halved until J falls.
/// The spread is that of the Laplace approximation, (G^T G / s^2 + S^-2)^-1, with s^2 times chi^2 a
/// degree of freedom where that is more than 1. s: deform.landmark_error_mm.
///
/// Throws Error if the scene is dynamic or a mixed form, nothing moves the body, the first solve
/// does not converge, or there are fewer numbers measured than values sought. On one rank.
MaterialFit fit_materials(const Scene& scene, const MeshHierarchy& hierarchy,
                          const std::vector<MeasuredLandmark>& landmarks,
                          const std::vector<SoughtValue>& sought,
                          const ProgressCallback& progress = {});

}  // namespace livetet
