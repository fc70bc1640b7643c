#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "mechanics/rigid_motions.hpp"
#include "solvers/linear/transfer_rows.hpp"

namespace livetet {

/// Finds what is constrained on a coarse level: it knows the level's nodes and connected pieces.
/// Arrays are of this rank's own nodes; pieces are the same on all ranks.
class CoarseBody {
  public:
    /// `coarse`, `fine`: whole meshes; `fine_in_coarse` places the nodes of the fine one in the
    /// coarse one. None is kept.
    CoarseBody(const TetMesh& coarse, const TetMesh& fine, const BarycentricMap& fine_in_coarse,
               const PartitionedMesh& share);

    struct Piece {
        Vector3 centre;          ///< m
        double extent = 0;       ///< m: half of its box's diagonal
        std::int32_t whole = 0;  ///< the lowest of the pieces that hang together in the fine mesh
        std::vector<std::int32_t> corners{};  ///< of one of its tets: those that this rank owns
    };
    const std::vector<Piece>& pieces() const { return pieces_; }

    /// Which components of the coarse nodes are constrained if `fine` are (bits 0 to 2; of this
    /// rank's own nodes). A coarse component is constrained
    /// - if at least 0.3 of its weight in fine nodes is in constrained ones (of 0.05 to 0.95 the
    ///   value with the fewest iterations on an organ pressed at a patch);
    /// - if it has the place of a constrained fine node;
    /// - if it has no weight in any fine node: it would be an unknown without an equation.
    /// If a connected piece of the coarse mesh could then move as a rigid body, but the fine nodes
    /// in it are held, a smaller share suffices in that piece: a static matrix would be singular.
    /// If only the rest of the fine mesh holds a piece, one of its tets is constrained. Collective.
    std::vector<std::uint8_t> constrained(const TransferRows& rows,
                                          std::span<const std::uint8_t> fine) const;

  private:
    struct Held;
    Held held_by(const TransferRows& rows, std::span<const std::uint8_t> fine) const;
    std::vector<RigidMotionConstraints> free_pieces() const;
    /// Of each piece, what all ranks hold.
    void sum(std::vector<RigidMotionConstraints>& pieces) const;

    MPI_Comm comm_;
    bool is_shared_;  ///< by several ranks
    std::vector<Vector3> places_;
    std::vector<std::int32_t> piece_of_;
    std::vector<Piece> pieces_;
};

}  // namespace livetet
