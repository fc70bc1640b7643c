#pragma once

#include <mpi.h>

#include <cstdint>
#include <span>

#include "base/lists.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The neighbours, with which it shares three nodes, of each tet of this rank's rows of a mesh that
/// ranks share (see HierarchyRows): numbers in the whole mesh, rising. Tets meet at their faces, at
/// the rank in whose rows a face's lowest node is. Collective.
Lists tet_neighbours(MPI_Comm comm, std::span<const Tet> rows, const MeshSize& whole);

}  // namespace livetet
