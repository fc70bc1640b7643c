#pragma once

#include <cstdint>
#include <vector>

#include "mechanics/batch_law.hpp"

namespace livetet {

/// A BatchLaw for any models, each tet with that of its region: it calls the functions of
/// ConstitutiveModel in double precision, tet by tet. A corotated model's rotation is computed at
/// each call.
class PointwiseLaw final : public BatchLaw {
  public:
    struct Moduli {
        double lambda, mu;  ///< Pa
        ModelChoice model;
    };
    /// `moduli_of_tet`: which of `moduli` each tet of the mesh has; empty where there is but one.
    /// `batches` are asked for the tets in their lanes, so they must be those of that mesh.
    PointwiseLaw(std::vector<Moduli> moduli, std::vector<std::int32_t> moduli_of_tet)
        : moduli_(std::move(moduli)), moduli_of_tet_(std::move(moduli_of_tet)) {}

    void add_forces(const TetBatches<float>& batches, BatchRange range, Rotations,
                    std::span<const float> u, std::span<float> f) const override;
    void add_forces(const TetBatches<float, 10>& batches, BatchRange range, Rotations,
                    std::span<const float> u, std::span<float> f) const override;
    void add_stiffness_times(float factor, const TetBatches<float>& batches, BatchRange range,
                             Rotations, std::span<const float> u, std::span<const float> v,
                             std::span<float> f) const override;
    void add_stiffness_times(float factor, const TetBatches<float, 10>& batches, BatchRange range,
                             Rotations, std::span<const float> u, std::span<const float> v,
                             std::span<float> f) const override;

  private:
    const Moduli& moduli_of(std::int32_t tet) const {
        return moduli_[moduli_of_tet_.empty() ? 0 : moduli_of_tet_[tet]];
    }
    /// f += the nodal forces of the stresses that stress(moduli, H, gradients) gives at each point.
    template <int nodes, class Stress>
    void add(const TetBatches<float, nodes>& batches, BatchRange range, std::span<const float> u,
             std::span<float> f, Stress&& stress) const;
    template <int nodes>
    void add_products(float factor, const TetBatches<float, nodes>& batches, BatchRange range,
                      std::span<const float> u, std::span<const float> v, std::span<float> f) const;

    std::vector<Moduli> moduli_;
    std::vector<std::int32_t> moduli_of_tet_;
};

}  // namespace livetet
