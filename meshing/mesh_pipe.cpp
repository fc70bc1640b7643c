#include "meshing/mesh_pipe.hpp"

#include <cstdio>

#include "base/child_process.hpp"
#include "mesh/packed_mesh.hpp"

namespace livetet {

bool write_mesh(int descriptor, const TetMesh& mesh) {
    const std::vector<char> bytes = packed(mesh);
    const bool written = write_all(descriptor, bytes.data(), bytes.size());
    if (!written) std::fprintf(stderr, "Error   : the temporary folder is full\n");
    return written;
}

}  // namespace livetet
