#pragma once

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "mesh/cut_surface.hpp"
#include "mesh/link_crossings.hpp"

/// Cuts of grids of hexahedra: a link between two neighbours breaks where the segment from one
/// cell's centre to the other's crosses the cutting surface. A node is doubled where the links
/// around it no longer connect its cells, so that the cut opens along faces of cells.
///
/// Source: Dick, Georgii, Westermann (2011), "A hexahedral multigrid approach for simulating cuts
/// in deformable objects".
namespace livetet {

/// For each link whether the surface crosses it. A surface without holes leaves none: each centre
/// is on one side of it. A centre exactly on the surface counts as on one side, too: as if it was
/// moved by (e, e^2, e^3) with an infinitely small e, along the image's axes for a plane and along
/// the grid's for triangles; the latter is decided exactly, on corners rounded to 1e-6 of a cell.
/// So a reversed surface cuts the same.
/// O((links + triangles) log(links) + centres near triangles). Throws Error, naming `where`, if a
/// corner of a triangle is more than 1e6 cells from the grid.
std::vector<std::uint8_t> crossed_links(const HexLevel& level, const GridFrame& frame,
                                        const CutSurface& surface, const std::string& where);

/// A grid with links removed.
struct OpenedGrid {
    TetMesh mesh;
    std::vector<std::int32_t> originals{};  ///< of each node that was added: what it is a copy of
};

/// The mesh without the links of `level` that are `cut` (one entry a link). Cells keep their
/// numbers. A node keeps its number for the first of its cells; the copies that other cells take
/// follow after all nodes, at the same place. Node sets take all copies; triangles of a set take
/// the nodes of the cell that they bound. `level` has the mesh's cells, and may have links that the
/// mesh has no more, if they are cut: so a mesh is opened further, cut by cut.
OpenedGrid open_links(const TetMesh& mesh, const HexLevel& level,
                      std::span<const std::uint8_t> cut);
/// Its mesh.
inline TetMesh without_links(const TetMesh& mesh, const HexLevel& level,
                             std::span<const std::uint8_t> cut) {
    return open_links(mesh, level, cut).mesh;
}

}  // namespace livetet
