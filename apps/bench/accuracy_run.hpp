#pragma once

#include <cstdint>
#include <vector>

#include "apps/bench/accuracy_truth.hpp"
#include "apps/scene/body_factory.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

/// What a run is recorded with.
struct AccuracyCase {
    double position_rms_mm = 1.4, rotation_rms_deg = 0.5;  ///< the tracker's noise
    int sensors = 1;
    std::uint64_t seed = 1;
    bool organ_moves = true;  ///< as a whole, in front of the tracker
};

/// RMS over the judged targets and the last half second at one depth of the press, mm, in the
/// tracker's frame, with T = tracker_from_image, x a target at rest and u its displacement:
///   rigid-only    |T_est x - T_true (x + u_true)|       deforming     |T_est (x + u_est) - T_true
///   (x + u_true)| registration  |T_est x - T_true x|                  deformation   |u_est -
///   u_true|
struct AccuracyErrors {
    double rigid = 0, deforming = 0, registration = 0, deformation = 0;
};

/// The targets that are judged, at every depth the same: those that move by more than a fifth of a
/// press of 15 mm.
std::vector<std::size_t> judged_targets(const Truth& truth);

/// The phantom's scene as `livetet track` follows it.
Scene accuracy_scene();

/// A model of the organ that one run after another is made with.
class AccuracyModel {
  public:
    /// `scene`: without sensors, each run has its own. The organ must outlive the model.
    AccuracyModel(Scene scene, const MeshHierarchy& hierarchy, const PressedOrgan& organ);

    /// Fiducials are touched and registered; then the organ moves, is pressed from one depth to the
    /// next and held at each, and the model follows. The same case gives the same noise, the
    /// reference sensor's whatever other sensors there are.
    std::vector<AccuracyErrors> run(const AccuracyCase& c);

    const TetMesh& mesh() const { return body_.mesh(); }

  private:
    Scene scene_;
    SceneBody body_;
    const PressedOrgan& organ_;
    std::vector<std::size_t> judged_;
    PointSampler targets_;  ///< the judged ones in the mesh
};

}  // namespace livetet
