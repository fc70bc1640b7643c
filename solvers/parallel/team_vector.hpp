#pragma once

#include "base/petsc.hpp"
#include "base/thread_team.hpp"

namespace livetet {

/// Has PETSc's sums and updates of `v`, which must be whole on this rank, and of its duplicates run
/// on `team`, which must outlive them. Sums have the same bits on any number of threads. Duplicates
/// have room for their norm, which PETSc would make when it first takes it: nothing that runs on a
/// team allocates.
void run_on_team(Vec v, ThreadTeam& team);

}  // namespace livetet
