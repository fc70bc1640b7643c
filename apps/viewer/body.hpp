#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "apps/live/tracked_body.hpp"
#include "apps/scene/scene.hpp"
#include "image/image.hpp"

// Plain data that a window shows, of a recorded result or a run. Metres, image frame.

namespace livetet {

/// A fiducial as the image has it, and where the registration maps the touched point.
struct ShownFiducial {
    std::string name;
    Vector3 in_image = Vector3::Zero(), from_tracker = Vector3::Zero();
};

/// A surface, and the tet that each of its nodes moves with, by its corners: of its own side, where
/// a cut leaves several at one place. Without tets a node moves with what is there.
struct DrawnSurface : TriangleMesh {
    std::vector<Tet> tets;
};

/// The surface of a mesh, with at least about ten thousand triangles: subdivided by Loop's scheme
/// if it has fewer.
DrawnSurface render_surface(const TetMesh& mesh);

/// The data that do not change in time.
struct ShownBody {
    TetMesh mesh;
    DrawnSurface surface;          ///< at rest, as fine as it is drawn
    bool has_own_surface = false;  ///< it is a file's, and not the mesh's
    /// Where each node is marked, at rest: on the surface. That is rounded where it is subdivided,
    /// and the nodes of a grid lie up to a cell outside it.
    std::vector<Vector3> marked_at;
    std::vector<std::int32_t> fixed;  ///< fixed nodes on the surface of the mesh
    std::optional<GreyImage> image;
    std::vector<ShownFiducial> fiducials;
    std::vector<Vector3> stated_places;  ///< of ShownMoment::stated, at rest; empty: nothing stated
    std::vector<std::string> left_out;   ///< what cannot be shown, and why; one line each
};

struct ShownTool {
    std::string name;
    bool has_tip = false;  ///< the pose is that of the tip
    RigidTransform<ImageFrame, Tool> pose;
};

struct ShownSensor {
    std::string name;
    std::optional<Vector3> base, now;  ///< position at placement; present position, if known
    std::vector<std::int32_t> patch;   ///< nodes that follow it
};

/// A target of the scene with its stated error.
struct ShownTarget {
    std::string name;
    Vector3 position = Vector3::Zero();
    double radius_95 = 0;        ///< m
    bool is_incomplete = false;  ///< sources of error are missing from it
    TriangleMesh region;         ///< its 95 % ellipsoid
};

/// The state at one time.
struct ShownMoment {
    double time_s = 0;
    std::vector<Vector3> displacement;  ///< of each node
    std::vector<double> von_mises;      ///< of each node, Pa; empty: unknown
    std::vector<ShownTool> tools;
    std::vector<ShownSensor> sensors;
    std::vector<ShownTarget> targets;
    SurfaceStatement stated;  ///< at ShownBody::stated_places; without radii: unknown
    std::optional<HandPull> pull;
    std::vector<Vector3> drawn;  ///< points of a line that is being drawn by hand
    std::string text;            ///< a line of text on the frame
    bool keeps_numbers = false;  ///< texts are not redrawn: nobody reads 25 numbers a second
};

/// Files that replace those of the scene.
struct ViewFiles {
    std::filesystem::path image, surface;  ///< given by the user; empty: those of the scene
};

/// The constant data of a scene on this mesh. `named_in`: the scene file, or the result that holds
/// it. Files given by the user must exist; missing files of the scene are left out and listed in
/// `left_out`. Throws Error.
ShownBody make_shown_body(TetMesh mesh, const std::optional<Scene>& scene,
                          const std::filesystem::path& named_in, const ViewFiles& files);

/// A cut has changed the mesh: nodes were added. A file's surface stays, and moves with it.
void set_mesh(ShownBody& body, TetMesh mesh);

/// Adds a statement to a moment: targets, the error over the surface, and its text.
void add_statement(ShownMoment& moment, const FrameStatement& statement,
                   const std::vector<std::string>& names);

}  // namespace livetet
