#include "solvers/parallel/partitioned_mesh.hpp"

#include <algorithm>
#include <numeric>

#include "base/error.hpp"
#include "mesh/hex_grid.hpp"
#include "solvers/parallel/partition.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

namespace {

/// A rank's tets (overlap included) and the nodes it owns, in numbers of the whole mesh.
struct Distributed {
    std::vector<std::int32_t> tet_ids;
    std::vector<std::int32_t> owned_nodes;
};

Distributed find_share(const TetMesh& mesh, std::span<const std::int32_t> parts, int rank) {
    const std::vector<std::int32_t> owner = node_owners(mesh, parts);
    Distributed d;
    for (std::size_t n = 0; n < owner.size(); ++n)
        if (owner[n] == rank) d.owned_nodes.push_back(static_cast<std::int32_t>(n));
    for (std::size_t e = 0; e < mesh.tets.size(); ++e)
        if (std::any_of(mesh.tets[e].begin(), mesh.tets[e].end(),
                        [&](std::int32_t n) { return owner[n] == rank; }))
            d.tet_ids.push_back(static_cast<std::int32_t>(e));
    return d;
}

/// Adds the edge nodes whose first corner (the lower number) is among `corners`.
std::vector<std::int32_t> with_edge_nodes(const TetMesh& mesh, std::vector<std::int32_t> corners) {
    std::vector<bool> mine(mesh.nodes.size(), false);
    for (const std::int32_t n : corners) mine[n] = true;
    for (std::size_t e = 0; e < mesh.edge_nodes.size(); ++e)
        for (int k = 0; k < 6; ++k)
            if (mine[std::min(mesh.tets[e][tet_edges[k][0]], mesh.tets[e][tet_edges[k][1]])])
                corners.push_back(mesh.edge_nodes[e][k]);
    std::sort(corners.begin(), corners.end());
    corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
    return corners;
}

}  // namespace

std::vector<PetscInt> number_owned(MPI_Comm comm, std::size_t count,
                                   std::span<const std::int32_t> owned) {
    PetscInt here = static_cast<PetscInt>(owned.size()), end = 0;
    MPI_Scan(&here, &end, 1, MPIU_INT, MPI_SUM, comm);
    std::vector<PetscInt> numbers(count, -1);
    for (std::size_t i = 0; i < owned.size(); ++i)
        numbers[owned[i]] = end - here + static_cast<PetscInt>(i);
    MPI_Allreduce(MPI_IN_PLACE, numbers.data(), static_cast<int>(count), MPIU_INT, MPI_MAX, comm);
    return numbers;
}

namespace {

/// All of the mesh.
void take_all(const TetMesh& mesh, PartitionedMesh& share) {
    share.owned = static_cast<std::int32_t>(mesh.nodes.size());
    share.nodes.resize(mesh.nodes.size());
    std::iota(share.nodes.begin(), share.nodes.end(), 0);
    share.numbers.assign(share.nodes.begin(), share.nodes.end());
    if (!mesh.hexahedra.empty()) {
        share.hexahedra = mesh.hexahedra;
        for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e) {
            const Hexahedron& h = mesh.hexahedra[e];
            share.tets.push_back({h[0], h[1], h[2], h[4]});
            share.tet_ids.push_back(static_cast<std::int32_t>(tets_per_hexahedron * e));
            share.volumes.push_back(cell_volume(mesh) * mesh.shares[e]);
        }
        return;
    }
    share.tets = mesh.tets;
    share.edge_nodes = mesh.edge_nodes;
    share.tet_ids.resize(mesh.tets.size());
    std::iota(share.tet_ids.begin(), share.tet_ids.end(), 0);
}

/// The rank's part of a mesh of tets.
void take_part(const TetMesh& mesh, std::span<const std::int32_t> parts, PartitionedMesh& share) {
    int rank = 0;
    MPI_Comm_rank(share.comm, &rank);
    const Distributed d = find_share(mesh, parts, rank);
    share.nodes = with_edge_nodes(mesh, d.owned_nodes);
    share.owned = static_cast<std::int32_t>(share.nodes.size());
    const std::vector<PetscInt> number_of_node = node_numbers(share);

    std::vector<std::int32_t> local_of(mesh.nodes.size(), -1);
    for (std::int32_t i = 0; i < share.owned; ++i) local_of[share.nodes[i]] = i;
    std::vector<std::int32_t> ghosts;
    for (const std::int32_t e : d.tet_ids) {
        const Tet& t = mesh.tets[e];
        if (std::none_of(t.begin(), t.end(), [&](std::int32_t n) {
                return local_of[n] >= 0 && local_of[n] < share.owned;
            }))
            continue;
        share.tet_ids.push_back(e);
        const auto mark = [&](std::int32_t n) {
            if (local_of[n] >= 0) return;
            local_of[n] = share.owned;  // its place is given below
            ghosts.push_back(n);
        };
        for (const std::int32_t n : t) mark(n);
        if (!mesh.edge_nodes.empty())
            for (const std::int32_t n : mesh.edge_nodes[e]) mark(n);
    }
    std::sort(ghosts.begin(), ghosts.end(), [&](std::int32_t a, std::int32_t b) {
        return number_of_node[a] < number_of_node[b];
    });
    for (const std::int32_t n : ghosts) {
        local_of[n] = static_cast<std::int32_t>(share.nodes.size());
        share.nodes.push_back(n);
    }
    for (const std::int32_t n : share.nodes) share.numbers.push_back(number_of_node[n]);
    for (const std::int32_t e : share.tet_ids) {
        const Tet& t = mesh.tets[e];
        share.tets.push_back({local_of[t[0]], local_of[t[1]], local_of[t[2]], local_of[t[3]]});
        if (mesh.edge_nodes.empty()) continue;
        share.edge_nodes.push_back(mesh.edge_nodes[e]);
        for (std::int32_t& n : share.edge_nodes.back()) n = local_of[n];
    }
}

}  // namespace

PartitionedMesh distribute_mesh(MPI_Comm comm, const TetMesh& mesh,
                                std::span<const std::int32_t> parts) {
    PartitionedMesh share;
    share.comm = comm;
    MPI_Comm_size(comm, &share.ranks);
    if (share.ranks > 1 && !mesh.hexahedra.empty())
        fail("hexahedra on {} ranks, expected one: only tetrahedra are distributed", share.ranks);
    share.total = mesh.nodes.size();
    share.corners = corner_count(mesh);
    if (share.ranks == 1)
        take_all(mesh, share);
    else
        take_part(mesh, parts, share);
    share.rest = local_part<Vector3>(share, mesh.nodes);
    if (!mesh.regions.empty())
        for (const std::int32_t e : share.tet_ids) share.regions.push_back(mesh.regions[e]);
    return share;
}

TetMesh local_mesh(const PartitionedMesh& share) {
    TetMesh local;
    local.nodes = share.rest;
    local.tets = share.tets;
    local.edge_nodes = share.edge_nodes;
    local.regions = share.regions;
    return local;
}

std::vector<Vector3> whole_values(const PartitionedMesh& share, std::span<const Vector3> local) {
    if (share.ranks == 1) return {local.begin(), local.end()};
    std::vector<Vector3> values(share.total, Vector3::Zero());
    for (std::int32_t i = 0; i < share.owned; ++i) values[share.nodes[i]] = local[i];
    sum_over_ranks(share.comm, {values.front().data(), 3 * values.size()});
    return values;
}

std::vector<Vector3> values_on_first(const PartitionedMesh& share, std::span<const Vector3> local) {
    if (share.ranks == 1) return {local.begin(), local.end()};
    int rank = 0;
    MPI_Comm_rank(share.comm, &rank);
    const auto owned = static_cast<std::size_t>(share.owned);
    const std::vector<PetscInt> rows(share.nodes.begin(), share.nodes.begin() + share.owned);
    std::vector<double> of_nodes(3 * owned);
    for (std::size_t i = 0; i < of_nodes.size(); ++i) of_nodes[i] = local[i / 3][i % 3];
    const std::vector<double> all =
        SharedRows(share.comm, rank == 0 ? share.total : 0, rows).to_owners(of_nodes, 3);
    std::vector<Vector3> values;
    for (std::size_t n = 0; n < all.size() / 3; ++n) values.emplace_back(&all[3 * n]);
    return values;
}

std::vector<PetscInt> node_numbers(const PartitionedMesh& share) {
    return number_owned(share.comm, share.total, std::span(share.nodes).first(share.owned));
}

bool on_any_rank(const PartitionedMesh& share, bool here) {
    int any = here;
    if (share.ranks > 1) MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, share.comm);
    return any != 0;
}

PetscHandle<Vec> make_vector(const PartitionedMesh& share) {
    PetscHandle<Vec> v;
    LIVETET_PETSC(VecCreateGhostBlock(share.comm, 3, 3 * share.owned, PETSC_DETERMINE,
                                      static_cast<PetscInt>(share.ghosts()),
                                      share.numbers.data() + share.owned, v.out()));
    return v;
}

void update_ghosts(Vec v) {
    int ranks = 1;
    MPI_Comm_size(PetscObjectComm(reinterpret_cast<PetscObject>(v)), &ranks);
    if (ranks == 1) return;
    LIVETET_PETSC(VecGhostUpdateBegin(v, INSERT_VALUES, SCATTER_FORWARD));
    LIVETET_PETSC(VecGhostUpdateEnd(v, INSERT_VALUES, SCATTER_FORWARD));
}

std::vector<Vector3> local_values(const PartitionedMesh& share, Vec v) {
    std::vector<Vector3> values;
    local_values(share, v, values);
    return values;
}

void local_values(const PartitionedMesh& share, Vec v, std::vector<Vector3>& values) {
    update_ghosts(v);
    values.resize(share.nodes.size());
    const LocalValues local(v);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = Eigen::Map<const Vector3>(local.data() + 3 * i);
}

void set_values(const PartitionedMesh& share, std::span<const Vector3> values, Vec v) {
    WriteArray mine(v);
    for (std::int32_t i = 0; i < share.owned; ++i)
        Eigen::Map<Vector3>(mine.span().data() + 3 * i) = values[i];
}

}  // namespace livetet
