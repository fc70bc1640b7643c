#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A target of a scene: one place, or some places of a region.
struct Target {
    std::string name;
    std::vector<Vector3> places;  ///< at rest in the image, m; at least one
};

/// A region is judged at no more places than this, the surface at no more than these: see
/// spread_places.
constexpr std::size_t max_places_of_region = 24;
constexpr std::size_t max_places_of_surface = 96;

/// At most `max_places` of the nodes, spread over them, at rest, m: first the one nearest to their
/// mean, then always the one farthest from those taken.
std::vector<Vector3> spread_places(const TetMesh& mesh, const std::vector<std::int32_t>& nodes,
                                   std::size_t max_places);

/// Places of the mesh's surface, spread over it, at which an error over the surface is stated, at
/// rest, m.
std::vector<Vector3> surface_places(const TetMesh& mesh);

/// Targets of `track.targets` on the body's finest mesh. Throws Error if a file cannot be read, a
/// selection has no nodes, two targets have one name, or a point is more than 1 mm outside the
/// mesh.
std::vector<Target> read_targets(const Scene& scene, const TetMesh& mesh);

/// The same of another list of targets, whose key is `list`.
std::vector<Target> read_targets(std::span<const TargetOptions> options, std::string_view list,
                                 const TetMesh& mesh);

/// All targets of a scene, of whatever command: those of `track.targets`, then those of
/// `deform.targets` that have other names.
std::vector<Target> all_targets(const Scene& scene, const TetMesh& mesh);

}  // namespace livetet
