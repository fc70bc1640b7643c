#pragma once

#include <filesystem>
#include <functional>
#include <random>
#include <vector>

#include "apps/phantom/phantom_images.hpp"
#include "base/progress.hpp"
#include "mesh/hierarchy.hpp"
#include "tracking/fiducials.hpp"

namespace livetet {

/// Three draws of the standard normal distribution.
inline Vector3 normal_vector(std::mt19937_64& engine) {
    std::normal_distribution<double> normal(0, 1);
    const double x = normal(engine), y = normal(engine), z = normal(engine);
    return {x, y, z};
}

/// Where an organ is gripped, and what direction it is pulled in.
struct Grip {
    Vector3 place, direction;
};

/// The organ that `bench registration` deforms.
struct BenchOrgan {
    /// A mesh of about so many tets, with the set "fixed": what holds the organ.
    std::function<MeshHierarchy(int tets, const ProgressCallback& progress)> mesh;
    std::function<Grip(std::mt19937_64& engine)> grip;
    /// Where the error counts for a grip there, at rest.
    std::function<std::vector<NamedPoint>(const TetMesh& mesh, const Vector3& place)> targets;
    /// The lower side is the surface below a plane through this point, m, across `up`.
    Vector3 below, up;
};

/// The phantom: pulled at its upper side, held where its mask says.
BenchOrgan phantom_organ(const PhantomImages& images);

/// An organ of a closed surface in mm, RAS: pulled at its front, held by the fifth of its depth
/// that lies farthest back, with 32 targets inside within 70 mm of the grip. Throws Error as
/// `read_surface` does.
BenchOrgan surface_organ(const std::filesystem::path& file);

}  // namespace livetet
