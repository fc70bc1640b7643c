#pragma once

#include <span>
#include <vector>

#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// A mesh, or what a rank has of one that several share: its local nodes and tets, its sets' local
/// nodes, and what it takes to speak of the whole. It refers to both, which must outlive it.
class MeshPart {
  public:
    /// All of a mesh, without other ranks.
    MeshPart(const TetMesh& whole) : mesh_(whole) {}  // NOLINT: a whole mesh is a part of it
    /// `mesh`: the local mesh of `share` (see local_mesh), with the sets of its nodes.
    MeshPart(const TetMesh& mesh, const PartitionedMesh& share)
        : mesh_(mesh), share_(share.ranks > 1 ? &share : nullptr) {}

    const TetMesh& mesh() const { return mesh_; }
    /// Local nodes that belong to this rank; they come first.
    std::int32_t owned() const {
        return share_ ? share_->owned : static_cast<std::int32_t>(mesh_.nodes.size());
    }
    std::size_t total() const { return share_ ? share_->total : mesh_.nodes.size(); }
    /// Number of a local node in the whole mesh.
    std::int32_t number(std::int32_t node) const { return share_ ? share_->nodes[node] : node; }
    /// The communicator of the ranks; MPI_COMM_SELF where there are no others.
    MPI_Comm comm() const { return share_ ? share_->comm : MPI_COMM_SELF; }

    /// Sums over the ranks, on every rank. Collective, as all below are.
    void sum(std::span<double> values) const;
    double sum(double here) const {
        sum(std::span(&here, 1));
        return here;
    }
    /// Gives ghosts the values of their owners.
    template <class T>
    void take_ghosts(std::vector<T>& local) const {
        if (share_) local = with_ghosts<T>(*share_, local);
    }
    /// How many of some local nodes there are on all ranks, each counted by its owner.
    std::size_t count(std::span<const std::int32_t> nodes) const;

  private:
    const TetMesh& mesh_;
    const PartitionedMesh* share_ = nullptr;  ///< where there are other ranks
};

}  // namespace livetet
