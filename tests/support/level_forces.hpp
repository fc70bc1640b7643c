#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "solvers/assembly/level_assembler.hpp"
#include "support/whole_mesh.hpp"

namespace livetet::test {

/// Pseudo-random vectors with components from -size / 2 to size / 2, the same in each run.
inline std::vector<Vector3> rough_values(std::size_t nodes, double size, std::uint32_t state) {
    std::vector<Vector3> values(nodes);
    for (Vector3& v : values)
        for (double& c : v)
            c = size * ((state = state * 1664525u + 1013904223u) / 4294967296.0 - 0.5);
    return values;
}

/// Elastic forces and energy of a level at u + step v, for derivatives along v; displacement
/// form, or pressures of cells.
class LevelForces {
  public:
    LevelForces(LevelAssembler& level, std::vector<Vector3> u, std::vector<Vector3> v)
        : level_(level),
          u_(std::move(u)),
          v_(std::move(v)),
          at_(make_vector(level.share())),
          f_(make_vector(level.share())),
          rotations_(level.make_rotations()) {}

    /// N, at each node of the mesh; by the pressures p of cells where they are given.
    std::vector<Vector3> force(double step, Vec p = nullptr) {
        move(step);
        Configuration at = configuration();
        at.p = p;
        level_.elastic_force(at, f_.get());
        return gather(level_.share(), f_.get());
    }
    double energy(double step) {  ///< J
        move(step);
        return level_.strain_energy(configuration());
    }
    /// Where the last of these was taken.
    Configuration configuration() const { return {.u = at_.get(), .rotations = &rotations_}; }

    /// That `product` is the derivative of the forces along v at u, and the forces are that of the
    /// energy, by central differences of step h.
    void expect_derivatives(std::span<const Vector3> product, double h, const std::string& what) {
        const auto plus = force(h), minus = force(-h), here = force(0);
        double gap = 0, size = 0, work = 0;
        for (std::size_t n = 0; n < here.size(); ++n) {
            const Vector3 difference = (plus[n] - minus[n]) / (2 * h);
            gap += (difference - product[n]).squaredNorm();
            size += difference.squaredNorm();
            work += here[n].dot(v_[n]);
        }
        EXPECT_LT(std::sqrt(gap / size), 1e-6) << what;
        EXPECT_NEAR((energy(h) - energy(-h)) / (2 * h) / work, 1, 1e-6) << what;
    }

  private:
    void move(double step) {
        std::vector<Vector3> moved = u_;
        for (std::size_t n = 0; n < moved.size(); ++n) moved[n] += step * v_[n];
        fill(level_.share(), moved, at_.get());
        level_.update_rotations(at_.get(), rotations_);
    }

    LevelAssembler& level_;
    std::vector<Vector3> u_, v_;
    PetscHandle<Vec> at_, f_;
    ElementRotations rotations_;
};

}  // namespace livetet::test
