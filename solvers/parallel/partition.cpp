#include "solvers/parallel/partition.hpp"

#include <metis.h>

#include <petscmat.h>

#include <algorithm>
#include <stdexcept>
#include <tuple>

#include "base/error.hpp"
#include "base/together.hpp"
#include "solvers/parallel/dual_graph.hpp"
#include "solvers/parallel/first_rank.hpp"
#include "solvers/parallel/mesh_distribution.hpp"
#include "solvers/parallel/node_values.hpp"
#include "solvers/parallel/row_ranks.hpp"

namespace livetet {

namespace {

const char* metis_text(int code) {
    switch (code) {
        case METIS_ERROR_INPUT:
            return "erroneous input";
        case METIS_ERROR_MEMORY:
            return "not enough memory";
        default:
            return "no further word";
    }
}

}  // namespace

std::vector<std::int32_t> partition_tets(std::span<const Tet> tets, int parts) {
    if (parts < 1) fail("partition: {} parts, expected at least 1", parts);
    if (tets.size() < static_cast<std::size_t>(parts))
        fail("partition: {} parts of {} tets, expected no more parts than tets", parts,
             tets.size());
    std::vector<std::int32_t> part(tets.size(), 0);
    if (parts == 1) return part;

    std::vector<idx_t> first, corners;
    idx_t node_count = 0;
    for (const Tet& t : tets) {
        first.push_back(static_cast<idx_t>(corners.size()));
        for (const std::int32_t n : t) {
            if (n < 0) fail("partition: a tet names node {}, expected >= 0", n);
            corners.push_back(n);
            node_count = std::max(node_count, static_cast<idx_t>(n) + 1);
        }
    }
    first.push_back(static_cast<idx_t>(corners.size()));

    idx_t tet_count = static_cast<idx_t>(tets.size()), shared_nodes = 3, part_count = parts,
          cut = 0;
    idx_t options[METIS_NOPTIONS];
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_SEED] = 1;
    options[METIS_OPTION_NUMBERING] = 0;
    std::vector<idx_t> tet_part(tets.size()), node_part(node_count);
    const int code = METIS_PartMeshDual(&tet_count, &node_count, first.data(), corners.data(),
                                        nullptr, nullptr, &shared_nodes, &part_count, nullptr,
                                        options, &cut, tet_part.data(), node_part.data());
    if (code != METIS_OK)
        throw std::runtime_error(
            fmt::format("METIS_PartMeshDual failed with code {} ({}) on {} tets, {} parts", code,
                        metis_text(code), tets.size(), parts));
    std::copy(tet_part.begin(), tet_part.end(), part.begin());
    return part;
}

std::vector<std::int32_t> partition_tets_in_parallel(MPI_Comm comm, std::span<const Tet> rows,
                                                     const MeshSize& whole, int parts) {
    // PETSc hands over its arrays as they are: Debian's of 64 bits to a PTScotch of 32.
    if (sizeof(PetscInt) > sizeof(std::int32_t))
        fail("solver.partitioner = ptscotch: PETSc has 64-bit indices here, expected metis");
    if (parts == 1) return std::vector<std::int32_t>(rows.size(), 0);
    const Lists neighbours = tet_neighbours(comm, rows, whole);
    PetscInt *starts = nullptr, *columns = nullptr;  // freed by the matrix
    LIVETET_PETSC(PetscMalloc1(neighbours.start.size(), &starts));
    LIVETET_PETSC(PetscMalloc1(neighbours.items.size(), &columns));
    std::ranges::copy(neighbours.start, starts);
    std::ranges::copy(neighbours.items, columns);
    PetscHandle<Mat> graph;
    LIVETET_PETSC(MatCreateMPIAdj(comm, static_cast<PetscInt>(rows.size()),
                                  static_cast<PetscInt>(whole.tets), starts, columns, nullptr,
                                  graph.out()));
    PetscHandle<MatPartitioning> partitioning;
    LIVETET_PETSC(MatPartitioningCreate(comm, partitioning.out()));
    LIVETET_PETSC(MatPartitioningSetAdjacency(partitioning.get(), graph.get()));
    LIVETET_PETSC(MatPartitioningSetType(partitioning.get(), MATPARTITIONINGPTSCOTCH));
    LIVETET_PETSC(MatPartitioningSetNParts(partitioning.get(), parts));
    PetscHandle<IS> of_rows;
    LIVETET_PETSC(MatPartitioningApply(partitioning.get(), of_rows.out()));
    const PetscInt* found = nullptr;
    LIVETET_PETSC(ISGetIndices(of_rows.get(), &found));
    std::vector<std::int32_t> mine(found, found + rows.size());
    LIVETET_PETSC(ISRestoreIndices(of_rows.get(), &found));
    return mine;
}

namespace {

/// That so many tets at a node are in a part.
struct Vote {
    std::int32_t node, part, count;
};

/// For each corner of some tets the number of these in each part.
std::vector<Vote> votes_of(std::span<const Tet> tets, std::span<const std::int32_t> parts) {
    std::vector<std::pair<std::int32_t, std::int32_t>> single;
    single.reserve(4 * tets.size());
    for (std::size_t e = 0; e < tets.size(); ++e)
        for (const std::int32_t n : tets[e]) single.emplace_back(n, parts[e]);
    std::ranges::sort(single);
    std::vector<Vote> votes;
    for (const auto& [node, part] : single)
        if (!votes.empty() && votes.back().node == node && votes.back().part == part)
            ++votes.back().count;
        else
            votes.push_back({node, part, 1});
    return votes;
}

/// The owners of edge nodes: those of their edges' lower ends.
void add_edge_owners(MPI_Comm comm, const TetMesh& rows, const RowRanks& ranks,
                     std::vector<std::int32_t>& owners) {
    struct Edge {
        std::int32_t node, owner;
    };
    const NodeValues<std::int32_t> of_corner(comm, owners, rows.tets);
    std::vector<Edge> edges;
    for (std::size_t e = 0; e < rows.edge_nodes.size(); ++e)
        for (int k = 0; k < 6; ++k)
            edges.push_back(
                {rows.edge_nodes[e][k], of_corner[std::min(rows.tets[e][tet_edges[k][0]],
                                                           rows.tets[e][tet_edges[k][1]])]});
    for (const Edge& edge : ranks.send(edges, &Edge::node))
        owners[ranks.place(edge.node)] = edge.owner;
}

}  // namespace

std::vector<std::int32_t> node_owners(MPI_Comm comm, const TetMesh& rows, const MeshSize& whole,
                                      std::span<const std::int32_t> parts,
                                      const std::string& where) {
    const RowRanks ranks(comm, whole.nodes);
    std::vector<Vote> votes = ranks.send(votes_of(rows.tets, parts), &Vote::node);
    std::ranges::sort(votes, {}, [](const Vote& v) { return std::pair(v.node, v.part); });
    std::vector<std::int32_t> owners(ranks.here().size(), -1);
    std::int32_t most = 0;
    for (auto vote = votes.begin(); vote != votes.end();) {
        std::int32_t count = 0;
        const Vote first = *vote;
        for (; vote != votes.end() && vote->node == first.node && vote->part == first.part; ++vote)
            count += vote->count;
        std::int32_t& owner = owners[ranks.place(first.node)];
        if (owner >= 0 && count <= most) continue;
        owner = first.part;
        most = count;
    }
    std::uint8_t has_edges = !rows.edge_nodes.empty();
    MPI_Allreduce(MPI_IN_PLACE, &has_edges, 1, MPI_UINT8_T, MPI_MAX, comm);
    if (has_edges) add_edge_owners(comm, rows, ranks, owners);
    together(comm, [&] {
        if (const auto none = std::ranges::find(owners, -1); none != owners.end())
            fail("{}: node {} belongs to no tet", where,
                 ranks.here().first + static_cast<std::size_t>(none - owners.begin()));
    });
    return owners;
}

namespace {

/// By METIS, which needs several times the memory of the mesh, on the first rank.
std::vector<std::int32_t> partition_on_first(MPI_Comm comm, std::span<const Tet> rows, int parts) {
    const std::vector<Tet> mine(rows.begin(), rows.end());
    const std::vector<Tet> all = exchange(comm, std::vector<std::int32_t>(rows.size(), 0), mine);
    std::vector<std::int32_t> part;
    on_first_rank(comm, [&] { part = partition_tets(all, parts); });
    return deal_rows(comm, part);
}

/// What stands for a coarse node: a fine node with a weight in it.
struct Nearest {
    std::int32_t node, fine, part;
    float weight;
    /// Whether it is nearer than another.
    bool operator<(const Nearest& other) const {
        return std::tuple(node, -weight, fine) < std::tuple(other.node, -other.weight, other.fine);
    }
};

/// The nearest of each coarse node alone.
void keep_nearest(std::vector<Nearest>& all) {
    std::ranges::sort(all, std::less<>());
    const auto rest = std::ranges::unique(all, {}, &Nearest::node);
    all.erase(rest.begin(), rest.end());
}

/// Of four corners' parts the most frequent, of several the first; -1 if they have none.
std::int32_t most_frequent(const std::array<std::int32_t, 4>& parts) {
    std::int32_t part = -1;
    std::ptrdiff_t most = 0;
    for (const std::int32_t p : parts)
        if (const auto count = std::ranges::count(parts, p); p >= 0 && count > most) {
            most = count;
            part = p;
        }
    return part;
}

/// Parts of a coarse level's tets: of the four corners' parts the most frequent, the part of a
/// corner being that of the fine node with the highest weight in it. `owners`: of the fine nodes.
/// `lower` maps the fine level's parts to those of the coarse one, which may have fewer.
template <class Lower>
std::vector<std::int32_t> projected_parts(MPI_Comm comm, std::span<const std::int32_t> owners,
                                          const MeshSize& fine,
                                          const BarycentricMap& fine_in_coarse,
                                          std::span<const Tet> coarse, const MeshSize& whole,
                                          Lower&& lower) {
    const std::size_t first = row_range(comm, fine.nodes).first;
    std::vector<Nearest> nearest;
    for (std::size_t i = 0; i < fine_in_coarse.size(); ++i)
        for (int k = 0; k < 4; ++k)
            if (const auto weight = static_cast<float>(fine_in_coarse.weights[i][k]); weight > 0)
                nearest.push_back({fine_in_coarse.nodes[i][k], static_cast<std::int32_t>(first + i),
                                   lower(owners[i]), weight});
    keep_nearest(nearest);
    const RowRanks ranks(comm, whole.nodes);
    nearest = ranks.send(nearest, &Nearest::node);
    keep_nearest(nearest);
    std::vector<std::int32_t> of_rows(ranks.here().size(), -1);
    for (const Nearest& n : nearest) of_rows[ranks.place(n.node)] = n.part;

    const NodeValues<std::int32_t> part_of_node(comm, of_rows, coarse);
    std::vector<std::int32_t> parts;
    parts.reserve(coarse.size());
    for (const Tet& t : coarse) {
        const std::int32_t part = most_frequent(
            {part_of_node[t[0]], part_of_node[t[1]], part_of_node[t[2]], part_of_node[t[3]]});
        // No fine node lies around it: a neighbour's part, which comes before it.
        parts.push_back(part >= 0 ? part : parts.empty() ? 0 : parts.back());
    }
    return parts;
}

/// Whether each level is cut from the next one, on every rank.
std::vector<std::uint8_t> cut_levels(MPI_Comm comm, const MeshHierarchy& rows) {
    std::vector<std::uint8_t> is_cut;
    for (std::size_t l = 0; l < rows.levels.size(); ++l) is_cut.push_back(rows.is_cut(l));
    MPI_Allreduce(MPI_IN_PLACE, is_cut.data(), static_cast<int>(is_cut.size()), MPI_UINT8_T,
                  MPI_MAX, comm);
    return is_cut;
}

}  // namespace

std::vector<std::vector<std::int32_t>> partition_levels(MPI_Comm comm,
                                                        const HierarchyRows& hierarchy,
                                                        Partitioner partitioner) {
    int ranks = 1;
    MPI_Comm_size(comm, &ranks);
    const std::vector<TetMesh>& levels = hierarchy.rows.levels;
    const std::vector<MeshSize>& sizes = hierarchy.sizes;
    std::vector<std::vector<std::int32_t>> parts(levels.size());
    const auto worthwhile = [&](std::size_t l) {
        return static_cast<int>(
            std::clamp<std::size_t>(sizes[l].tets / min_tets_per_rank, 1, ranks));
    };
    const std::vector<std::uint8_t> is_cut = cut_levels(comm, hierarchy.rows);
    std::size_t first = 0;
    while (is_cut[first] && worthwhile(first) == worthwhile(first + 1)) ++first;
    const int most = worthwhile(first);
    const std::vector<Tet>& rows = levels[first].tets;
    if (resolved_partitioner(partitioner, sizes[first].tets) == Partitioner::metis)
        parts[first] = partition_on_first(comm, rows, most);
    else
        parts[first] = partition_tets_in_parallel(comm, rows, sizes[first], most);
    for (std::size_t l = first; l-- > 0;) {
        const std::vector<std::int32_t>& parents = hierarchy.rows.parents[l];
        parts[l] = RowBlocks(comm, sizes[l + 1].tets, parents)
                       .from_block(std::span<const std::int32_t>(parts[l + 1]), 1);
    }
    for (std::size_t l = first + 1; l < levels.size(); ++l) {
        // Successive parts together, on the first rank of them: METIS and PTScotch number them by
        // bisection, so that they are neighbours.
        const auto lower = [most, fewer = worthwhile(l)](std::int32_t part) {
            const std::int64_t group = std::int64_t{part} * fewer / most;
            return static_cast<std::int32_t>((group * most + fewer - 1) / fewer);
        };
        const auto owners = node_owners(comm, levels[l - 1], sizes[l - 1], parts[l - 1],
                                        fmt::format("mesh hierarchy, level {}", l - 1));
        parts[l] = projected_parts(comm, owners, sizes[l - 1], hierarchy.rows.transfers[l - 1],
                                   levels[l].tets, sizes[l], lower);
    }
    return parts;
}

std::vector<std::vector<std::int32_t>> partition_levels(MPI_Comm comm,
                                                        const MeshHierarchy& hierarchy,
                                                        Partitioner partitioner) {
    std::vector<std::vector<std::int32_t>> parts =
        partition_levels(comm, rows_of(comm, hierarchy), partitioner);
    for (std::vector<std::int32_t>& of_level : parts) of_level = of_all_ranks(comm, of_level);
    return parts;
}

}  // namespace livetet
