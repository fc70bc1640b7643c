#pragma once

#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// This rank's rows of a file's mesh (see write_mesh): an equal block of nodes and of tets in the
/// order of the whole mesh, and of each set what belongs to it. `mesh`: the local mesh of `share`
/// with its sets; `tets`: of the whole mesh. Collective.
TetMesh rows_of_file(const TetMesh& mesh, const PartitionedMesh& share, std::size_t tets);

}  // namespace livetet
