#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/tracked_body.hpp"
#include "apps/scene/scene.hpp"
#include "image/image.hpp"

// What a window shows, as plain data: it comes from a recorded result or from a run that goes on.
// Metres, image frame.

namespace livetet {

/// A fiducial in both spaces: as the image has it, and where the registration puts what the tracker
/// touched.
struct ShownFiducial {
    std::string name;
    Vector3 in_image = Vector3::Zero(), from_tracker = Vector3::Zero();
};

/// What stays the same all the time.
struct ShownBody {
    TetMesh mesh;
    TriangleMesh surface;             ///< at rest, as fine as it is to look
    std::vector<std::int32_t> fixed;  ///< nodes on the mesh's surface that the scene holds
    std::optional<GreyImage> image;
    std::vector<ShownFiducial> fiducials;
    std::vector<std::string> left_out;  ///< what cannot be shown, and why: a line each
};

struct ShownTool {
    std::string name;
    bool has_tip = false;  ///< the pose is the tip's
    RigidTransform<ImageFrame, Tool> pose;
};

struct ShownSensor {
    std::string name;
    std::optional<Vector3> base, now;  ///< where it was placed; where it is, where that is known
    std::vector<std::int32_t> patch;   ///< nodes that go with it
};

/// One moment of it.
struct ShownMoment {
    double time_s = 0;
    std::vector<Vector3> displacement;  ///< of each node
    std::vector<double> von_mises;      ///< of each node, Pa; empty: not known
    std::vector<ShownTool> tools;
    std::vector<ShownSensor> sensors;
    std::optional<HandPull> pull;
    std::string text;            ///< a line on the frame
    bool keeps_numbers = false;  ///< texts stay as they were drawn last, where there are any:
                                 ///< nobody reads 25 numbers a second
};

/// Where to look for what a scene does not say.
struct ViewFiles {
    std::filesystem::path image, surface;  ///< given by the user; empty: found
};

/// What stays the same of a scene on this mesh. `told_by`: the scene's file, or the result that
/// holds it. Files that the user named must be there; what is not found of those that the scene
/// names is left out, and said. Throws Error.
ShownBody make_shown_body(TetMesh mesh, const std::optional<Scene>& scene,
                          const std::filesystem::path& told_by, const ViewFiles& files);

/// A surface of at least some ten thousand triangles for a mesh: its own, subdivided by Loop's
/// scheme where it has fewer.
TriangleMesh render_surface(const TetMesh& mesh);

}  // namespace livetet
