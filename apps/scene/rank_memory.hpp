#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Tets that a rank should have at least: with fewer, ranks wait for each other longer than they
/// work.
constexpr std::size_t worthwhile_tets_a_rank = 5000;

/// A level of a solve by multigrid, and the memory that it takes on one rank.
struct LevelSize {
    std::size_t tets = 0, nodes = 0;
    double bytes = 0;       ///< operator, elements, vectors: what ranks share
    double mesh_bytes = 0;  ///< the mesh with its transfer
};

/// The size of a level, its memory estimated from the numbers of its blocks, tets and nodes;
/// `has_matrix`: whether its operator is one.
LevelSize size_of_level(const TetMesh& mesh, bool has_matrix);

/// The largest rank's memory in `solve`, bytes, estimated.
struct RankMemory {
    double own = 0;  ///< its share of the levels, with the nodes and tets that it shares
    /// What the mesh as it was read adds to the peak: of several ranks the first partitions it, by
    /// METIS, before it has most of its own; one rank keeps it to the end.
    double whole = 0;
    double program = 0;  ///< what the program takes for nothing
    double sum() const { return own + whole + program; }
};

/// The memory of a solve on so many ranks; `levels`: the finest first. Several ranks make the first
/// `of_ranks` of them from their own parts (refinements, ten-node tets). `tets_of_metis`: those
/// that the first rank has for METIS; none if PTScotch partitions them. Corotated boxes of
/// 1.4 million P1 tets took what this says on 1 and 4 ranks, within a tenth; those of small strain,
/// without a matrix, a sixth less.
RankMemory memory_of_rank(std::span<const LevelSize> levels, int ranks, int of_ranks,
                          std::size_t tets_of_metis);

}  // namespace livetet
