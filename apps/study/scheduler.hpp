#pragma once

#include "apps/study/study_store.hpp"
#include "base/progress.hpp"

namespace livetet {

/// Throws Error unless `ranks` ranks form groups of `ranks_per_solve` that all find a solve to do.
void check_ranks(const Study& study, int ranks);

/// Throws Error, before anything is solved, if a mesh of the study cannot be read. By one rank.
void check_meshes(const Study& study);

/// Solves what is not done: PETSC_COMM_WORLD is split into groups of `ranks_per_solve` ranks, and
/// each group takes the next solve that no group has claimed. Returns once all groups have ended.
/// `progress`, called on the first rank, counts the solves of all groups. Collective.
void solve_remaining(const Study& study, const StudyStore& store, const ProgressCallback& progress);

}  // namespace livetet
