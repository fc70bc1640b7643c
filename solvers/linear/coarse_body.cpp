#include "solvers/linear/coarse_body.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "base/disjoint_sets.hpp"
#include "solvers/parallel/exchange.hpp"

namespace livetet {

std::vector<std::int32_t> pieces_joined_by(MPI_Comm comm, const LevelPieces& fine,
                                           const LevelPieces& coarse, const TransferRows& rows) {
    using Pair = std::array<std::int32_t, 2>;  // pieces, fine and coarse, that share a place
    const auto coarse_piece_of = rows.to_columns<std::int32_t>(coarse.of_node);
    std::set<Pair> here;
    for (std::size_t i = 0; i < fine.of_node.size(); ++i)
        here.insert({fine.of_node[i], coarse_piece_of[rows.map().nodes[i][0]]});
    const std::vector<Pair> all = of_all_ranks(comm, std::vector<Pair>(here.begin(), here.end()));
    std::vector<std::int32_t> first(fine.all.size(), -1);  // a coarse piece of each fine one
    DisjointSets sets(coarse.all.size());
    for (const auto& [of_fine, of_coarse] : all) {
        if (first[of_fine] < 0) first[of_fine] = of_coarse;
        sets.join(first[of_fine], of_coarse);
    }
    std::vector<std::int32_t> wholes;
    for (std::size_t p = 0; p < coarse.all.size(); ++p)
        wholes.push_back(sets.find(static_cast<std::int32_t>(p)));
    return wholes;
}

CoarseBody::CoarseBody(LevelPieces pieces, std::vector<std::int32_t> wholes,
                       const PartitionedMesh& share)
    : comm_(share.ranks > 1 ? share.comm : MPI_COMM_SELF),
      places_(share.rest.begin(), share.rest.begin() + share.owned),
      pieces_(std::move(pieces)),
      wholes_(std::move(wholes)),
      corners_(pieces_.all.size()) {
    if (wholes_.empty()) {
        wholes_.resize(pieces_.all.size());
        std::iota(wholes_.begin(), wholes_.end(), 0);
    }
    std::map<std::int32_t, std::size_t> piece_of_tet;
    for (std::size_t p = 0; p < pieces_.all.size(); ++p)
        piece_of_tet.emplace(pieces_.all[p].tet, p);
    for (std::size_t e = 0; e < share.tets.size(); ++e)
        if (const auto found = piece_of_tet.find(share.tet_ids[e]); found != piece_of_tet.end())
            for (const std::int32_t n : share.tets[e])
                if (n < share.owned) corners_[found->second].push_back(n);
}

/// What is held, by the fine nodes.
struct CoarseBody::Held {
    /// Four numbers a coarse node: its weight in all fine nodes, and in the constrained ones of
    /// each component.
    std::vector<double> weights;
    /// The rigid motions that are held of each piece, by the fine nodes in it, and of each whole.
    std::vector<RigidMotionConstraints> of_piece, of_whole;
};

CoarseBody::Held CoarseBody::held_by(const TransferRows& rows,
                                     std::span<const std::uint8_t> fine) const {
    constexpr double weight_of_one = 1e6;  // more than the weights of any node's neighbours
    const BarycentricMap& map = rows.map();
    const auto places = rows.to_columns<Vector3>(places_);
    const auto piece_of = rows.to_columns<std::int32_t>(pieces_.of_node);
    Held held{std::vector<double>(4 * rows.columns(), 0), pieces_.unconstrained(),
              pieces_.unconstrained()};
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
        held.of_whole[wholes_[p]].constrain(place, fine[i]);
    }
    held.weights = rows.sum_to_owners(std::move(held.weights), 4);
    sum_over_ranks(comm_, held.of_piece);
    sum_over_ranks(comm_, held.of_whole);
    return held;
}

std::vector<std::uint8_t> CoarseBody::constrained(const TransferRows& rows,
                                                  std::span<const std::uint8_t> fine) const {
    const Held held = held_by(rows, fine);
    std::vector<std::uint8_t> components(places_.size(), 0);
    // done: a smaller share would change nothing.
    std::vector<bool> is_held(pieces_.all.size(), false), done = is_held;
    for (const double share : {0.3, 0.1, 0.03, 0.01, 1e-6}) {
        std::vector<RigidMotionConstraints> of_coarse = pieces_.unconstrained();
        for (std::size_t n = 0; n < places_.size(); ++n) {
            const std::int32_t p = pieces_.of_node[n];
            const double* weights = held.weights.data() + 4 * n;
            if (!done[p])
                for (int c = 0; c < 3; ++c)
                    if (weights[1 + c] >= share * weights[0]) components[n] |= 1 << c;
            of_coarse[p].constrain(places_[n], components[n]);
        }
        sum_over_ranks(comm_, of_coarse);
        for (std::size_t p = 0; p < done.size(); ++p) {
            is_held[p] = of_coarse[p].constrains_all();
            done[p] = is_held[p] || !held.of_piece[p].constrains_all();
        }
        if (std::find(done.begin(), done.end(), false) == done.end()) break;
    }
    for (std::size_t p = 0; p < is_held.size(); ++p)
        if (!is_held[p] && held.of_whole[wholes_[p]].constrains_all())
            for (const std::int32_t n : corners_[p]) components[n] = 7;
    return components;
}

}  // namespace livetet
