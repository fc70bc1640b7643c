#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// Numbers for nodes that a cut doubles. The corners of elements at a node fall into classes, of
/// which the first to come keeps the node's number; the copies that others take follow after all
/// nodes, in the order in which they come.
class NodeCopies {
  public:
    NodeCopies(std::size_t nodes, std::size_t classes)
        : is_taken_(nodes, 0), number_(classes, -1), next_(static_cast<std::int32_t>(nodes)) {}

    /// The number of a node for corners of class `k`, which is of that node alone.
    std::int32_t number(std::int32_t node, std::int32_t k);
    /// Of each copy the node that it is one of. Ends the use.
    std::vector<std::int32_t> take_originals() { return std::move(originals_); }

  private:
    std::vector<std::uint8_t> is_taken_;  ///< one a node
    std::vector<std::int32_t> number_;    ///< one a class; -1: none yet
    std::vector<std::int32_t> originals_;
    std::int32_t next_;
};

/// Appends to a mesh the copies of nodes, at the same places and in the same sets.
void append_copies(TetMesh& mesh, std::span<const std::int32_t> originals);

/// The triangle sets of a mesh `before` its tets had the nodes `after`: each triangle with the
/// nodes of the first tet that it bounds.
std::map<std::string, std::vector<Triangle>> moved_sets(const TetMesh& before,
                                                        const std::vector<Tet>& after);

}  // namespace livetet
