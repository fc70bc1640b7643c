#pragma once

#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"
#include "meshing/child_process.hpp"

namespace livetet {

/// Nodes, tets and regions for the parent of a child process; false, said on stderr, where the system refuses.
bool write_mesh(int descriptor, const TetMesh& mesh);

/// What `write_mesh` wrote. Throws Error, naming `who`, where the bytes are too few or too many.
TetMesh read_mesh(const std::vector<char>& bytes, const std::string& who);

/// In a few words why a child gave no mesh: its end, or its last error lines. `time_limit_s`: what it had.
std::string end_text(const ChildResult& child, double time_limit_s);

/// The last of a log's error lines, else of its lines, for a message of one line.
std::string last_words(const std::string& log);

}  // namespace livetet
