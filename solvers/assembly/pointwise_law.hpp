#pragma once

#include <cstdint>
#include <vector>

#include "mechanics/batch_law.hpp"

namespace livetet {

/// Models and moduli of the tets of a mesh, by region.
class PointwiseModels {
  public:
    struct Moduli {
        double lambda, mu;  ///< Pa
        ModelChoice model;
    };
    /// `moduli_of_tet`: which of `moduli` each tet has; empty where there is but one.
    PointwiseModels(std::vector<Moduli> moduli, std::vector<std::int32_t> moduli_of_tet)
        : moduli_(std::move(moduli)), moduli_of_tet_(std::move(moduli_of_tet)) {}

    const Moduli& of(std::int32_t tet) const {
        return moduli_[moduli_of_tet_.empty() ? 0 : moduli_of_tet_[tet]];
    }

  private:
    std::vector<Moduli> moduli_;
    std::vector<std::int32_t> moduli_of_tet_;
};

/// PointwiseLaw in the mixed form.
class PointwiseMixedLaw final : public MixedLaw {
  public:
    /// `models` must outlive this.
    explicit PointwiseMixedLaw(const PointwiseModels& models) : models_(models) {}

    void add_forces(const MixedTets<4>& tets, const MixedValues& at,
                    const MixedForces& to) const override;
    void add_forces(const MixedTets<10>& tets, const MixedValues& at,
                    const MixedForces& to) const override;
    void add_forces(const MixedTets<8>& cells, const MixedValues& at,
                    const MixedForces& to) const override;
    void add_products(const MixedTets<4>& tets, float factor, const MixedValues& at,
                      const MixedValues& v, const MixedForces& to) const override;
    void add_products(const MixedTets<10>& tets, float factor, const MixedValues& at,
                      const MixedValues& v, const MixedForces& to) const override;
    void add_products(const MixedTets<8>& cells, float factor, const MixedValues& at,
                      const MixedValues& v, const MixedForces& to) const override;
    void add_pressure_forces(const MixedTets<4>& tets, const MixedValues& at,
                             std::span<const float> q, std::span<float> f) const override;
    void add_pressure_forces(const MixedTets<10>& tets, const MixedValues& at,
                             std::span<const float> q, std::span<float> f) const override;
    void add_pressure_forces(const MixedTets<8>& cells, const MixedValues& at,
                             std::span<const float> q, std::span<float> f) const override;

  private:
    const PointwiseModels& models_;
};

/// A BatchLaw for any models, each tet with that of its region: it calls the functions of
/// ConstitutiveModel in double precision, tet by tet. A corotated model's rotation is computed at
/// each call.
class PointwiseLaw final : public BatchLaw {
  public:
    /// Batches are asked for the tets in their lanes, so they must be those of the models' mesh.
    explicit PointwiseLaw(PointwiseModels models) : models_(std::move(models)), mixed_(models_) {}
    PointwiseLaw(const PointwiseLaw&) = delete;
    PointwiseLaw& operator=(const PointwiseLaw&) = delete;

    void add_forces(const TetBatches<float>& batches, BatchRange range, Rotations,
                    std::span<const float> u, std::span<float> f) const override;
    void add_forces(const TetBatches<float, 10>& batches, BatchRange range, Rotations,
                    std::span<const float> u, std::span<float> f) const override;
    void add_forces(const TetBatches<float, 8>& batches, BatchRange range, Rotations,
                    std::span<const float> u, std::span<float> f) const override;
    void add_stiffness_times(float factor, const TetBatches<float>& batches, BatchRange range,
                             Rotations, std::span<const float> u, std::span<const float> v,
                             std::span<float> f) const override;
    void add_stiffness_times(float factor, const TetBatches<float, 10>& batches, BatchRange range,
                             Rotations, std::span<const float> u, std::span<const float> v,
                             std::span<float> f) const override;
    void add_stiffness_times(float factor, const TetBatches<float, 8>& batches, BatchRange range,
                             Rotations, std::span<const float> u, std::span<const float> v,
                             std::span<float> f) const override;
    const MixedLaw& mixed() const override { return mixed_; }

  private:
    /// f += the nodal forces of the stresses that stress(moduli, H, gradients) gives at each point.
    template <int nodes, class Stress>
    void add(const TetBatches<float, nodes>& batches, BatchRange range, std::span<const float> u,
             std::span<float> f, Stress&& stress) const;
    template <int nodes>
    void add_products(float factor, const TetBatches<float, nodes>& batches, BatchRange range,
                      std::span<const float> u, std::span<const float> v, std::span<float> f) const;

    PointwiseModels models_;
    PointwiseMixedLaw mixed_;
};

}  // namespace livetet
