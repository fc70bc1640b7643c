#pragma once

#include <span>

#include "mechanics/batch_kernels.hpp"

namespace livetet {

/// Displacements, m, three numbers a node and one behind the last node's, and pressures, Pa, one
/// number a node, of which those of corners are read; of hexahedra one number a cell. Empty
/// pressures: all zero.
struct MixedValues {
    std::span<const float> u, p;
};

/// What the kernels below add to: f, N, in the layout of u; g, m^3, in that of p; g empty: not
/// wanted.
struct MixedForces {
    std::span<float> f, g;
};

/// Tets or hexahedra of the mixed form. Their batches hold no lambda, which the displacements' part
/// of the form does not have: `lambda` is the volume times a modulus, and `per_modulus` is 1 over
/// it, 1/Pa.
template <int nodes>
struct MixedTets {
    const TetBatches<float, nodes>& batches;
    float per_modulus;
    BatchRange range;
    std::span<const RotationBatch<float>> rotations;  ///< see BatchLaw::Rotations
};

/// A constitutive model in the mixed form over batches of tets or hexahedra, in single precision.
/// Pressures are linear in a tet, and constant in a hexahedron. With psi_mu and theta as
/// ConstitutiveModel has them, N = d theta / dF, w_q the volume of a quadrature point and L the
/// shape functions of the pressure,
///
///     f_i = sum_q w_q (d psi_mu / dF + p_q N_q) grad N_i,     g_j = sum_q w_q L_j theta_q,
///
/// and with K the derivative of f by u at held p, rotations held, and B that of g,
///
///     products  f += factor K v + B^T q,   g += B v.
///
/// As the functions of batch_kernels.hpp it is pure, allocates nothing, and runs over a range of
/// batches.
class MixedLaw {
  public:
    virtual ~MixedLaw() = default;

    /// f and g at `at`.
    virtual void add_forces(const MixedTets<4>& tets, const MixedValues& at,
                            const MixedForces& to) const = 0;
    virtual void add_forces(const MixedTets<10>& tets, const MixedValues& at,
                            const MixedForces& to) const = 0;
    virtual void add_forces(const MixedTets<8>& cells, const MixedValues& at,
                            const MixedForces& to) const = 0;

    /// Products with v = {v, q}.
    virtual void add_products(const MixedTets<4>& tets, float factor, const MixedValues& at,
                              const MixedValues& v, const MixedForces& to) const = 0;
    virtual void add_products(const MixedTets<10>& tets, float factor, const MixedValues& at,
                              const MixedValues& v, const MixedForces& to) const = 0;
    virtual void add_products(const MixedTets<8>& cells, float factor, const MixedValues& at,
                              const MixedValues& v, const MixedForces& to) const = 0;

    /// f += B^T q; pressures of `at` are not read.
    virtual void add_pressure_forces(const MixedTets<4>& tets, const MixedValues& at,
                                     std::span<const float> q, std::span<float> f) const = 0;
    virtual void add_pressure_forces(const MixedTets<10>& tets, const MixedValues& at,
                                     std::span<const float> q, std::span<float> f) const = 0;
    virtual void add_pressure_forces(const MixedTets<8>& cells, const MixedValues& at,
                                     std::span<const float> q, std::span<float> f) const = 0;
};

}  // namespace livetet
