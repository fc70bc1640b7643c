#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/petsc.hpp"
#include "mesh/tet_mesh.hpp"
#include "solvers/parallel/shared_rows.hpp"

namespace livetet {

/// One rank's share of a mesh. Local nodes: the owned ones first, by rising number in the whole
/// mesh, then ghosts by rising PETSc number. Local tets: every tet that touches an owned node, so
/// that the owned rows of an operator can be assembled without a message.
struct PartitionedMesh {
    MPI_Comm comm = MPI_COMM_SELF;
    int ranks = 1;
    std::size_t total = 0;            ///< nodes of the whole mesh
    std::int32_t corners = 0;         ///< see corner_count; P1: all
    std::vector<std::int32_t> nodes;  ///< local node -> node of the whole mesh
    std::int32_t owned = 0;
    std::vector<Vector3> rest;                            ///< of each local node, m
    std::vector<PetscInt> numbers;                        ///< local node -> PETSc's number
    std::vector<Tet> tets;                                ///< in local nodes
    std::vector<std::array<std::int32_t, 6>> edge_nodes;  ///< P2: in local nodes
    /// Grids: in local nodes. `tets` are then their corner tets (corners 0, 1, 2, 4), one each.
    std::vector<Hexahedron> hexahedra{};
    /// In local nodes, and their shares as TetMesh has them. `tets` are their corner tets too.
    std::vector<QuadraticHexahedron> quadratic_hexahedra{};
    std::vector<double> shares{};
    /// Local tet -> tet of the whole mesh; of a hexahedron the first of its tets.
    std::vector<std::int32_t> tet_ids;
    std::vector<std::int32_t> regions;  ///< of each local tet or hexahedron; empty: one material
    /// Of each local tet or hexahedron, m^3, where they are not those of its shape: what of a cell
    /// is inside the body, or what a coarse level holds of the fine one (carried_volumes).
    std::vector<double> volumes{};

    std::size_t ghosts() const { return nodes.size() - owned; }
    /// Whether the whole mesh is P2: a rank without tets has no edge nodes either.
    bool is_quadratic() const { return static_cast<std::size_t>(corners) < total; }
    int nodes_per_tet() const {
        if (!quadratic_hexahedra.empty()) return 27;
        return !hexahedra.empty() ? 8 : edge_nodes.empty() ? 4 : 10;
    }
    /// Whether local tets stand for hexahedra, of either order.
    bool has_hexahedra() const { return !hexahedra.empty() || !quadratic_hexahedra.empty(); }
    /// Local node i of local tet e: corners, then edge nodes; or of hexahedron e.
    std::int32_t node(std::size_t e, int i) const {
        if (!hexahedra.empty()) return hexahedra[e][i];
        if (!quadratic_hexahedra.empty()) return quadratic_hexahedra[e][i];
        return i < 4 ? tets[e][i] : edge_nodes[e][i - 4];
    }
};

/// This rank's share of `mesh`, which every rank holds, by the parts of its tets (see
/// partition_levels). With one rank, nothing is distributed and `parts` may be empty. An edge node
/// of a P2 mesh goes to the owner of the first of its two corners. Throws Error for hexahedra on
/// several ranks. Collective.
PartitionedMesh distribute_mesh(MPI_Comm comm, const TetMesh& mesh,
                                std::span<const std::int32_t> parts);

/// The rank's part of the mesh as a mesh of its own: nodes, tets and regions, in local numbers,
/// without sets.
TetMesh local_mesh(const PartitionedMesh& share);

/// The values of the whole mesh's nodes, in its order, on every rank, from those of each rank's own
/// nodes. For meshes that fit on one. Collective.
std::vector<Vector3> whole_values(const PartitionedMesh& share, std::span<const Vector3> local);

/// The same on the first rank alone; empty on the others. Collective.
std::vector<Vector3> values_on_first(const PartitionedMesh& share, std::span<const Vector3> local);

/// PETSc's numbers of nodes of the whole mesh. Collective.
std::vector<PetscInt> petsc_numbers(const PartitionedMesh& share,
                                    std::span<const std::int32_t> nodes);

/// Finds a rank's local nodes by their numbers in the whole mesh. It refers to the share.
class LocalNumbers {
  public:
    explicit LocalNumbers(const PartitionedMesh& share);
    /// -1 for a node that is not local.
    std::int32_t operator[](std::int32_t node) const;

  private:
    std::span<const std::int32_t> own_;                          ///< rising
    std::vector<std::pair<std::int32_t, std::int32_t>> ghosts_;  ///< node and local one, rising
};

/// Whether it is so on any rank. Collective.
bool on_any_rank(const PartitionedMesh& share, bool here);

/// What each local node has of a whole mesh's values.
template <class T>
std::vector<T> local_part(const PartitionedMesh& share, std::span<const T> of_whole) {
    std::vector<T> local;
    local.reserve(share.nodes.size());
    for (const std::int32_t n : share.nodes) local.push_back(of_whole[n]);
    return local;
}

/// The values of this rank's own nodes, and of its ghosts behind them: from their owners.
/// Collective.
template <class T>
std::vector<T> with_ghosts(const PartitionedMesh& share, std::span<const T> of_owned) {
    std::vector<T> local(of_owned.begin(), of_owned.begin() + share.owned);
    if (share.ranks == 1) return local;
    const std::vector<T> ghosts = SharedRows(share.comm, static_cast<std::size_t>(share.owned),
                                             std::span(share.numbers).subspan(share.owned))
                                      .from_owners(std::span<const T>(local));
    local.insert(local.end(), ghosts.begin(), ghosts.end());
    return local;
}

/// A vector of three components a node, with room for the ghosts' values behind the owned ones.
PetscHandle<Vec> make_vector(const PartitionedMesh& share);

/// Fetches the ghosts' values from their owners.
void update_ghosts(Vec v);

/// The values of the local nodes; fetches the ghosts'. Collective.
std::vector<Vector3> local_values(const PartitionedMesh& share, Vec v);
/// The same into `values`, whose storage is used again.
void local_values(const PartitionedMesh& share, Vec v, std::vector<Vector3>& values);

/// Fills the owned part of `v` from values of the local nodes; those of ghosts are passed over.
void set_values(const PartitionedMesh& share, std::span<const Vector3> values, Vec v);

/// Read access to the owned and ghost values of a vector from make_vector, until the guard is
/// destroyed.
class LocalValues {
  public:
    explicit LocalValues(Vec v) : vec_(v) {
        LIVETET_PETSC(VecGhostGetLocalForm(v, &local_));
        LIVETET_PETSC(VecGetArrayRead(local_, &data_));
    }
    ~LocalValues() {
        VecRestoreArrayRead(local_, &data_);
        VecGhostRestoreLocalForm(vec_, &local_);
    }
    LocalValues(const LocalValues&) = delete;
    LocalValues& operator=(const LocalValues&) = delete;
    const double* data() const { return data_; }

  private:
    Vec vec_;
    Vec local_ = nullptr;
    const PetscScalar* data_ = nullptr;
};

}  // namespace livetet
