#include "solvers/parallel/local_sets.hpp"

#include <algorithm>
#include <functional>
#include <set>

#include "base/error.hpp"
#include "base/together.hpp"
#include "solvers/parallel/row_ranks.hpp"

namespace livetet {

namespace {

/// Sends what names nodes to other ranks: by the rows of the mesh that the nodes are in, or by
/// their owners.
class SetsOfRanks {
  public:
    explicit SetsOfRanks(const PartitionedMesh& share)
        : share_(share), rows_(share.comm, share.total) {
        int rank = 0;
        MPI_Comm_rank(share.comm, &rank);
        const std::vector<double> own(static_cast<std::size_t>(share.owned), rank);
        owners_ = RowBlocks(share.comm, share.total,
                            std::span(share.nodes).first(static_cast<std::size_t>(share.owned)))
                      .to_block(own, 1);
    }
    std::vector<std::int32_t> nodes_here(const std::vector<std::int32_t>& set) const;
    std::vector<Triangle> triangles_here(const std::vector<Triangle>& set) const;

  private:
    const PartitionedMesh& share_;
    RowRanks rows_;
    std::vector<double> owners_;  ///< of the nodes of this rank's rows
};

/// The local nodes of a set, from some of its members on each rank.
std::vector<std::int32_t> SetsOfRanks::nodes_here(const std::vector<std::int32_t>& set) const {
    std::vector<std::uint8_t> is_in(rows_.here().size(), 0);
    for (const std::int32_t n : rows_.send(set, std::identity())) is_in[rows_.place(n)] = 1;
    const auto local = RowBlocks(share_.comm, share_.total, share_.nodes)
                           .from_block(std::span<const std::uint8_t>(is_in), 1);
    std::vector<std::int32_t> nodes;
    for (std::size_t i = 0; i < local.size(); ++i)
        if (local[i]) nodes.push_back(static_cast<std::int32_t>(i));
    return nodes;
}

/// The triangles with an own node, in the whole mesh's nodes.
std::vector<Triangle> SetsOfRanks::triangles_here(const std::vector<Triangle>& set) const {
    std::vector<std::int32_t> corners, to;
    for (const Triangle& t : set) corners.insert(corners.end(), t.begin(), t.end());
    const std::vector<double> owners =
        RowBlocks(share_.comm, share_.total, corners).from_block(owners_, 1);
    std::vector<Triangle> triangles;
    for (std::size_t i = 0; i < set.size(); ++i) {
        std::set<std::int32_t> ranks;
        for (std::size_t k = 3 * i; k < 3 * i + 3; ++k)
            ranks.insert(static_cast<std::int32_t>(owners[k]));
        for (const std::int32_t r : ranks) {
            to.push_back(r);
            triangles.push_back(set[i]);
        }
    }
    return exchange(share_.comm, to, triangles);
}

void check_nodes(const std::string& name, std::span<const std::int32_t> nodes, std::size_t total) {
    for (const std::int32_t n : nodes)
        if (n < 0 || static_cast<std::size_t>(n) >= total)
            fail("set {}: names node {}, expected 0 to {}", name, n,
                 static_cast<std::int64_t>(total) - 1);
}

/// All tets at own nodes are local, so that a triangle with an own node must be a face of one.
/// `triangles`: in the whole mesh's nodes.
void check_faces(const PartitionedMesh& share, const std::string& name,
                 const std::vector<Triangle>& triangles) {
    const auto sorted = [](Triangle t) {
        std::ranges::sort(t);
        return t;
    };
    std::set<std::int32_t> corners;
    std::set<Triangle> wanted;
    for (const Triangle& t : triangles) {
        wanted.insert(sorted(t));
        corners.insert(t.begin(), t.end());
    }
    std::vector<bool> is_corner;
    for (const std::int32_t n : share.nodes) is_corner.push_back(corners.contains(n));
    for (const Tet& t : share.tets) {
        if (std::ranges::count_if(t, [&](std::int32_t n) { return is_corner[n]; }) < 3) continue;
        for (int i = 0; i < 4; ++i)  // the face opposite to corner i
            wanted.erase(sorted({share.nodes[t[(i + 1) % 4]], share.nodes[t[(i + 2) % 4]],
                                 share.nodes[t[(i + 3) % 4]]}));
    }
    if (wanted.empty()) return;
    const Triangle& t = *wanted.begin();
    fail("set {}: found a triangle {}, {}, {}, expected faces of the mesh's tets", name, t[0], t[1],
         t[2]);
}

}  // namespace

LocalSets local_sets(const TetMesh& rows, const PartitionedMesh& share) {
    const SetsOfRanks ranks(share);
    const LocalNumbers local(share);
    LocalSets sets;
    for (const auto& [name, nodes] : rows.node_sets) {
        together(share.comm, [&] { check_nodes(name, nodes, share.total); });
        sets.nodes[name] = ranks.nodes_here(nodes);
    }
    for (const auto& [name, triangles] : rows.triangle_sets) {
        together(share.comm, [&] {
            for (const Triangle& t : triangles) check_nodes(name, t, share.total);
        });
        const std::vector<Triangle> here = ranks.triangles_here(triangles);
        together(share.comm, [&] { check_faces(share, name, here); });
        std::vector<Triangle>& set = sets.triangles[name];
        for (const Triangle& t : here) set.push_back({local[t[0]], local[t[1]], local[t[2]]});
    }
    return sets;
}

}  // namespace livetet
