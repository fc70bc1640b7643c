#pragma once

#include "mechanics/batch_law.hpp"
#include "mechanics/box_lanes.hpp"
#include "mechanics/hex_lanes.hpp"
#include "mechanics/lane_mixed_law.hpp"

namespace livetet {

/// The BatchLaw of a model whose stress is written for lanes:
///
///     struct Law {
///         /// Whether it reads rotations; else R is not to be used.
///         static constexpr bool rotates;
///         /// P = d psi / dF at H = F - I, and its derivative in the direction dF.
///         Matrix stress(const Number& lambda, const Number& mu, const Matrix& H, const Matrix& R);
///         Matrix increment(const Number& lambda, const Number& mu, const Matrix& H,
///                          const Matrix& R, const Matrix& dF);
///     };
///
/// and what LaneMixedLaw asks for; static functions, with Number and Matrix as below. Both are
/// linear in the moduli, which come multiplied by the volume of the point. A law whose increment
/// does not depend on H says so by `static constexpr bool is_affine = true`; it is given zeros, and
/// products need no displacement. Where a law has bounded_increment, with the arguments of
/// increment, products are made of that (see ConstitutiveModel). Those of hexahedra that are boxes
/// of moderate strain take it in the cell's middle (box_lanes.hpp).
template <class Law>
class LaneLaw : public BatchLaw {
  public:
    using Number = lanes::Lanes<float>;
    using Matrix = lanes::Mat3<float>;

    // Flattened, so that less goes through memory: 1.1 to 1.3 times as fast.
    [[gnu::flatten]] void add_forces(const TetBatches<float>& batches, BatchRange range,
                                     Rotations rotations, std::span<const float> u,
                                     std::span<float> f) const override {
        add_all_forces(batches, range, rotations, u, f);
    }
    [[gnu::flatten]] void add_forces(const TetBatches<float, 10>& batches, BatchRange range,
                                     Rotations rotations, std::span<const float> u,
                                     std::span<float> f) const override {
        add_all_forces(batches, range, rotations, u, f);
    }
    [[gnu::flatten]] void add_forces(const TetBatches<float, 8>& batches, BatchRange range,
                                     Rotations rotations, std::span<const float> u,
                                     std::span<float> f) const override {
        lanes::along_axes(batches, [&](auto axes) {
            add_all_forces<decltype(axes)::value>(batches, range, rotations, u, f);
        });
    }
    [[gnu::flatten]] void add_stiffness_times(float factor, const TetBatches<float>& batches,
                                              BatchRange range, Rotations rotations,
                                              std::span<const float> u, std::span<const float> v,
                                              std::span<float> f) const override {
        add_products(factor, batches, range, rotations, u, v, f);
    }
    [[gnu::flatten]] void add_stiffness_times(float factor, const TetBatches<float, 10>& batches,
                                              BatchRange range, Rotations rotations,
                                              std::span<const float> u, std::span<const float> v,
                                              std::span<float> f) const override {
        add_products(factor, batches, range, rotations, u, v, f);
    }
    void add_stiffness_times(float factor, const TetBatches<float, 8>& batches, BatchRange range,
                             Rotations rotations, std::span<const float> u,
                             std::span<const float> v, std::span<float> f) const override {
        lanes::if_boxes(
            batches, range, rotations,
            [&](const auto& boxes) {
                add_box_products(factor, boxes, batches, range, rotations, u, v, f);
            },
            [&] { add_point_products(factor, batches, range, rotations, u, v, f); });
    }
    const MixedLaw& mixed() const override {
        static const LaneMixedLaw<Law> law;
        return law;
    }

  private:
    struct NoGradients {
        template <class Batch>
        NoGradients(const Batch&, const float*) {}
        Matrix at(int) const { return Matrix{}; }
    };
    /// Of the displacement, for an increment.
    template <int nodes>
    using Gradients = std::conditional_t < requires {
        requires Law::is_affine;
    }
    , NoGradients, lanes::PointGradients < float, nodes >> ;

    static Matrix increment(const Number& lambda, const Number& mu, const Matrix& H,
                            const Matrix& R, const Matrix& dF) {
        if constexpr (requires { Law::bounded_increment(lambda, mu, H, R, dF); })
            return Law::bounded_increment(lambda, mu, H, R, dF);
        else
            return Law::increment(lambda, mu, H, R, dF);
    }

    /// Of point q of batch k, of so many batches.
    template <int points>
    static Matrix rotation_at(Rotations rotations, std::size_t batches, std::size_t k, int q) {
        if constexpr (Law::rotates)
            return lanes::load_rotation(
                rotation_of_batch(rotations, rotations.size() == batches ? k : points * k + q));
        else
            return Matrix{};
    }

    template <CellAxes axes = CellAxes::any, int nodes>
    static void add_all_forces(const TetBatches<float, nodes>& batches, BatchRange range,
                               Rotations rotations, std::span<const float> u, std::span<float> f) {
        constexpr int points = TetBatches<float, nodes>::points;
        const Number share = lanes::all_lanes(1.0F / points);
        for (std::size_t k = range.begin; k < range.end; ++k) {
            const auto& b = batches[k];
            const Number lambda = share * lanes::load<float>(b.lambda),
                         mu = share * lanes::load<float>(b.mu);
            const lanes::PointGradients<float, nodes, axes> H(b, u.data());
            lanes::PointForces<float, nodes, axes> forces(b);
            lanes::for_each_index<points>([&](auto q) {
                forces.add(q, Law::stress(lambda, mu, H.at(q),
                                          rotation_at<points>(rotations, batches.all().end, k, q)));
            });
            forces.scatter(f.data());
        }
    }

    template <int nodes>
    static void add_products(float factor, const TetBatches<float, nodes>& batches,
                             BatchRange range, Rotations rotations, std::span<const float> u,
                             std::span<const float> v, std::span<float> f) {
        constexpr int points = TetBatches<float, nodes>::points;
        const Number share = lanes::all_lanes(factor / points);
        for (std::size_t k = range.begin; k < range.end; ++k) {
            const auto& b = batches[k];
            const Number lambda = share * lanes::load<float>(b.lambda),
                         mu = share * lanes::load<float>(b.mu);
            const Gradients<nodes> H(b, u.data());
            const lanes::PointGradients<float, nodes> dF(b, v.data());
            lanes::PointForces<float, nodes> forces(b);
            lanes::for_each_index<points>([&](auto q) {
                forces.add(q, increment(lambda, mu, H.at(q),
                                        rotation_at<points>(rotations, batches.all().end, k, q),
                                        dF.at(q)));
            });
            forces.scatter(f.data());
        }
    }

    /// Products over the eight points: of cells that are no boxes, have a rotation for each point
    /// or are strained too far. Not inlined, to keep the kernel of boxes small.
    [[gnu::noinline]] static void add_point_products(float factor,
                                                     const TetBatches<float, 8>& batches,
                                                     BatchRange range, Rotations rotations,
                                                     std::span<const float> u,
                                                     std::span<const float> v, std::span<float> f) {
        add_products(factor, batches, range, rotations, u, v, f);
    }

    /// See box_lanes.hpp.
    template <CellAxes axes>
    [[gnu::flatten]] static void add_box_products(float factor, const lanes::Boxes<axes>& boxes,
                                                  const TetBatches<float, 8>& batches,
                                                  BatchRange range, Rotations rotations,
                                                  std::span<const float> u,
                                                  std::span<const float> v, std::span<float> f) {
        const Number of_all = lanes::all_lanes(factor);
        for (std::size_t k = range.begin; k < range.end; ++k) {
            const auto& b = batches[k];
            const Number lambda = of_all * lanes::load<float>(b.lambda),
                         mu = of_all * lanes::load<float>(b.mu);
            const Matrix R = lanes::load_rotation(rotation_of_batch(rotations, k));
            lanes::Vec3<float> modes[8], forces[8]{};
            Matrix H{};
            if constexpr (!requires { requires Law::is_affine; }) {
                lanes::gather_modes(b, u.data(), modes);
                H = boxes.mean_gradient(modes);
                if (!lanes::are_moderate(boxes, H, modes)) {
                    add_point_products(factor, batches, {k, k + 1}, rotations, u, v, f);
                    continue;
                }
            }
            lanes::gather_modes(b, v.data(), modes);
            lanes::add_parts_beside_mean(lambda, mu, boxes, R, modes, forces);
            boxes.set_mean_forces(increment(lambda, mu, H, R, boxes.mean_gradient(modes)), forces);
            lanes::scatter_modes(b, forces, f.data());
        }
    }
};

}  // namespace livetet
