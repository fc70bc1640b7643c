#include "solvers/parallel/level_pieces.hpp"

#include <Eigen/Geometry>

#include <limits>

#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

std::vector<RigidMotionConstraints> LevelPieces::unconstrained() const {
    std::vector<RigidMotionConstraints> free;
    for (const Piece& piece : all) free.emplace_back(piece.centre, piece.extent);
    return free;
}

LevelPieces level_pieces(const TetMesh& whole) {
    LevelPieces pieces;
    pieces.of_node = connected_pieces(whole);
    std::vector<Eigen::AlignedBox3d> boxes;
    for (std::size_t n = 0; n < pieces.of_node.size(); ++n) {
        std::int32_t& piece = pieces.of_node[n];
        // The lowest node of a piece comes first.
        if (piece == static_cast<std::int32_t>(n)) {
            piece = static_cast<std::int32_t>(boxes.size());
            boxes.emplace_back();
            pieces.all.push_back({.centre = {}, .node = static_cast<std::int32_t>(n), .tet = -1});
        } else {
            piece = pieces.of_node[piece];
        }
        boxes[piece].extend(whole.nodes[n]);
    }
    for (std::size_t p = 0; p < boxes.size(); ++p) {
        pieces.all[p].centre = boxes[p].center();
        pieces.all[p].extent = boxes[p].diagonal().norm() / 2;
    }
    // Of hexahedra the first tet, by which a share knows them.
    const std::size_t step = whole.hexahedra.empty() ? 1 : tets_per_hexahedron;
    for (std::size_t e = 0; e < whole.tets.size(); e += step)
        pieces.all[pieces.of_node[whole.tets[e][0]]].tet = static_cast<std::int32_t>(e);
    return pieces;
}

LevelPieces of_own_nodes(LevelPieces whole, const PartitionedMesh& share) {
    if (share.ranks == 1) return whole;
    std::vector<std::int32_t> own;
    for (const std::int32_t n : std::span(share.nodes).first(share.owned))
        own.push_back(whole.of_node[n]);
    return {std::move(whole.all), std::move(own)};
}

LevelPieces pieces_of_finer(LevelPieces coarse, const PartitionedMesh& fine,
                            const BarycentricMap& in_coarse, int tets_of_one) {
    std::vector<std::int32_t> lowest(coarse.all.size(), std::numeric_limits<std::int32_t>::max());
    std::vector<std::int32_t> of_node;
    for (std::size_t i = 0; i < in_coarse.size(); ++i) {
        const std::int32_t p = coarse.of_node[in_coarse.nodes[i][0]];
        of_node.push_back(p);
        lowest[p] = std::min(lowest[p], fine.nodes[i]);
    }
    MPI_Allreduce(MPI_IN_PLACE, lowest.data(), static_cast<int>(lowest.size()), MPI_INT32_T,
                  MPI_MIN, fine.comm);
    for (std::size_t p = 0; p < lowest.size(); ++p) {
        coarse.all[p].node = lowest[p];
        if (coarse.all[p].tet >= 0) coarse.all[p].tet *= tets_of_one;
    }
    return {std::move(coarse.all), std::move(of_node)};
}

void sum_over_ranks(MPI_Comm comm, std::vector<RigidMotionConstraints>& pieces) {
    if (comm == MPI_COMM_SELF) return;
    constexpr std::size_t numbers = 36;
    std::vector<double> grams;
    for (const RigidMotionConstraints& p : pieces)
        grams.insert(grams.end(), p.gram().data(), p.gram().data() + numbers);
    sum_over_ranks(comm, grams);
    for (std::size_t p = 0; p < pieces.size(); ++p)
        pieces[p].set_gram(RigidMotionConstraints::Matrix6::Map(grams.data() + numbers * p));
}

}  // namespace livetet
