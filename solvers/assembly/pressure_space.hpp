#pragma once

#include <vector>

#include "solvers/parallel/partitioned_mesh.hpp"

namespace livetet {

/// Tets: continuous pressures, one at each corner, shared by the ranks as the corners are.
/// Hexahedra: one a cell, on one rank; `tets` names it four times, so that linear interpolation
/// gives a constant. Quadratic hexahedra: four a cell, linear in it, on one rank (pressure_shape).
/// Local pressures: the owned ones first, then ghosts by rising PETSc number.
struct PressureSpace {
    MPI_Comm comm = MPI_COMM_SELF;
    std::int32_t owned = 0;
    std::vector<PetscInt> numbers;  ///< local pressure -> PETSc's number
    std::vector<Tet> tets;          ///< in local pressures, in the order of the share's tets
};

/// Collective.
PressureSpace make_pressure_space(const PartitionedMesh& share);

/// One value for each pressure, with room for the ghosts' behind the owned ones.
PetscHandle<Vec> make_vector(const PressureSpace& space);

}  // namespace livetet
