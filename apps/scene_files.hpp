#pragma once

#include <filesystem>
#include <set>

#include "apps/scene.hpp"

namespace livetet {

/// What a body's mesh and constraints are read from: the mesh, the masks of what is fixed, driven and loaded.
std::set<std::filesystem::path> mesh_files(const Scene& scene);

}  // namespace livetet
