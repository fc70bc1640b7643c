#pragma once

#include <cstdint>
#include <vector>

#include "mechanics/rigid_motions.hpp"
#include "mesh/barycentric_map.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// The connected pieces of a level's mesh, the same on all ranks, and which of them nodes are in.
struct LevelPieces {
    struct Piece {
        Vector3 centre;         ///< of its box, m
        double extent = 0;      ///< half of the box's diagonal, m
        std::int32_t node = 0;  ///< its lowest, in the whole mesh
        std::int32_t tet = 0;   ///< one of its tets, in the whole mesh
    };
    std::vector<Piece> all;             ///< by rising lowest nodes
    std::vector<std::int32_t> of_node;  ///< the piece of each node

    /// Of each piece: nothing is held.
    std::vector<RigidMotionConstraints> unconstrained() const;
};

/// Of a whole mesh and its nodes. On one rank or on each.
LevelPieces level_pieces(const TetMesh& whole);

/// The same of a mesh of tets that ranks share, with the nodes that this rank owns: each rank finds
/// the pieces of its own part, then neighbours agree on the lowest node of each, as often as a
/// piece goes from rank to rank. Collective.
LevelPieces level_pieces(const PartitionedMesh& share);

/// Of a level that is cut from, or is the quadratic form of, the one of `coarse`, whose pieces its
/// own are. `in_coarse`: first, for each own node, a coarse own node of the same piece;
/// `tets_of_one`: fine tets of each coarse one. Collective.
LevelPieces pieces_of_finer(LevelPieces coarse, const PartitionedMesh& fine,
                            const BarycentricMap& in_coarse, int tets_of_one);

/// What all ranks hold of each piece, from what each does. Collective.
void sum_over_ranks(MPI_Comm comm, std::vector<RigidMotionConstraints>& pieces);

}  // namespace livetet
