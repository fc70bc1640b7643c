#include "solvers/parallel/mesh_distribution.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <string>

#include "base/sort_and_unique.hpp"
#include "base/together.hpp"
#include "solvers/parallel/first_rank.hpp"
#include "solvers/parallel/node_values.hpp"
#include "solvers/parallel/partition.hpp"
#include "solvers/parallel/row_ranks.hpp"

namespace livetet {

HierarchyRows rows_of(MPI_Comm comm, const MeshHierarchy& whole) {
    int rank = 0, ranks = 1;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &ranks);
    return rows_of(whole, static_cast<std::size_t>(rank), static_cast<std::size_t>(ranks));
}

namespace {

/// Deals a hierarchy's tables out from the first rank. Its members are called in the same order on
/// every rank.
class Dealer {
  public:
    explicit Dealer(MPI_Comm comm) : comm_(comm) {}

    std::int64_t number(std::size_t of_first) const {
        auto n = static_cast<std::int64_t>(of_first);
        MPI_Bcast(&n, 1, MPI_INT64_T, 0, comm_);
        return n;
    }
    std::string text(const std::string& of_first) const { return same_on_all(comm_, of_first); }
    /// Each rank's rows of a table.
    template <class T>
    std::vector<T> rows(const std::vector<T>& table) const {
        return deal_rows(comm_, table);
    }
    std::vector<Vector3> rows(const std::vector<Vector3>& table) const {
        std::vector<std::array<double, 3>> plain;
        for (const Vector3& x : table) plain.push_back({x.x(), x.y(), x.z()});
        std::vector<Vector3> mine;
        for (const auto& x : rows(plain)) mine.emplace_back(x[0], x[1], x[2]);
        return mine;
    }
    template <class T>
    std::map<std::string, std::vector<T>> rows(
        const std::map<std::string, std::vector<T>>& sets) const {
        std::map<std::string, std::vector<T>> mine;
        const std::vector<T> none;
        auto set = sets.begin();
        for (std::int64_t left = number(sets.size()); left-- > 0;) {
            const bool here = set != sets.end();
            const std::string name = text(here ? set->first : "");
            const std::vector<T>& items = here ? set->second : none;
            mine[name] = rows(items);
            if (here) ++set;
        }
        return mine;
    }
    TetMesh rows(const TetMesh& mesh) const {
        TetMesh mine;
        mine.nodes = rows(mesh.nodes);
        mine.tets = rows(mesh.tets);
        mine.edge_nodes = rows(mesh.edge_nodes);
        mine.regions = rows(mesh.regions);
        mine.node_sets = rows(mesh.node_sets);
        mine.triangle_sets = rows(mesh.triangle_sets);
        return mine;
    }
    BarycentricMap rows(const BarycentricMap& map) const {
        return {rows(map.nodes), rows(map.weights), rows(map.distance)};
    }
    /// The same of each member of a list.
    template <class T>
    std::vector<T> rows_of_each(const std::vector<T>& list) const {
        std::vector<T> mine;
        const T none{};
        for (std::int64_t i = 0, count = number(list.size()); i < count; ++i) {
            const T& item = static_cast<std::size_t>(i) < list.size() ? list[i] : none;
            mine.push_back(rows(item));
        }
        return mine;
    }

  private:
    MPI_Comm comm_;
};

}  // namespace

HierarchyRows rows_from_first(MPI_Comm comm, const MeshHierarchy& whole) {
    const Dealer dealer(comm);
    HierarchyRows mine;
    mine.rows.levels = dealer.rows_of_each(whole.levels);
    mine.rows.transfers = dealer.rows_of_each(whole.transfers);
    mine.rows.parents = dealer.rows_of_each(whole.parents);
    mine.rows.provenance = dealer.text(whole.provenance);
    for (std::size_t l = 0; l < mine.rows.levels.size(); ++l) {
        const bool here = l < whole.levels.size();
        const auto nodes = dealer.number(here ? whole.levels[l].nodes.size() : 0),
                   tets = dealer.number(here ? whole.levels[l].tets.size() : 0);
        mine.sizes.push_back({static_cast<std::size_t>(nodes), static_cast<std::size_t>(tets)});
    }
    return mine;
}

namespace {

/// A tet on its way to the ranks that own its nodes.
struct TetRow {
    std::int32_t id = 0, region = 0;
    Tet corners{};
    std::array<std::int32_t, 6> edge_nodes{};
};

/// What the rows of a mesh have, on all ranks.
struct Kinds {
    Kinds(MPI_Comm comm, const TetMesh& rows) {
        std::uint8_t has[2] = {!rows.regions.empty(), !rows.edge_nodes.empty()};
        MPI_Allreduce(MPI_IN_PLACE, has, 2, MPI_UINT8_T, MPI_MAX, comm);
        regions = has[0];
        edges = has[1];
    }
    bool regions = false, edges = false;
};

/// The tets, in the whole mesh's numbers, that touch a node of this rank, by rising ids.
std::vector<TetRow> tets_at_own_nodes(MPI_Comm comm, const TetMesh& rows, const MeshSize& size,
                                      const std::vector<std::int32_t>& owners, const Kinds& kinds) {
    const NodeValues<std::int32_t> owner_of(comm, owners, rows.tets);
    const auto first = static_cast<std::int32_t>(row_range(comm, size.tets).first);
    std::vector<std::int32_t> to;
    std::vector<TetRow> tets;
    for (std::size_t e = 0; e < rows.tets.size(); ++e) {
        TetRow row{first + static_cast<std::int32_t>(e),
                   kinds.regions ? rows.regions[e] : 0,
                   rows.tets[e],
                   {}};
        if (kinds.edges) row.edge_nodes = rows.edge_nodes[e];
        std::array<std::int32_t, 4> around{};
        for (int k = 0; k < 4; ++k) around[k] = owner_of[row.corners[k]];
        std::ranges::sort(around);
        const auto end = std::ranges::unique(around).begin();
        for (auto owner = around.begin(); owner != end; ++owner) {
            to.push_back(*owner);
            tets.push_back(row);
        }
    }
    return exchange(comm, to, tets);
}

/// The rank's own nodes, with their places at rest.
void take_own_nodes(const TetMesh& rows, const std::vector<std::int32_t>& owners,
                    PartitionedMesh& share) {
    struct NodeRow {
        std::int32_t number;
        std::array<double, 3> at;
    };
    auto number = static_cast<std::int32_t>(row_range(share.comm, share.total).first);
    std::vector<NodeRow> nodes;
    for (const Vector3& x : rows.nodes) nodes.push_back({number++, {x.x(), x.y(), x.z()}});
    for (const NodeRow& n : exchange(share.comm, owners, nodes)) {
        share.nodes.push_back(n.number);
        share.rest.emplace_back(n.at[0], n.at[1], n.at[2]);
    }
    share.owned = static_cast<std::int32_t>(share.nodes.size());
}

/// The other nodes of the tets, behind the own ones, by rising PETSc numbers.
void take_ghosts(const TetMesh& rows, std::span<const TetRow> tets, bool has_edges,
                 PartitionedMesh& share) {
    std::vector<std::int32_t> ghosts;
    const auto mark = [&](std::int32_t n) {
        if (!std::ranges::binary_search(share.nodes, n)) ghosts.push_back(n);
    };
    for (const TetRow& t : tets) {
        std::ranges::for_each(t.corners, mark);
        if (has_edges) std::ranges::for_each(t.edge_nodes, mark);
    }
    sort_and_unique(ghosts);
    share.numbers = petsc_numbers(share, share.nodes);
    const std::vector<PetscInt> numbers = petsc_numbers(share, ghosts);
    std::vector<double> places;
    for (const Vector3& x : rows.nodes) places.insert(places.end(), x.begin(), x.end());
    places = RowBlocks(share.comm, share.total, ghosts).from_block(places, 3);
    std::vector<std::size_t> order(ghosts.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::sort(order, {}, [&](std::size_t i) { return numbers[i]; });
    for (const std::size_t i : order) {
        share.nodes.push_back(ghosts[i]);
        share.numbers.push_back(numbers[i]);
        share.rest.emplace_back(&places[3 * i]);
    }
}

/// The tets in local nodes.
void take_tets(std::span<const TetRow> tets, const Kinds& kinds, PartitionedMesh& share) {
    const LocalNumbers local(share);
    for (const TetRow& row : tets) {
        share.tet_ids.push_back(row.id);
        if (kinds.regions) share.regions.push_back(row.region);
        Tet& t = share.tets.emplace_back(row.corners);
        for (std::int32_t& n : t) n = local[n];
        if (!kinds.edges) continue;
        for (std::int32_t& n : share.edge_nodes.emplace_back(row.edge_nodes)) n = local[n];
    }
}

/// Corner nodes of the whole mesh: those before all edge nodes.
std::int32_t corners_of(MPI_Comm comm, const TetMesh& rows, const MeshSize& size) {
    auto first = static_cast<std::int32_t>(size.nodes);
    for (const auto& edges : rows.edge_nodes)
        for (const std::int32_t n : edges) first = std::min(first, n);
    MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT32_T, MPI_MIN, comm);
    return first;
}

}  // namespace

PartitionedMesh distribute_rows(MPI_Comm comm, const TetMesh& rows, const MeshSize& size,
                                std::span<const std::int32_t> parts, const std::string& where) {
    PartitionedMesh share;
    share.comm = comm;
    MPI_Comm_size(comm, &share.ranks);
    share.total = size.nodes;
    share.corners = corners_of(comm, rows, size);
    const Kinds kinds(comm, rows);
    const std::vector<std::int32_t> owners = node_owners(comm, rows, size, parts, where);
    const std::vector<TetRow> tets = tets_at_own_nodes(comm, rows, size, owners, kinds);
    take_own_nodes(rows, owners, share);
    take_ghosts(rows, tets, kinds.edges, share);
    take_tets(tets, kinds, share);
    together(comm, [&] { check_volumes(share.rest, share.tets, share.tet_ids, where); });
    return share;
}

BarycentricMap own_rows(const PartitionedMesh& share, const BarycentricMap& rows) {
    constexpr int numbers = 8;
    std::vector<double> packed;  // whole numbers, then weights
    for (std::size_t i = 0; i < rows.size(); ++i) {
        packed.insert(packed.end(), rows.nodes[i].begin(), rows.nodes[i].end());
        packed.insert(packed.end(), rows.weights[i].begin(), rows.weights[i].end());
    }
    const auto own = std::span(share.nodes).first(static_cast<std::size_t>(share.owned));
    packed = RowBlocks(share.comm, share.total, own).from_block(packed, numbers);
    BarycentricMap mine;
    for (const double* at = packed.data(); at < packed.data() + packed.size(); at += numbers) {
        auto& nodes = mine.nodes.emplace_back();
        auto& weights = mine.weights.emplace_back();
        for (int k = 0; k < 4; ++k) {
            nodes[k] = static_cast<std::int32_t>(at[k]);
            weights[k] = at[4 + k];
        }
    }
    return mine;
}

}  // namespace livetet
