#pragma once

#include <optional>

#include "apps/live/tracked_body.hpp"

namespace livetet {

/// What a run tracks: the body, and the meshes by which errors at its targets are stated.
struct TrackedModel {
    SceneBody body;
    MeshHierarchy for_targets;  ///< as loaded; without levels if the scene has no targets
};

/// `loaded`: the scene's mesh.
TrackedModel make_tracked_model(const Scene& scene, MeshHierarchy loaded);

/// The body as a tracker moves it. If the scene has targets, its frames state errors there, which
/// takes the meshes of `model`. `registration`: the error of image_from_reference; none: not known.
/// Throws Error as TrackedBody and read_targets do.
TrackedBody track_model(const Scene& scene, TrackedModel& model, ToolFinder find_tool,
                        const RigidTransform<ImageFrame, Reference>& image_from_reference,
                        const std::optional<ExpectedRegistrationError>& registration,
                        MisplacedSensor misplaced, SurfaceErrors surface = SurfaceErrors::stated);

}  // namespace livetet
