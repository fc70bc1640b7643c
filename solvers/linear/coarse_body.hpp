#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "solvers/linear/transfer_rows.hpp"
#include "solvers/parallel/level_pieces.hpp"

namespace livetet {

/// Finds what is constrained on a coarse level: it knows the level's nodes and connected pieces.
/// Arrays are of this rank's own nodes; pieces are the same on all ranks.
class CoarseBody {
  public:
    /// `pieces`: of the coarse level's own nodes. `wholes`: see pieces_joined_by; empty: the fine
    /// mesh has the same pieces. `share`: of the coarse level; it is not kept.
    CoarseBody(LevelPieces pieces, std::vector<std::int32_t> wholes, const PartitionedMesh& share);

    /// For each piece the lowest of those that hang together in the fine mesh.
    const std::vector<std::int32_t>& wholes() const { return wholes_; }

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

    MPI_Comm comm_;
    std::vector<Vector3> places_;
    LevelPieces pieces_;
    std::vector<std::int32_t> wholes_;
    std::vector<std::vector<std::int32_t>> corners_;  ///< of a tet of each piece: own nodes
};

/// For each piece of a coarse mesh the lowest of those that hang together in the fine one, whose
/// nodes `rows` places in the coarse one; of both the rank's own nodes. Collective.
std::vector<std::int32_t> pieces_joined_by(MPI_Comm comm, const LevelPieces& fine,
                                           const LevelPieces& coarse, const TransferRows& rows);

}  // namespace livetet
