#pragma once

#include "solvers/linear/linear_solver.hpp"

namespace livetet {

/// The displacement's and the pressure's part of a vector of LinearSolver::matrix(), while this
/// lives; in the displacement form the vector itself and null. The parts are the vector's own
/// memory. Collective.
class UnknownParts {
  public:
    UnknownParts(const LinearSolver& solver, Vec x) : u(x), fields_(solver.fields()), x_(x) {
        if (!fields_.pressure) return;
        LIVETET_PETSC(VecGetSubVector(x, fields_.displacement, &u));
        LIVETET_PETSC(VecGetSubVector(x, fields_.pressure, &p));
    }
    ~UnknownParts() {
        if (!fields_.pressure) return;
        VecRestoreSubVector(x_, fields_.displacement, &u);
        VecRestoreSubVector(x_, fields_.pressure, &p);
    }
    UnknownParts(const UnknownParts&) = delete;
    UnknownParts& operator=(const UnknownParts&) = delete;

    Vec u = nullptr, p = nullptr;

  private:
    UnknownFields fields_;
    Vec x_;
};

}  // namespace livetet
