#pragma once

#include <span>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// The least of a tet's six dihedral angles, rad; -1 if its volume is not positive.
double least_dihedral(std::span<const Vector3> nodes, const Tet& t);

}  // namespace livetet
