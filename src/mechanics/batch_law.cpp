#include "mechanics/batch_law.hpp"

#include "mechanics/lane_law.hpp"

namespace livetet {

namespace {

using namespace lanes;

/// P = R (2 mu eps + lambda tr(eps) I), eps = sym(R^T F) - I; with R held its derivative is the
/// same of eps = sym(R^T dF).
struct HookeInLanes {
    static constexpr bool rotates = true, is_affine = true;
    using Number = Lanes<float>;
    using Matrix = Mat3<float>;

    static Matrix stress(const Number& lambda, const Number& mu, const Matrix& H, const Matrix& R) {
        return hooke_stress(lambda, mu, R, plus_identity(H), 1.0F);
    }
    static Matrix increment(const Number& lambda, const Number& mu, const Matrix&, const Matrix& R,
                            const Matrix& dF) {
        return hooke_stress(lambda, mu, R, dF, 0.0F);
    }

    /// theta = tr(R^T F) - 3.
    static Number volume_strain(const Matrix& H, const Matrix& R) {
        const Matrix F = plus_identity(H);
        return (lanes::dot(R.x, F.x) - 1) + (lanes::dot(R.y, F.y) - 1) + (lanes::dot(R.z, F.z) - 1);
    }
    static Matrix volume_gradient(const Matrix&, const Matrix& R) { return R; }
    static Matrix volume_curvature(const Matrix&, const Matrix&, const Matrix&) { return Matrix{}; }
};

/// With the kernels of tets of four nodes that both precisions have.
class HookeLaw final : public LaneLaw<HookeInLanes> {
  public:
    using LaneLaw::add_forces, LaneLaw::add_stiffness_times;
    void add_forces(const TetBatches<float>& batches, BatchRange range, Rotations rotations,
                    std::span<const float> u, std::span<float> f) const override {
        livetet::add_forces(batches, range, rotations, u, f);
    }
    void add_stiffness_times(float factor, const TetBatches<float>& batches, BatchRange range,
                             Rotations rotations, std::span<const float>, std::span<const float> v,
                             std::span<float> f) const override {
        livetet::add_stiffness_times(factor, batches, range, rotations, v, f);
    }
};

}  // namespace

const BatchLaw& hooke_law() {
    static const HookeLaw law;
    return law;
}

}  // namespace livetet
