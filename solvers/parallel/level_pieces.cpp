#include "solvers/parallel/level_pieces.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>

#include "base/sort_and_unique.hpp"
#include "solvers/parallel/exchange.hpp"
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
    for (std::size_t e = 0; e < whole.tets.size(); e += whole.tets_per_element())
        pieces.all[pieces.of_node[whole.tets[e][0]]].tet = static_cast<std::int32_t>(e);
    return pieces;
}

namespace {

/// For each of the rank's own nodes the lowest node of its piece, by its number in the whole mesh.
std::vector<std::int32_t> lowest_nodes(const PartitionedMesh& share) {
    const std::vector<std::int32_t> local_piece = connected_pieces(local_mesh(share));
    std::vector<std::int32_t> lowest(share.nodes);  // by local pieces
    const SharedRows ghosts(share.comm, static_cast<std::size_t>(share.owned),
                            std::span(share.numbers).subspan(share.owned));
    std::vector<std::int32_t> of_own;
    for (bool changes = true; on_any_rank(share, changes);) {
        changes = false;
        const auto lower = [&](std::size_t i, std::int32_t n) {
            std::int32_t& of_piece = lowest[local_piece[i]];
            changes = changes || n < of_piece;
            of_piece = std::min(of_piece, n);
        };
        for (std::size_t i = 0; i < share.nodes.size(); ++i) lower(i, share.nodes[i]);
        const auto owned = static_cast<std::size_t>(share.owned);
        of_own.clear();
        for (std::size_t i = 0; i < owned; ++i) of_own.push_back(lowest[local_piece[i]]);
        const auto of_ghosts = ghosts.from_owners(std::span<const std::int32_t>(of_own));
        for (std::size_t g = 0; g < of_ghosts.size(); ++g) lower(owned + g, of_ghosts[g]);
    }
    return of_own;
}

}  // namespace

LevelPieces level_pieces(const PartitionedMesh& share) {
    LevelPieces pieces;
    pieces.of_node = lowest_nodes(share);
    std::vector<std::int32_t> names = pieces.of_node;  // lowest nodes
    sort_and_unique(names);
    names = of_all_ranks(share.comm, names);
    sort_and_unique(names);
    for (std::int32_t& piece : pieces.of_node)
        piece = static_cast<std::int32_t>(std::ranges::lower_bound(names, piece) - names.begin());

    // Of each piece the highest corner of its box, and the lowest one's opposite; the last tet.
    std::vector<double> boxes(6 * names.size(), -std::numeric_limits<double>::infinity());
    std::vector<std::int32_t> tets(names.size(), -1);
    for (std::size_t i = 0; i < pieces.of_node.size(); ++i)
        for (int c = 0; c < 3; ++c) {
            double* box = boxes.data() + 6 * pieces.of_node[i];
            box[c] = std::max(box[c], share.rest[i][c]);
            box[3 + c] = std::max(box[3 + c], -share.rest[i][c]);
        }
    for (std::size_t e = 0; e < share.tets.size(); ++e)
        for (const std::int32_t n : share.tets[e])
            if (n < share.owned) {
                std::int32_t& tet = tets[pieces.of_node[n]];
                tet = std::max(tet, share.tet_ids[e]);
            }
    MPI_Allreduce(MPI_IN_PLACE, boxes.data(), static_cast<int>(boxes.size()), MPI_DOUBLE, MPI_MAX,
                  share.comm);
    MPI_Allreduce(MPI_IN_PLACE, tets.data(), static_cast<int>(tets.size()), MPI_INT32_T, MPI_MAX,
                  share.comm);
    for (std::size_t p = 0; p < names.size(); ++p) {
        const Vector3 high(&boxes[6 * p]), low = -Vector3(&boxes[6 * p + 3]);
        pieces.all.push_back({.centre = (low + high) / 2,
                              .extent = (high - low).norm() / 2,
                              .node = names[p],
                              .tet = tets[p]});
    }
    return pieces;
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
