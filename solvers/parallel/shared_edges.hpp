#pragma once

#include <cstdint>
#include <vector>

#include "base/lists.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// The edges of a mesh that ranks share, numbered over all of them: an edge belongs to the rank of
/// its lower end, the one with the lower number in the whole mesh. Numbers are as
/// edges_by_lower_end has them for the whole mesh, and no rank knows more than its own part.
class SharedEdges {
  public:
    /// `share`: of a mesh of four-node tets; it must outlive this. Collective.
    explicit SharedEdges(const PartitionedMesh& share);

    /// The local edges: list n has the local nodes that an edge joins local node n to, as its lower
    /// end, rising by their numbers in the whole mesh.
    const Lists& by_lower_end() const { return local_; }
    /// Place, among the items of by_lower_end, of the edge between two local nodes.
    std::int32_t between(std::int32_t a, std::int32_t b) const;
    std::int64_t total() const { return total_; }  ///< edges of the whole mesh
    std::int32_t owned() const { return owned_; }  ///< those of this rank, which come first

    /// Counts for a local node. Its own edges are those whose lower end it is.
    struct Node {
        std::int64_t edges_below;  ///< edges of the whole mesh whose lower ends are below it
        std::int64_t first_row;    ///< of its first own edge, in rows numbered rank by rank
        std::int64_t count;        ///< of its own edges
        std::int64_t rank_nodes_end, rank_first_edge;  ///< of its rank: end of PETSc's numbers of
                                                       ///< nodes, and the first edge's row
    };
    const Node& node(std::int32_t n) const { return nodes_[n]; }
    /// Place of a local edge among its lower end's.
    std::int32_t place(std::int32_t edge) const { return places_[edge]; }

  private:
    void find_nodes(const PartitionedMesh& share);
    void find_places(const PartitionedMesh& share);

    const std::vector<std::int32_t>& numbers_;  ///< of local nodes in the whole mesh
    Lists local_;
    std::int64_t total_ = 0;
    std::int32_t owned_ = 0;
    std::vector<Node> nodes_;
    std::vector<std::int32_t> places_;
};

}  // namespace livetet
