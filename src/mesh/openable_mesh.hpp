#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "mesh/hierarchy.hpp"
#include "mesh/opened_nodes.hpp"

namespace livetet {

/// The levels of a mesh after a cut has opened, and how the nodes of the finest one have changed.
struct OpenedLevels {
    std::vector<TetMesh> levels;
    OpenedNodes nodes;
};

/// A mesh that opens, cut by cut, between cells whose middles are on different sides of surfaces at
/// rest. Cells stay as they are, and keep their numbers, so that cuts may come in any order and may
/// overlap; nodes double. Sides are decided exactly, by SegmentCrossings or LinkCrossings: a
/// surface without holes leaves none, also if it comes in parts that have the coordinates of their
/// common edges to the bit.
class OpenableMesh {
  public:
    virtual ~OpenableMesh() = default;

    /// Length of a typical cell's edge, m.
    virtual double cell_edge() const = 0;
    /// The place at rest of a point `y` of the deformed body, m; see find_rest_place. `mesh` and
    /// `displacement`, m, one a node: of the finest level now.
    virtual Vector3 rest_place(const Vector3& y, const TetMesh& mesh,
                               std::span<const Vector3> displacement) const = 0;
    /// Whether a place at rest is in a cell.
    virtual bool holds(const Vector3& place) const = 0;
    /// Cuts where a surface at rest parts middles of cells. Returns the number of pairs of
    /// neighbours that were not parted before. Throws Error if a corner of the surface is far
    /// away.
    virtual std::size_t cut(const TriangleMesh& surface) = 0;
    /// Leaves crumbs that were cut off since the last `keep`, of fewer than two hexahedra or six
    /// tets, with a neighbour.
    virtual void rejoin_crumbs() = 0;
    /// Rejoins crumbs and returns all levels with what was cut. `levels`: as they are now. Call
    /// `keep` or `undo` then.
    virtual OpenedLevels open(const std::vector<TetMesh>& levels) = 0;
    /// What was cut so far has been opened.
    virtual void keep() = 0;
    /// Forgets what was cut since the last `keep`.
    virtual void undo() = 0;
    /// The pairs of neighbours that were parted and kept.
    virtual std::size_t parted() const = 0;
};

/// The mesh of a hierarchy as it was loaded: a grid, or all levels of tets of four nodes.
std::unique_ptr<OpenableMesh> openable_mesh(const std::vector<TetMesh>& levels);

}  // namespace livetet
