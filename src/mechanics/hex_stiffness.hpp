#pragma once

#include "mechanics/hex_kernels.hpp"

namespace livetet {

using Matrix24 = Eigen::Matrix<double, 24, 24>;

/// How the volumetric part of a hexahedron's energy is integrated: at each point, or from the
/// cell's mean dilation (Q1-P0 with the pressure eliminated).
enum class Dilation { of_points, of_cell };

/// The derivative of a cell's mean dilation by its corners' displacements, 1/m.
using CellDilation = Eigen::Matrix<double, 3, 8>;

/// Stiffness of Hooke's law of the full hexahedron `cell` (its moduli, its volume), N/m; component
/// d of corner c is row 3 c + d.
Matrix24 hooke_stiffness(const TetElement& cell, Dilation dilation);

}  // namespace livetet
