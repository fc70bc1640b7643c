#pragma once

#include "base/petsc.hpp"

namespace livetet {

/// Files what PETSc counts while it lives under a stage of -log_view. Collective.
class LogStage {
  public:
    explicit LogStage(const char* name) {
        PetscLogStage stage = -1;
        LIVETET_PETSC(PetscLogStageGetId(name, &stage));
        if (stage < 0) LIVETET_PETSC(PetscLogStageRegister(name, &stage));
        LIVETET_PETSC(PetscLogStagePush(stage));
    }
    ~LogStage() { PetscLogStagePop(); }
    LogStage(const LogStage&) = delete;
    LogStage& operator=(const LogStage&) = delete;
};

}  // namespace livetet
