#pragma once

#include <functional>
#include <initializer_list>
#include <span>

#include "apps/scene/scene.hpp"

namespace livetet {

/// What a mesh is made from, by file name; for .vtk and DICOM by the file's header. Throws Error
/// for a name that is none of them.
enum class MeshKind { image, surface, tets, hierarchy };
MeshKind kind_of(const std::filesystem::path& file);

/// Whether this names a mesh of tets or hexahedra: .h5, .msh and, with VTK, .vtu.
bool is_tet_mesh_name(const std::filesystem::path& path);

/// The kinds of file that a key of the mesh block, or an option of `livetet mesh`, applies to.
struct MeshKey {
    const char* option;  ///< option of the command; nullptr: none
    const char* key;     ///< key of the mesh block; nullptr: none
    std::initializer_list<MeshKind> kinds;
    bool (*given)(const MeshSource&);  ///< whether a mesh block sets it; nullptr without a key
    const char* flag = nullptr;        ///< the option is a flag: the choice that it takes
};
std::span<const MeshKey> mesh_keys();

/// Throws Error, naming the file, its kind and the `name` of the first `given` key that does not
/// apply to it.
void refuse_idle_keys(const std::filesystem::path& file,
                      const std::function<bool(const MeshKey&)>& given,
                      const std::function<std::string(const MeshKey&)>& name);

/// The same for a scene's mesh block.
void refuse_idle_keys(const MeshSource& source);

/// Throws Error if `source` asks for hexahedra and a key is `given` that tells only the mesher of
/// tetrahedra something; `name` as above.
void refuse_keys_of_tets(const MeshSource& source, const std::function<bool(const MeshKey&)>& given,
                         const std::function<std::string(const MeshKey&)>& name);

/// Throws Error, naming --metres, unless the nodes (metres) are those of a body from 1 mm to 10 m.
void check_size(std::span<const Vector3> nodes, const MeshSource& source);

}  // namespace livetet
