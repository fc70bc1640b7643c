#include "apps/live/tracked_model.hpp"

namespace livetet {

TrackedModel make_tracked_model(const Scene& scene, MeshHierarchy loaded) {
    MeshHierarchy for_targets;
    if (!scene.track->targets.empty()) for_targets = loaded;
    return {make_body(PETSC_COMM_SELF, scene, std::move(loaded), Use::track),
            std::move(for_targets)};
}

TrackedBody track_model(const Scene& scene, TrackedModel& model, ToolFinder find_tool,
                        const RigidTransform<ImageFrame, Reference>& image_from_reference,
                        const std::optional<ExpectedRegistrationError>& registration,
                        MisplacedSensor misplaced, SurfaceErrors surface) {
    TrackedBody tracked(scene, model.body, std::move(find_tool), image_from_reference, misplaced);
    if (scene.track->targets.empty()) return tracked;
    Scene stated = scene;
    stated.solver.threads = model.body.body->threads();  // a replay's are the same
    tracked.state_errors(std::make_unique<ErrorStatement>(stated, std::move(model.for_targets),
                                                          model.body.mesh(), surface),
                         registration);
    return tracked;
}

}  // namespace livetet
