#pragma once

#include <algorithm>

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

/// x = {u, p} by a copy: on each rank displacements stand before pressures. (UnknownParts
/// allocates, which frames must not.)
inline void join(Vec u, Vec p, Vec x) {
    const ReadArray from_u(u), from_p(p);
    WriteArray to(x);
    std::copy(from_p.span().begin(), from_p.span().end(),
              std::copy(from_u.span().begin(), from_u.span().end(), to.span().begin()));
}

/// {u, p} = x.
inline void part(Vec x, Vec u, Vec p) {
    const ReadArray from(x);
    WriteArray to_u(u), to_p(p);
    const auto count = static_cast<std::ptrdiff_t>(to_u.span().size());
    std::copy_n(from.span().begin(), count, to_u.span().begin());
    std::copy(from.span().begin() + count, from.span().end(), to_p.span().begin());
}

}  // namespace livetet
