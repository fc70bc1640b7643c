#include "apps/live/tracked_model.hpp"

namespace livetet {

TrackedModel make_tracked_model(const Scene& scene, MeshHierarchy loaded) {
    MeshHierarchy for_responses = loaded;
    return {make_body(PETSC_COMM_SELF, scene, std::move(loaded), Use::track),
            std::move(for_responses)};
}

TrackedBody track_model(const Scene& scene, TrackedModel& model, ToolFinder find_tool,
                        const RigidTransform<ImageFrame, Reference>& image_from_reference,
                        const std::optional<ExpectedRegistrationError>& registration,
                        MisplacedSensor misplaced, SurfaceErrors surface) {
    TrackedBody tracked(scene, model.body, std::move(find_tool), image_from_reference, misplaced);
    Scene alike = scene;
    alike.solver.threads = model.body.body->threads();  // a replay's are the same
    if (scene.track->targets.empty())
        tracked.judge_slips_by(std::make_unique<TargetResponses>(
            alike, std::move(model.for_responses), std::vector<Vector3>{}));
    else
        tracked.state_errors(std::make_unique<ErrorStatement>(alike, std::move(model.for_responses),
                                                              model.body.mesh(), surface),
                             registration);
    return tracked;
}

}  // namespace livetet
