#include "solvers/linear/coarse_body.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>

#include "mechanics/rigid_motions.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

CoarseBody::CoarseBody(const TetMesh& coarse, const TetMesh& fine,
                       const BarycentricMap& fine_in_coarse, const PartitionedMesh& share)
    : comm_(share.comm), is_shared_(share.ranks > 1) {
    // 1. pieces, numbered by their lowest nodes
    std::vector<std::int32_t> piece_of = connected_pieces(coarse);
    std::vector<Eigen::AlignedBox3d> boxes;
    for (std::size_t n = 0; n < piece_of.size(); ++n) {
        // The lowest node of a piece comes first.
        if (piece_of[n] == static_cast<std::int32_t>(n)) {
            piece_of[n] = static_cast<std::int32_t>(boxes.size());
            boxes.emplace_back();
        } else {
            piece_of[n] = piece_of[piece_of[n]];
        }
        boxes[piece_of[n]].extend(coarse.nodes[n]);
    }
    for (const Eigen::AlignedBox3d& box : boxes)
        pieces_.push_back(
            {box.center(), box.diagonal().norm() / 2, static_cast<std::int32_t>(pieces_.size())});

    // 2. a tet of each, and what this rank owns
    std::vector<std::size_t> tet_of(pieces_.size());
    for (std::size_t e = 0; e < coarse.tets.size(); ++e) tet_of[piece_of[coarse.tets[e][0]]] = e;
    for (std::int32_t i = 0; i < share.owned; ++i) {
        const std::int32_t n = share.nodes[i];
        places_.push_back(coarse.nodes[n]);
        piece_of_.push_back(piece_of[n]);
        const Tet& t = coarse.tets[tet_of[piece_of[n]]];
        if (std::ranges::find(t, n) != t.end()) pieces_[piece_of[n]].corners.push_back(i);
    }

    // 3. what hangs together in the fine mesh
    const std::vector<std::int32_t> fine_piece_of = connected_pieces(fine);
    const auto whole_of = [&](std::int32_t p) {
        while (pieces_[p].whole != p) p = pieces_[p].whole;
        return p;
    };
    for (std::size_t i = 0; i < fine_in_coarse.size(); ++i) {
        const std::int32_t a = whole_of(piece_of[fine_in_coarse.nodes[i][0]]),
                           b = whole_of(piece_of[fine_in_coarse.nodes[fine_piece_of[i]][0]]);
        pieces_[std::max(a, b)].whole = std::min(a, b);
    }
    for (Piece& piece : pieces_) piece.whole = whole_of(piece.whole);
}

/// What is held, by the fine nodes.
struct CoarseBody::Held {
    /// Four numbers a coarse node: its weight in all fine nodes, and in the constrained ones of
    /// each component.
    std::vector<double> weights;
    /// The rigid motions that are held of each piece, by the fine nodes in it, and of each whole.
    std::vector<RigidMotionConstraints> of_piece, of_whole;
};

std::vector<RigidMotionConstraints> CoarseBody::free_pieces() const {
    std::vector<RigidMotionConstraints> free;
    for (const Piece& piece : pieces_) free.emplace_back(piece.centre, piece.extent);
    return free;
}

void CoarseBody::sum(std::vector<RigidMotionConstraints>& pieces) const {
    if (!is_shared_) return;
    constexpr std::size_t numbers = 36;
    std::vector<double> grams;
    for (const RigidMotionConstraints& p : pieces)
        grams.insert(grams.end(), p.gram().data(), p.gram().data() + numbers);
    sum_over_ranks(comm_, grams);
    for (std::size_t p = 0; p < pieces.size(); ++p)
        pieces[p].set_gram(RigidMotionConstraints::Matrix6::Map(grams.data() + numbers * p));
}

CoarseBody::Held CoarseBody::held_by(const TransferRows& rows,
                                     std::span<const std::uint8_t> fine) const {
    constexpr double weight_of_one = 1e6;  // more than the weights of any node's neighbours
    const BarycentricMap& map = rows.map();
    const auto places = rows.to_columns<Vector3>(places_);
    const auto piece_of = rows.to_columns<std::int32_t>(piece_of_);
    Held held{std::vector<double>(4 * rows.columns(), 0), free_pieces(), free_pieces()};
    for (std::size_t i = 0; i < map.size(); ++i) {
        Vector3 place = Vector3::Zero();
        for (int k = 0; k < 4; ++k) {
            const std::int32_t n = map.nodes[i][k];
            const double w = map.mean_weight(i, k);
            double* sums = held.weights.data() + 4 * n;
            sums[0] += w;
            place += map.weights[i][k] * places[n];
            for (int c = 0; c < 3; ++c)
                if (fine[i] >> c & 1)
                    sums[1 + c] += w > 0.999 ? weight_of_one : w;  // the same node decides alone
        }
        if (!fine[i]) continue;
        const std::int32_t p = piece_of[map.nodes[i][0]];
        held.of_piece[p].constrain(place, fine[i]);
        held.of_whole[pieces_[p].whole].constrain(place, fine[i]);
    }
    held.weights = rows.sum_to_owners(std::move(held.weights), 4);
    sum(held.of_piece);
    sum(held.of_whole);
    return held;
}

std::vector<std::uint8_t> CoarseBody::constrained(const TransferRows& rows,
                                                  std::span<const std::uint8_t> fine) const {
    const Held held = held_by(rows, fine);
    std::vector<std::uint8_t> components(places_.size(), 0);
    // done: a smaller share would change nothing.
    std::vector<bool> is_held(pieces_.size(), false), done = is_held;
    for (const double share : {0.3, 0.1, 0.03, 0.01, 1e-6}) {
        std::vector<RigidMotionConstraints> of_coarse = free_pieces();
        for (std::size_t n = 0; n < places_.size(); ++n) {
            const std::int32_t p = piece_of_[n];
            const double* weights = held.weights.data() + 4 * n;
            if (!done[p])
                for (int c = 0; c < 3; ++c)
                    if (weights[1 + c] >= share * weights[0]) components[n] |= 1 << c;
            of_coarse[p].constrain(places_[n], components[n]);
        }
        sum(of_coarse);
        for (std::size_t p = 0; p < done.size(); ++p) {
            is_held[p] = of_coarse[p].constrains_all();
            done[p] = is_held[p] || !held.of_piece[p].constrains_all();
        }
        if (std::find(done.begin(), done.end(), false) == done.end()) break;
    }
    for (std::size_t p = 0; p < is_held.size(); ++p)
        if (!is_held[p] && held.of_whole[pieces_[p].whole].constrains_all())
            for (const std::int32_t n : pieces_[p].corners) components[n] = 7;
    return components;
}

}  // namespace livetet
