#pragma once

#include <span>

namespace livetet {

/// A symmetric operator and its preconditioner in single precision, on one rank. Vectors are three
/// numbers a node, zero at constrained components, and one number behind: nodes are read by fours.
class SingleSystem {
  public:
    virtual ~SingleSystem() = default;
    /// y = A x
    virtual void apply(std::span<float> x, std::span<float> y) = 0;
    /// z = an approximation of A^-1 r
    virtual void precondition(std::span<const float> r, std::span<float> z) = 0;
};

}  // namespace livetet
