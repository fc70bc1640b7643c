#pragma once

#include <functional>
#include <span>

#include "apps/scene/scene.hpp"

namespace livetet {

/// What a file that becomes a mesh holds, by its name; each a bit, for sets of them.
enum MeshKind : unsigned { image_kind = 1, surface_kind = 2, tets_kind = 4, hierarchy_kind = 8 };
MeshKind kind_of(const std::filesystem::path& file);

/// Whether the name is that of a tetrahedral mesh: .h5, .msh, and .vtu where this build has VTK.
bool is_tet_mesh_name(const std::filesystem::path& path);

/// For what kinds of file a key of the mesh block, or an option of `livetet mesh`, does anything.
struct MeshKey {
    const char* option;  ///< of the command
    const char* key;     ///< of the mesh block that says the same; nullptr: none does
    unsigned kinds;
    bool (*given)(const MeshSource&);  ///< whether a mesh block says other than the default;
                                       ///< nullptr without a key
};
std::span<const MeshKey> mesh_keys();

/// Throws Error, naming the file, its kind and the `name` of the first key that is `given` and does
/// nothing there.
void refuse_idle_keys(const std::filesystem::path& file,
                      const std::function<bool(const MeshKey&)>& given,
                      const std::function<std::string(const MeshKey&)>& name);

/// The same of a scene's mesh block.
void refuse_idle_keys(const MeshSource& source);

}  // namespace livetet
