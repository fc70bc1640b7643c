#pragma once

#include <span>

#include "mechanics/batch_kernels.hpp"
#include "mechanics/mixed_law.hpp"

namespace livetet {

/// A constitutive model over batches of tets of four or ten nodes or of hexahedra, in single
/// precision: the forces and tangent products of a live frame. With w_q the volume of a quadrature
/// point,
///
///     f_i = sum_q w_q P(F_q) grad N_i,   K(u) v = d f / d u . v,
///
/// K as ConstitutiveModel::bounded_increment has it. In hexahedra that are boxes of moderate
/// strain, with one rotation each, K may have the law's tangent for the mean gradient alone and
/// Hooke's law, turned, for the rest (box_lanes.hpp): of Hooke's law nothing changes.
///
/// As the functions of batch_kernels.hpp it is pure, allocates nothing, and runs over a range of
/// batches; vectors have one number behind the last node's. A model gives its own by
/// ConstitutiveModel::batch_law.
class BatchLaw {
  public:
    virtual ~BatchLaw() = default;

    /// The rotations that Hooke's law reads: one batch of them for each point of a batch of tets,
    /// or one for a batch of tets, or one for all. Other laws read them for products of hexahedra
    /// alone, one for a batch or one for all.
    using Rotations = std::span<const RotationBatch<float>>;

    /// f += the elastic forces at u; u in m, f in N.
    virtual void add_forces(const TetBatches<float>& batches, BatchRange range, Rotations rotations,
                            std::span<const float> u, std::span<float> f) const = 0;
    virtual void add_forces(const TetBatches<float, 10>& batches, BatchRange range,
                            Rotations rotations, std::span<const float> u,
                            std::span<float> f) const = 0;
    virtual void add_forces(const TetBatches<float, 8>& batches, BatchRange range,
                            Rotations rotations, std::span<const float> u,
                            std::span<float> f) const = 0;

    /// f += factor K(u) v, rotations held.
    virtual void add_stiffness_times(float factor, const TetBatches<float>& batches,
                                     BatchRange range, Rotations rotations,
                                     std::span<const float> u, std::span<const float> v,
                                     std::span<float> f) const = 0;
    virtual void add_stiffness_times(float factor, const TetBatches<float, 10>& batches,
                                     BatchRange range, Rotations rotations,
                                     std::span<const float> u, std::span<const float> v,
                                     std::span<float> f) const = 0;
    virtual void add_stiffness_times(float factor, const TetBatches<float, 8>& batches,
                                     BatchRange range, Rotations rotations,
                                     std::span<const float> u, std::span<const float> v,
                                     std::span<float> f) const = 0;

    /// The same model in the mixed form.
    virtual const MixedLaw& mixed() const = 0;
};

/// Hooke's law of the strain sym(R^T F) - I: linear and corotated. Its K is positive semi-definite.
const BatchLaw& hooke_law();

}  // namespace livetet
