#pragma once

#include <array>

#include "mesh/tet_mesh.hpp"

/// Structured meshes of bodies whose answers are known. Each is a grid of bricks in the unit cube,
/// split in six tets a brick (Kuhn), mapped onto the body; its faces are the faces of the cube. So
/// twice the counts are the uniform refinement of the same body, and half the counts a coarser
/// level whose nodes are nodes of the finer one. Every triangle of the boundary is in exactly one
/// triangle set, wound outwards; each triangle set has a node set of the same name. Throws Error
/// where a count is below 1.
namespace livetet::verification {

using Cells = std::array<int, 3>;

/// The box [0, size]: faces "x0", "x1", "y0", "y1", "z0", "z1". With `distortion` each inner node
/// moves along each axis by up to this fraction of its cell, pseudo-randomly, the same in each run.
/// Below 1/6 that turns no tet over; throws Error where it does (0.2 went well on 16^3 cells).
TetMesh box(const Vector3& size, Cells cells, double distortion = 0);

/// Such a mesh in quadratic hexahedra, one a brick, with straight edges. `bricks`: those that it
/// was made of.
TetMesh straight_hexahedra(TetMesh mesh, Cells bricks);

/// In quadratic hexahedra of 2 x 2 x 2 bricks each, with the nodes that it has: so they bend as it
/// does. Throws Error where a number of bricks is odd.
TetMesh bent_hexahedra(TetMesh mesh, Cells bricks);

/// One eighth of a thick hollow sphere, a <= |x| <= b, in x, y, z >= 0: symmetry planes "x0", "y0",
/// "z0" (exactly on them), and "inner", "outer". The octant's triangle of directions is split in
/// n_surface^2, at equal angles along its edges; n_radial layers of prisms, three tets each.
TetMesh sphere_octant(double a, double b, int n_surface, int n_radial);

/// A quarter of a thick tube, a <= r <= b, 0 <= z <= height, in x, y >= 0: symmetry planes "x0",
/// "y0" (exactly on them), "z0", "z1", "inner", "outer".
TetMesh cylinder_quarter(double a, double b, double height, int n_r, int n_theta, int n_z);

/// Cook's membrane: the trapezoid (0, 0) (48, 44) (48, 60) (0, 44), 0 <= z <= thickness: faces
/// "left" (x = 0, held), "right" (x = 48, loaded), "bottom", "top", "z0", "z1". Plain numbers: the
/// caller says of which unit. The cells' diagonals are the short ones, from a cell's upper left to
/// its lower right. Source: Cook (1974), J. Struct. Div. ASCE 100.
TetMesh cooks_membrane(int n, int n_z, double thickness);

/// NAFEMS LE10, thick plate under pressure: the quarter (x, y >= 0, in metres) between the ellipses
/// of semi-axes 2 (x), 1 (y) and 3.25 (x), 2.75 (y); -0.3 <= z <= 0.3. n_z must be even. Faces and
/// what holds there:
///   "y0"  u_y = 0
///   "x0"  u_x = 0
///   "outer"  u_x = u_y = 0
///   "outer_middle" (nodes only: z = 0 on "outer")  u_z = 0
///   "top" (z = 0.3)  normal pressure 1 MPa
///   "bottom", "inner"  free
/// E = 210 GPa, nu = 0.3. Asked for: sigma_yy = -5.38 MPa at D = (2, 0, 0.3), the node of "top",
/// "inner" and "y0". Held on a line only, u_z falls without limit, like log h, as the mesh is
/// refined: judge the stress, not u_z. Source: NAFEMS, The Standard NAFEMS Benchmarks, TNSB rev. 3
/// (1990), LE10.
TetMesh le10_plate(int n_r, int n_theta, int n_z);

}  // namespace livetet::verification
