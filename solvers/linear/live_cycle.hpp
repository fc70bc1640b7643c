#pragma once

#include <span>

#include "solvers/assembly/level_assembler.hpp"

namespace livetet {

/// What a live frame is preconditioned with: a symmetric multigrid cycle in single precision over
/// the levels of a body. After `set_constrained` and the first `update`, nothing allocates. To use
/// it:
///
///     set_constrained();        // when constrained components or springs change
///     update(at, s, m, ...);    // when the body has moved
///     cycle(r, z);              // as often as wanted
class LiveCycle {
  public:
    virtual ~LiveCycle() = default;

    /// Takes up the levels' constrained components and springs.
    virtual void set_constrained() = 0;
    /// Renews the operators s K(R) + m M for the displacement and rotations of the finest level.
    /// Where `wanted` is half, a cycle may renew less than the whole. Returns what was renewed.
    virtual RenewalExtent update(const ElementRotations& at, double s, double m,
                                 RenewalExtent wanted) = 0;
    /// Called before each solve. `has_start`: its right-hand side is the residual that a start from
    /// earlier solves leaves. The first cycle may then be a cheaper one, which is not symmetric:
    /// conjugate gradients still take the best length along it, and its direction is a little less
    /// conjugate to the next.
    virtual void begin_solve(bool /*has_start*/) {}
    /// z = one cycle for A z = r from zero; r and z zero at constrained components.
    virtual void cycle(std::span<const double> r, std::span<double> z) = 0;
    virtual void cycle(std::span<const float> r, std::span<float> z) = 0;

    /// What one `update` and one `cycle` have to move, from and to memory, if every array is read
    /// or written once where it is used; bytes.
    virtual double bytes_of_update() const = 0;
    virtual double bytes_of_cycle() const = 0;
};

}  // namespace livetet
