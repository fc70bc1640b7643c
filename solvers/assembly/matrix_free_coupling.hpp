#pragma once

#include <span>
#include <vector>

#include "solvers/assembly/level_assembler.hpp"

namespace livetet {

/// What pressures add to the operator of a level in single precision, without matrices (see
/// PressureCoupling, which has the names and the scaling of pressures):
///
///     take(at);             // when the body has moved
///     multiply(...);        // as often as wanted
class MatrixFreeCoupling {
  public:
    /// `level` must outlive this. `scale`: Pa/m, see PressureCoupling::scale.
    MatrixFreeCoupling(const LevelAssembler& level, double scale);

    /// The displacement and the pressures to take derivatives at; `at.rotations` must stay as they
    /// are until the next call.
    void take(const Configuration& at);

    /// f = factor K v + B^T q and g = B v by the law's tangent K; f at constrained components is
    /// that of the free body. v, f: three numbers a node; q, g: scaled; q empty: zero. For
    /// Support::constrained v is zero but at constrained components, and q is empty.
    void multiply(double factor, std::span<const double> v, std::span<const double> q,
                  std::span<double> f, std::span<double> g, Support of_v = Support::all);
    /// f = B^T q, zero at constrained components.
    void multiply_transposed(std::span<const double> q, std::span<double> f);

    /// In one pass over the tets: f = the elastic force, N, of constrained components too;
    /// g = scale integral N_i theta.
    void evaluate(std::span<double> f, std::span<double> g);

    PetscInt pressures() const { return level_.pressure_space()->owned; }

  private:
    void clear();
    void write_results(std::span<double> f, std::span<double> g) const;
    void take_scaled(std::span<const double> q);

    const LevelAssembler& level_;
    double scale_;
    const ElementRotations* at_ = nullptr;
    std::vector<float> v_, f_;      ///< three numbers a node, one behind
    std::vector<float> p_, q_, g_;  ///< pressures, directions, volumes, as MixedValues::p
};

}  // namespace livetet
