#include "solvers/parallel/partitioned_mesh.hpp"

#include <algorithm>
#include <numeric>

#include "base/error.hpp"
#include "mesh/hex_grid.hpp"
#include "mesh/quadratic_hexahedra.hpp"
#include "solvers/parallel/mesh_distribution.hpp"
#include "solvers/parallel/row_blocks.hpp"
#include "solvers/parallel/sum_over_ranks.hpp"

namespace livetet {

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
    if (!mesh.quadratic_hexahedra.empty()) {
        share.quadratic_hexahedra = mesh.quadratic_hexahedra;
        share.shares = mesh.shares;
        for (std::size_t e = 0; e < mesh.quadratic_hexahedra.size(); ++e) {
            const auto corner = [&](int c) {
                return mesh.quadratic_hexahedra[e][quadratic_corner(c)];
            };
            share.tets.push_back({corner(0), corner(1), corner(2), corner(4)});
            share.tet_ids.push_back(static_cast<std::int32_t>(tets_per_quadratic_hexahedron * e));
        }
        return;
    }
    share.tets = mesh.tets;
    share.edge_nodes = mesh.edge_nodes;
    share.tet_ids.resize(mesh.tets.size());
    std::iota(share.tet_ids.begin(), share.tet_ids.end(), 0);
}

}  // namespace

PartitionedMesh distribute_mesh(MPI_Comm comm, const TetMesh& mesh,
                                std::span<const std::int32_t> parts) {
    int rank = 0, ranks = 1;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &ranks);
    if (ranks > 1) {
        if (mesh.has_hexahedra())
            fail("hexahedra on {} ranks, expected one: only tetrahedra are distributed", ranks);
        const auto r = static_cast<std::size_t>(rank), all = static_cast<std::size_t>(ranks);
        return distribute_rows(comm, rows_of(mesh, r, all), {mesh.nodes.size(), mesh.tets.size()},
                               rows_of_table(parts, r, all), "mesh");
    }
    PartitionedMesh share;
    share.comm = comm;
    share.total = mesh.nodes.size();
    share.corners = corner_count(mesh);
    take_all(mesh, share);
    share.rest = mesh.nodes;
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

std::vector<PetscInt> petsc_numbers(const PartitionedMesh& share,
                                    std::span<const std::int32_t> nodes) {
    const PetscInt owned = share.owned;
    PetscInt end = 0;
    MPI_Scan(&owned, &end, 1, MPIU_INT, MPI_SUM, share.comm);
    std::vector<double> values(static_cast<std::size_t>(owned));  // whole numbers
    std::iota(values.begin(), values.end(), static_cast<double>(end - owned));
    const auto own = std::span(share.nodes).first(values.size());
    values = RowBlocks(share.comm, share.total, own).to_block(values, 1);
    values = RowBlocks(share.comm, share.total, nodes).from_block(values, 1);
    return {values.begin(), values.end()};
}

LocalNumbers::LocalNumbers(const PartitionedMesh& share)
    : own_(std::span(share.nodes).first(static_cast<std::size_t>(share.owned))) {
    for (std::size_t i = own_.size(); i < share.nodes.size(); ++i)
        ghosts_.emplace_back(share.nodes[i], static_cast<std::int32_t>(i));
    std::ranges::sort(ghosts_);
}

std::int32_t LocalNumbers::operator[](std::int32_t node) const {
    if (const auto at = std::ranges::lower_bound(own_, node); at != own_.end() && *at == node)
        return static_cast<std::int32_t>(at - own_.begin());
    const auto at =
        std::ranges::lower_bound(ghosts_, node, {}, &std::pair<std::int32_t, std::int32_t>::first);
    return at != ghosts_.end() && at->first == node ? at->second : -1;
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
