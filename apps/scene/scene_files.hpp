#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "apps/scene/scene.hpp"

namespace livetet {

/// What a body's mesh and constraints are read from: the mesh, the masks of what is fixed, driven
/// and loaded.
std::set<std::filesystem::path> mesh_files(const Scene& scene);

/// All that a run reads besides the scene itself; empty paths among them are those of no file.
std::set<std::filesystem::path> read_files(const Scene& scene);

/// All that a run writes, each with the key that names it.
std::vector<std::pair<const char*, std::filesystem::path>> written_files(const Scene& scene);

/// How these files are known again, a line for each: its name, size and digest, or that it is
/// missing. Throws Error where an image's voxels lie in several files, which are not looked at.
std::string stamps_of(const std::set<std::filesystem::path>& files);

}  // namespace livetet
