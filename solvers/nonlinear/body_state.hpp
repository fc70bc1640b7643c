#pragma once

#include <vector>

#include "solvers/assembly/pressure_space.hpp"
#include "solvers/parallel/partitioned_mesh.hpp"
#include "solvers/parallel/row_blocks.hpp"

namespace livetet {

/// All that a body needs to go on from where it is, in the whole mesh's numbering: the same on any
/// number of ranks. Each rank holds the rows of its block alone (see row_range).
struct BodySnapshot {
    /// Three numbers for each node of the block: displacement, m; where the body is dynamic
    /// velocity, m/s, and acceleration, m/s^2; with generalized-alpha the forces at the last step's
    /// end, N.
    std::vector<std::vector<double>> nodal;
    /// Mixed form: of each corner, or of each cell of a grid, in the solver's own unit.
    std::vector<double> pressure;
    std::size_t node_count = 0;      ///< of the whole mesh
    std::size_t pressure_count = 0;  ///< of the whole mesh
    bool started = false;            ///< the acceleration is known
};

/// Where a body is and how it moves, in vectors over the partitioned mesh.
struct BodyState {
    PetscHandle<Vec> u;          ///< displacement, m
    PetscHandle<Vec> v, a;       ///< velocity, m/s, and acceleration, m/s^2; null where static
    PetscHandle<Vec> end_force;  ///< generalized-alpha: h0, the forces at the last step's end, N
    PetscHandle<Vec> p;          ///< mixed form: pressure
    bool started = false;        ///< the acceleration is known

    /// The vectors that there are.
    std::vector<Vec> vectors() const;
    /// Takes the values of a state with the same vectors. Throws Error if it has others.
    void copy_from(const BodyState& other);
    /// A state with the same vectors, whose values are not set.
    BodyState duplicate() const;
};

/// For rows of nodes in files: what this rank owns of them, and its block. Collective.
RowBlocks node_blocks(const PartitionedMesh& mesh);

/// Collective.
BodySnapshot gather_state(const PartitionedMesh& mesh, const BodyState& state);
/// Collective. Throws Error where the snapshot is of another mesh or scheme.
void restore_state(const PartitionedMesh& mesh, const BodySnapshot& snapshot, BodyState& state);

}  // namespace livetet
