#pragma once

#include <string>
#include <vector>

#include "apps/scene/scene.hpp"
#include "geometry/triangle_mesh.hpp"
#include "mesh/tet_mesh.hpp"
#include "meshing/options.hpp"

namespace livetet {

/// What a scene's mesh is graded by: patches of the body's surface that are moved. At the rim of a
/// patch the displacement's gradient is unbounded: elements leave most of their error there.
struct SceneGrading {
    struct GradedPatch {
        std::string key;  ///< in the scene, such as track.sensors[0].place_mm
        PatchGrading::Patch patch;
    };
    std::vector<GradedPatch> patches;
    /// Keys of sensors and driven nodes whose places the scene does not state.
    std::vector<std::string> without_place;

    std::vector<PatchGrading::Patch> surface_patches() const;
    /// All that the mesh depends on, on one line.
    std::string text() const;
    /// Throws Error, naming the key, if a patch's centre is farther from the body's surface than
    /// its radius and `farthest_from_body`.
    void check(const TriangleMesh& body) const;
};

/// Maximum distance of a patch's planned place from the surface of the body, m.
inline constexpr double farthest_from_body = 0.02;

/// The patches of a scene, whatever its mesh.grading.
SceneGrading grading_by(const Scene& scene);

/// The same if mesh.grading says so, else none. Throws Error if it says so and there are none.
SceneGrading grading_of(const Scene& scene);

/// Throws Error if `place_mm` of a sensor is off the mesh's surface, as SceneGrading::check does.
void check_sensor_places(const Scene& scene, const TetMesh& mesh);

/// Mean length of the edges of a mesh's surface that cross the rim of a patch, m: those with one
/// end within `radius` of `place` and the other beyond. If there are none, of the edges of the
/// triangle nearest to the place.
double edge_length_at_rim(const TetMesh& mesh, const Vector3& place, double radius);

/// Expected error of the displacement near a patch that is due to the elements, relative to the
/// press, on an even mesh of edges `edge_m`. Measured, see docs/theory/meshing.md.
double element_error(Elements elements, double edge_m, double patch_radius_m);

/// What it costs that a sensor is placed at `place` and not where it was planned, on one line: the
/// edges at both rims and the error to expect. Empty if edges at `place` are at most 1.25 times as
/// long as at the planned place, or if none was planned. `place`: on the body at rest, m.
std::string cost_of_place(const TetMesh& mesh, Elements elements, const SensorOptions& sensor,
                          const Vector3& place);

}  // namespace livetet
