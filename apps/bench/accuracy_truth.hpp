#pragma once

#include <vector>

#include "apps/phantom/phantom_images.hpp"
#include "apps/phantom/truth_file.hpp"
#include "base/progress.hpp"
#include "mechanics/material.hpp"
#include "tracking/sensor_drive.hpp"

namespace livetet {

/// A deformation sensor on the phantom: the first is pressed, the others move with the surface.
struct TrueSensor {
    RigidTransform<ImageFrame, Sensor> at_rest;
    double patch_radius;  ///< of the model's patch, m
    DriveMotion motion;   ///< part of its motion that the model follows
    std::vector<TruthTarget>
        around;  ///< its position on the surface and six points around it, which it moves with
};

/// The true pressed phantom: `truth` holds the press and the targets inside.
struct PressedOrgan {
    Truth truth;
    std::vector<TrueSensor> sensors;
};

/// Number of sensor positions: the pressed one, five around it, ten farther out, none on the fixed
/// side.
constexpr int max_true_sensors = 16;

/// What the true organ is made of and pressed by. A model takes the default values for true.
struct TrueBody {
    double poisson = Material{}.poisson;
    double patch_radius = 0.015;  ///< m
};

/// Computes targets and sensors at each of the depths (m, rising, above 0) with P2 tets of a
/// neo-Hookean material; about `tets` on the finest level, with shorter edges at the presser: even
/// ones would share much of the error of the model's mesh. Needs a PetscSession. Throws Error as
/// solve_truth does.
PressedOrgan press_organ(const PhantomImages& images, int tets, std::vector<double> depths,
                         const ProgressCallback& progress = {}, const TrueBody& body = {});

/// Pose of a sensor at a press of `depth` metres: the rigid motion nearest to that of the surface
/// around it. Linear between the computed depths.
RigidTransform<ImageFrame, Sensor> sensor_at(const PressedOrgan& organ, const TrueSensor& sensor,
                                             double depth);

}  // namespace livetet
