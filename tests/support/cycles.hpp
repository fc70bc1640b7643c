#pragma once

#include <Eigen/Core>

#include <cmath>
#include <span>

#include "solvers/assembly/level_assembler.hpp"

namespace livetet::test {

/// sin(frequency i) at component i of a level on one rank, zero where that is constrained.
inline Eigen::VectorXd wave(const LevelAssembler& level, double frequency) {
    const auto constrained = level.constrained();
    Eigen::VectorXd x(3 * static_cast<Eigen::Index>(constrained.size()));
    for (Eigen::Index i = 0; i < x.size(); ++i)
        x[i] = constrained[i / 3] ? 0 : std::sin(frequency * static_cast<double>(i));
    return x;
}

/// What a multigrid cycle makes of r.
template <class Cycle>
Eigen::VectorXd cycled(Cycle& cycle, const Eigen::VectorXd& r) {
    Eigen::VectorXd z(r.size());
    cycle.cycle(std::span(r.data(), r.size()), std::span(z.data(), z.size()));
    return z;
}

}  // namespace livetet::test
