#pragma once

#include "base/petsc.hpp"
#include "base/thread_team.hpp"

namespace livetet {

/// Has PETSc's sums and updates of `v` and of its duplicates run on `team`, which must outlive
/// them: dot products, 2-norms, copies and linear combinations of two or of many vectors. `v` must
/// be whole on this rank. Sums have the same bits on any number of threads. Duplicates are zero,
/// and have room for the norm that PETSc keeps with a vector: else it would allocate that at the
/// first norm, in a frame.
void run_on_team(Vec v, ThreadTeam& team);

}  // namespace livetet
