#pragma once

#include "base/petsc.hpp"

namespace livetet {

/// A matrix of 3x3 blocks as a matrix of scalars (AIJ), which factorisations, GAMG and Galerkin
/// products take. A matrix of scalars stands for itself.
class ScalarCopy {
  public:
    /// `A` with its present values and near null space. The same matrix each time it is called with
    /// the same `A`. Collective.
    Mat update(Mat A);

  private:
    PetscHandle<Mat> copy_;
};

}  // namespace livetet
