#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "apps/scene/scene.hpp"

namespace livetet {

/// The files of mesh and constraints: the mesh, and the masks of fixed, driven and loaded nodes.
std::set<std::filesystem::path> mesh_files(const Scene& scene);

/// All files that a run reads besides the scene; may contain empty paths.
std::set<std::filesystem::path> read_files(const Scene& scene);

/// All files that a run writes, with the key that names each.
std::vector<std::pair<const char*, std::filesystem::path>> written_files(const Scene& scene);

/// Whether the scene names input that only a build with images reads: an image, a surface or a
/// `.vtu` grid as the mesh, coarser levels to be meshed, or an image that is no NIfTI.
bool needs_images(const Scene& scene);

/// Identifies the contents of files, one line each: name, size and digest, or that it is missing.
/// Throws Error for an image whose voxels lie in several files, which are not read.
std::string stamps_of(const std::set<std::filesystem::path>& files);

}  // namespace livetet
