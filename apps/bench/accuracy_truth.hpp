#pragma once

#include <vector>

#include "apps/phantom/phantom_images.hpp"
#include "apps/phantom/truth_file.hpp"
#include "base/progress.hpp"
#include "tracking/sensor_drive.hpp"

namespace livetet {

/// A deformation sensor on the phantom: the first is pressed, the others ride on the surface.
struct TrueSensor {
    RigidTransform<ImageFrame, Sensor> at_rest;
    double patch_radius;  ///< of the surface that the model moves with it, m
    DriveMotion motion;   ///< what the model takes of its motion
    std::vector<TruthTarget>
        around;  ///< its place on the surface and six around it, which it goes with
};

/// The phantom as it truly is when pressed: `truth` holds the press and the targets inside.
struct PressedOrgan {
    Truth truth;
    std::vector<TrueSensor> sensors;
};

/// How many sensors have a place: the pressed one, five around it, ten farther out, none on the
/// side that is held.
constexpr int max_true_sensors = 16;

/// Targets and sensors at each of the depths (m, rising, above 0), from P2 tets of a neo-Hookean
/// material: the finest level gets about `tets`. Needs a PetscSession. Throws Error as solve_truth
/// does.
PressedOrgan press_organ(const PhantomImages& images, int tets, std::vector<double> depths,
                         const ProgressCallback& progress = {});

/// Where the surface takes a sensor when the press is `depth` metres: the rigid motion nearest to
/// that of the surface around it. Linear between the depths solved for.
RigidTransform<ImageFrame, Sensor> sensor_at(const PressedOrgan& organ, const TrueSensor& sensor,
                                             double depth);

}  // namespace livetet
