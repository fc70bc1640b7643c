#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"

/// Grids of equal hexahedra, and their nested levels.
///
/// Two neighbours hang together if they are linked: then they share the four nodes of their common
/// face. Cells that touch at an edge or a corner alone share no nodes, unless a chain of links
/// around that edge or corner joins them. A cut removes links, whereupon nodes double.
///
/// Source: Dick, Georgii, Westermann (2011), "A hexahedral multigrid approach for simulating cuts
/// in deformable objects".
namespace livetet {

using HexPlace = std::array<std::int32_t, 3>;  ///< of a cell in its grid, from 0

/// Cells that hang together: `upper` is the next one along `axis`.
struct HexLink {
    std::int32_t lower = 0, upper = 0;
    int axis = 0;
    bool operator==(const HexLink&) const = default;
    auto operator<=>(const HexLink&) const = default;
};

/// One level of a grid.
struct HexLevel {
    std::vector<HexPlace> places;  ///< of each cell; several cells may be at one place
    std::vector<HexLink> links;
    std::vector<Hexahedron> cells;
    std::int32_t nodes = 0;
    std::vector<std::int32_t> parents{};  ///< of each cell, in the next coarser level, if any
};

/// Which of its parent's eight places a cell takes: bit d is its place's last bit along axis d.
inline int octant_of(const HexPlace& place) {
    return (place[0] & 1) | (place[1] & 1) << 1 | (place[2] & 1) << 2;
}

/// Numbers the nodes: corners that links join are one node. Along a row of cells in x numbers rise
/// one by one, where no node is doubled, then from row to row, then from layer to layer.
HexLevel make_hex_level(std::vector<HexPlace> places, std::vector<HexLink> links);

/// The next coarser level, of cells twice as long; sets `fine.parents`. A coarse cell is one linked
/// part of the cells at its eight places, so that it never joins parts of the body across a gap.
/// Coarse cells are linked where two of their cells are. Where a cut ends inside a coarse cell it
/// is opened to the cell's border if that is nearer (mesh/cut_ends.hpp), unless all such ends of
/// the level together would let a piece come loose: then all stay closed.
HexLevel coarser_level(HexLevel& fine);

/// The grid of a mesh, with the mesh's numbers of cells and nodes. Links are where two neighbours
/// share a face's nodes. Throws Error, naming `where`, if the hexahedra are not those of one grid
/// (equal right-handed parallelepipeds at whole multiples of their edges), a node is missing or not
/// finite, or `shares` are not one of each cell, above 0 to 1.
HexLevel hex_level_of(const TetMesh& mesh, const std::string& where);

/// That grid and coarser levels of it, finest first, until one has no more than `enough` cells or
/// coarsening brings no fewer.
std::vector<HexLevel> hex_levels(const TetMesh& mesh, std::size_t enough);

/// Kuhn's six tets of each cell, all with the cell's diagonal from corner 0 to 7: neighbours have
/// the same triangles on their common face.
std::vector<Tet> tets_of_hexahedra(std::span<const Hexahedron> hexahedra);

/// "60,000 tets" or "5,000 hexahedra", without the comma.
std::string elements_text(const TetMesh& mesh);

/// Volume of each cell of a grid, m^3.
double cell_volume(const TetMesh& mesh);

}  // namespace livetet
