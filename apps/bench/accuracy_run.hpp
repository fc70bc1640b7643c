#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "apps/bench/accuracy_truth.hpp"
#include "apps/live/error_statement.hpp"
#include "apps/scene/body_factory.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

/// Conditions of a run.
struct AccuracyCase {
    double position_rms_mm = 1.4, rotation_rms_deg = 0.5;  ///< noise of the tracker
    int sensors = 1;
    std::uint64_t seed = 1;
    bool organ_moves = true;  ///< rigid motion in front of the tracker
};

/// RMS over the judged targets and the last half second at one depth of the press, mm, in the
/// tracker's frame, with T = tracker_from_image, x a target at rest and u its displacement:
///   rigid-only    |T_est x - T_true (x + u_true)|
///   deforming     |T_est (x + u_est) - T_true (x + u_true)|
///   registration  |T_est x - T_true x|,  deformation  |u_est - u_true|
struct AccuracyErrors {
    double rigid = 0, deforming = 0, registration = 0, deformation = 0;
    // the statement
    double covered = 0;  ///< share of the errors of deforming that are within their 95 % radius
    double median = 0, median_radius = 0;  ///< of those errors and radii, mm
    /// Share of the errors that are no larger than stated with each of stated_probabilities().
    std::array<double, 19> within{};
    std::array<double, error_source_count> by_source{};  ///< stated RMS error by each source, mm
};

/// 5 %, 10 %, to 95 %.
std::array<double, 19> stated_probabilities();

/// Targets that are judged at all depths: those that move by more than a fifth of a press of 15 mm.
std::vector<std::size_t> judged_targets(const Truth& truth);

/// How far they truly move at each depth, RMS, mm.
std::vector<double> true_motion_mm(const Truth& truth);

/// The phantom's scene as `livetet track` runs it.
Scene accuracy_scene();

/// Model of the organ, used for run after run.
class AccuracyModel {
  public:
    /// `scene`: without sensors, which each run has of its own. The organ must outlive the model.
    AccuracyModel(Scene scene, const MeshHierarchy& hierarchy, const PressedOrgan& organ);

    /// Touches and registers the fiducials; then the organ moves, is pressed to each depth and held
    /// there, and the model follows. A case always gives the same noise, and that of the reference
    /// sensor does not depend on other sensors.
    std::vector<AccuracyErrors> run(const AccuracyCase& c);

    const TetMesh& mesh() const { return body_.mesh(); }

  private:
    Scene scene_;
    MeshHierarchy hierarchy_;  ///< of the model's mesh, whole
    SceneBody body_;
    const PressedOrgan& organ_;
    std::vector<std::size_t> judged_;
    PointSampler targets_;  ///< judged targets in the mesh
};

}  // namespace livetet
