#pragma once

#include <optional>

#include "apps/live/tracked_body.hpp"

namespace livetet {

/// What a run tracks: the body, and the meshes by which its responses to patches are computed.
struct TrackedModel {
    SceneBody body;
    MeshHierarchy for_responses;  ///< as loaded
};

/// `loaded`: the scene's mesh.
TrackedModel make_tracked_model(const Scene& scene, MeshHierarchy loaded);

/// The body as a tracker moves it, which takes `model.for_responses`. If the scene has targets, its
/// frames state errors there. `registration`: the error of image_from_reference; none: not known.
/// Throws Error as TrackedBody and read_targets do.
TrackedBody track_model(const Scene& scene, TrackedModel& model, ToolFinder find_tool,
                        const RigidTransform<ImageFrame, Reference>& image_from_reference,
                        const std::optional<ExpectedRegistrationError>& registration,
                        MisplacedSensor misplaced, SurfaceErrors surface = SurfaceErrors::stated);

}  // namespace livetet
