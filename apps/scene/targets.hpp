#pragma once

#include <string>
#include <vector>

#include "apps/scene/scene.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// A target of a scene: one place, or some places of a region.
struct Target {
    std::string name;
    std::vector<Vector3> places;  ///< at rest in the image, m; at least one
};

/// A region is judged at no more places than this, spread over it: each is the one farthest from
/// those before.
constexpr std::size_t max_places_of_region = 24;

/// Targets of `track.targets` on the body's finest mesh. Throws Error if a file cannot be read, a
/// selection has no nodes, two targets have one name, or a point is more than 1 mm outside the
/// mesh.
std::vector<Target> read_targets(const Scene& scene, const TetMesh& mesh);

}  // namespace livetet
