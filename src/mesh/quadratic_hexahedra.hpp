#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"

/// Hexahedra of 27 nodes, whose edges and faces may be bent.
namespace livetet {

/// The number in a QuadraticHexahedron of the node at (i, j, k) / 2.
constexpr int quadratic_place(int i, int j, int k) { return i + 3 * j + 9 * k; }
/// The number in a QuadraticHexahedron of corner c of a Hexahedron.
constexpr int quadratic_corner(int c) {
    return quadratic_place(2 * (c & 1), c & 2, 2 * (c >> 2 & 1));
}

/// The 48 tets of each cell, all its nodes their corners: one for each corner of each edge of each
/// face, with that corner, the edge's middle, the face's and the cell's. Neighbours have the same
/// triangles on their common face, however each is turned.
std::vector<Tet> tets_of_quadratic(std::span<const QuadraticHexahedron> cells);

/// Gives cells the nodes that they lack (number -1), behind those that there are: the middles of
/// edges halfway between their ends; those of faces and of the cell where the shape functions of
/// 20 nodes have them. Two cells that share an edge's or a face's corners share its middle, unless
/// each was given one of its own.
void add_middle_nodes(std::vector<Vector3>& nodes, std::span<QuadraticHexahedron> cells);

/// A body of hexahedra of which at least the corners are given.
/// - `mesh`: its nodes and sets, which `cells` name by number; -1 where a cell has no node.
/// - `regions`: one a cell, or none.
/// - Triangle sets, of triangles between corners, become those of the faces that these lie in, as
///   far as they are on the boundary. The node set of the same name gets the nodes of all of them.
/// - Other node sets get the new middles of edges and faces all of whose corners they have.
/// Throws Error, naming `where`, as check_quadratic_mesh does.
TetMesh quadratic_hexahedra(TetMesh mesh, std::vector<QuadraticHexahedron> cells,
                            std::span<const std::int32_t> regions, const std::string& where);

/// The same body as a grid, its cells of order 2; each has its share.
TetMesh quadratic_grid(const TetMesh& grid);

/// Throws Error, naming `where`, the cell and its place in mm, unless all nodes are there and
/// finite, each cell's Jacobian is positive at its nodes and at Gauss's 3 x 3 x 3 points, its 48
/// tets are positively oriented, no two cells have the same corners and no three a face.
void check_quadratic_mesh(const TetMesh& mesh, const std::string& where);

/// The quadratic polynomials n_i that are 1 at i / 2 and 0 at the two other halves of [0, 1], at x,
/// and their derivatives.
struct QuadraticPolynomials {
    double value[3], slope[3];
    explicit QuadraticPolynomials(double x)
        : value{(1 - x) * (1 - 2 * x), 4 * x * (1 - x), x * (2 * x - 1)},
          slope{4 * x - 3, 4 - 8 * x, 4 * x - 1} {}
};

/// Values of the 27 shape functions at x, in the cell's own coordinates from 0 to 1: products of
/// the three polynomials along the axes.
Eigen::Matrix<double, 27, 1> quadratic_shape(const Vector3& x);
/// Their derivatives by these coordinates.
Eigen::Matrix<double, 3, 27> quadratic_slopes(const Vector3& x);

}  // namespace livetet
