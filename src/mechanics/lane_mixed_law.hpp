#pragma once

#include "mechanics/box_lanes.hpp"
#include "mechanics/hex_lanes.hpp"
#include "mechanics/lanes.hpp"
#include "mechanics/mixed_law.hpp"

namespace livetet {

namespace lanes {

/// The four linear shape functions at point q of a tet of so many nodes.
template <int nodes>
constexpr float linear_shape(int corner, int q) {
    if (nodes == 4) return 0.25F;
    return static_cast<float>(corner == q ? TenNodes::near : TenNodes::far);
}

/// Pressures at the quadrature points of the elements of batch k.
template <int nodes>
class PointPressures {
  public:
    PointPressures(const MixedTets<nodes>& tets, std::size_t k, std::span<const float> p) {
        if (p.empty()) return;
        const auto& b = tets.batches[k];
        for_each_index<4>([&](auto i) {
            for (int l = 0; l < batch_width<float>; ++l) p_[i][l] = p[b.offset[i][l] / 3];
        });
    }
    Lanes<float> at(int q) const {
        Lanes<float> sum{};
        for_each_index<4>([&](auto i) { sum += linear_shape<nodes>(i, q) * p_[i]; });
        return sum;
    }

  private:
    Lanes<float> p_[4]{};
};

/// Hexahedra have one each.
template <>
class PointPressures<8> {
  public:
    PointPressures(const MixedTets<8>& cells, std::size_t k, std::span<const float> p) {
        if (p.empty()) return;
        for (int l = 0; l < batch_width<float>; ++l)
            if (const std::int32_t cell = cells.batches.tet_at(k, l); cell >= 0) p_[l] = p[cell];
    }
    const Lanes<float>& at(int) const { return p_; }

  private:
    Lanes<float> p_{};
};

/// The sums of w_q L_i theta_q over the points; `theta`: w_q theta_q, m^3.
template <int nodes>
class PointVolumes {
  public:
    void add(int q, const Lanes<float>& theta) {
        for_each_index<4>([&](auto i) { g_[i] += linear_shape<nodes>(i, q) * theta; });
    }
    void scatter(const MixedTets<nodes>& tets, std::size_t k, std::span<float> g) const {
        if (g.empty()) return;
        const auto& b = tets.batches[k];
        for_each_index<4>([&](auto i) {
            for (int l = 0; l < batch_width<float>; ++l) g[b.offset[i][l] / 3] += g_[i][l];
        });
    }

  private:
    Lanes<float> g_[4]{};
};

template <>
class PointVolumes<8> {
  public:
    void add(int, const Lanes<float>& theta) { g_ += theta; }
    void scatter(const MixedTets<8>& cells, std::size_t k, std::span<float> g) const {
        if (g.empty()) return;
        for (int l = 0; l < batch_width<float>; ++l)
            if (const std::int32_t cell = cells.batches.tet_at(k, l); cell >= 0) g[cell] += g_[l];
    }

  private:
    Lanes<float> g_{};
};

}  // namespace lanes

/// The volume strain theta = J - 1 of laws over lanes, and its derivatives.
struct DilationInLanes {
    using Number = lanes::Lanes<float>;
    using Matrix = lanes::Mat3<float>;

    /// J - 1 = tr H + tr cof H + det H.
    static Number volume_strain(const Matrix& H, const Matrix&) {
        const Matrix C = lanes::cofactor(H);
        return lanes::trace(H) + lanes::trace(C) + lanes::dot(H.x, C.x);
    }
    static Matrix volume_gradient(const Matrix& H, const Matrix&) {
        return lanes::cofactor(lanes::plus_identity(H));
    }
    static Matrix volume_curvature(const Matrix& H, const Matrix&, const Matrix& dF) {
        return lanes::cofactor_increment(lanes::plus_identity(H), dF);
    }
};

/// The MixedLaw of a model whose stress is written for lanes (see LaneLaw), with three functions
/// more:
///
///     /// theta, d theta / dF, and the derivative of that in the direction dF.
///     Number volume_strain(const Matrix& H, const Matrix& R);
///     Matrix volume_gradient(const Matrix& H, const Matrix& R);
///     Matrix volume_curvature(const Matrix& H, const Matrix& R, const Matrix& dF);
///
/// Products of hexahedra that are boxes of moderate strain, with one rotation each, take the law's
/// tangent and d theta / dF in the cell's middle (box_lanes.hpp). Forces and volumes are always
/// those of all points.
template <class Law>
class LaneMixedLaw final : public MixedLaw {
  public:
    using Number = lanes::Lanes<float>;
    using Matrix = lanes::Mat3<float>;

    // Flattened: see LaneLaw.
    [[gnu::flatten]] void add_forces(const MixedTets<4>& tets, const MixedValues& at,
                                     const MixedForces& to) const override {
        add_all_forces(tets, at, to);
    }
    [[gnu::flatten]] void add_forces(const MixedTets<10>& tets, const MixedValues& at,
                                     const MixedForces& to) const override {
        add_all_forces(tets, at, to);
    }
    [[gnu::flatten]] void add_forces(const MixedTets<8>& cells, const MixedValues& at,
                                     const MixedForces& to) const override {
        lanes::along_axes(cells.batches,
                          [&](auto axes) { add_all_forces<decltype(axes)::value>(cells, at, to); });
    }
    [[gnu::flatten]] void add_products(const MixedTets<4>& tets, float factor,
                                       const MixedValues& at, const MixedValues& v,
                                       const MixedForces& to) const override {
        add_all_products(tets, factor, at, v, to);
    }
    [[gnu::flatten]] void add_products(const MixedTets<10>& tets, float factor,
                                       const MixedValues& at, const MixedValues& v,
                                       const MixedForces& to) const override {
        add_all_products(tets, factor, at, v, to);
    }
    void add_products(const MixedTets<8>& cells, float factor, const MixedValues& at,
                      const MixedValues& v, const MixedForces& to) const override {
        lanes::if_boxes(
            cells.batches, cells.range, cells.rotations,
            [&](const auto& boxes) { add_box_products(boxes, cells, factor, at, v, to); },
            [&] { add_point_products(cells, factor, at, v, to); });
    }
    [[gnu::flatten]] void add_pressure_forces(const MixedTets<4>& tets, const MixedValues& at,
                                              std::span<const float> q,
                                              std::span<float> f) const override {
        add_all_pressure_forces(tets, at, q, f);
    }
    [[gnu::flatten]] void add_pressure_forces(const MixedTets<10>& tets, const MixedValues& at,
                                              std::span<const float> q,
                                              std::span<float> f) const override {
        add_all_pressure_forces(tets, at, q, f);
    }
    void add_pressure_forces(const MixedTets<8>& cells, const MixedValues& at,
                             std::span<const float> q, std::span<float> f) const override {
        lanes::if_boxes(
            cells.batches, cells.range, cells.rotations,
            [&](const auto& boxes) { add_box_pressure_forces(boxes, cells, at, q, f); },
            [&] { add_point_pressure_forces(cells, at, q, f); });
    }

  private:
    template <int nodes>
    static constexpr int points = TetBatches<float, nodes>::points;

    template <int nodes>
    static Matrix rotation_at(const MixedTets<nodes>& tets, std::size_t k, int q) {
        if constexpr (Law::rotates)
            return lanes::load_rotation(rotation_of_batch(
                tets.rotations,
                tets.rotations.size() == tets.batches.all().end ? k : points<nodes> * k + q));
        else
            return Matrix{};
    }
    /// The volume of a point, m^3.
    template <int nodes>
    static Number volume(const MixedTets<nodes>& tets, const TetBatch<float, nodes>& b) {
        return (tets.per_modulus / points<nodes>)*lanes::load<float>(b.lambda);
    }

    template <CellAxes axes = CellAxes::any, int nodes>
    static void add_all_forces(const MixedTets<nodes>& tets, const MixedValues& at,
                               const MixedForces& to) {
        const Number share = lanes::all_lanes(1.0F / points<nodes>);
        for (std::size_t k = tets.range.begin; k < tets.range.end; ++k) {
            const auto& b = tets.batches[k];
            const Number mu = share * lanes::load<float>(b.mu), w = volume(tets, b);
            const lanes::PointGradients<float, nodes, axes> H(b, at.u.data());
            const lanes::PointPressures<nodes> p(tets, k, at.p);
            lanes::PointForces<float, nodes, axes> forces(b);
            lanes::PointVolumes<nodes> volumes;
            lanes::for_each_index<points<nodes>>([&](auto q) {
                const Matrix Hq = H.at(q), R = rotation_at(tets, k, q);
                forces.add(q, Law::stress(Number{}, mu, Hq, R) +
                                  (w * p.at(q)) * Law::volume_gradient(Hq, R));
                volumes.add(q, w * Law::volume_strain(Hq, R));
            });
            forces.scatter(to.f.data());
            volumes.scatter(tets, k, to.g);
        }
    }

    template <int nodes>
    static void add_all_products(const MixedTets<nodes>& tets, float factor, const MixedValues& at,
                                 const MixedValues& v, const MixedForces& to) {
        const Number share = lanes::all_lanes(factor / points<nodes>);
        for (std::size_t k = tets.range.begin; k < tets.range.end; ++k) {
            const auto& b = tets.batches[k];
            const Number mu = share * lanes::load<float>(b.mu), w = volume(tets, b);
            const lanes::PointGradients<float, nodes> H(b, at.u.data()), dF(b, v.u.data());
            const lanes::PointPressures<nodes> p(tets, k, at.p), dp(tets, k, v.p);
            lanes::PointForces<float, nodes> forces(b);
            lanes::PointVolumes<nodes> volumes;
            lanes::for_each_index<points<nodes>>([&](auto q) {
                const Matrix Hq = H.at(q), dFq = dF.at(q), R = rotation_at(tets, k, q),
                             N = Law::volume_gradient(Hq, R);
                forces.add(q, Law::increment(Number{}, mu, Hq, R, dFq) +
                                  (factor * w * p.at(q)) * Law::volume_curvature(Hq, R, dFq) +
                                  (w * dp.at(q)) * N);
                volumes.add(q, w * lanes::dot(N, dFq));
            });
            forces.scatter(to.f.data());
            volumes.scatter(tets, k, to.g);
        }
    }

    template <int nodes>
    static void add_all_pressure_forces(const MixedTets<nodes>& tets, const MixedValues& at,
                                        std::span<const float> pressures, std::span<float> f) {
        for (std::size_t k = tets.range.begin; k < tets.range.end; ++k) {
            const auto& b = tets.batches[k];
            const Number w = volume(tets, b);
            const lanes::PointGradients<float, nodes> H(b, at.u.data());
            const lanes::PointPressures<nodes> p(tets, k, pressures);
            lanes::PointForces<float, nodes> forces(b);
            lanes::for_each_index<points<nodes>>([&](auto q) {
                forces.add(q,
                           (w * p.at(q)) * Law::volume_gradient(H.at(q), rotation_at(tets, k, q)));
            });
            forces.scatter(f.data());
        }
    }

    /// Over the eight points, as LaneLaw has it. Not inlined, to keep the kernels of boxes small.
    [[gnu::noinline]] static void add_point_products(const MixedTets<8>& cells, float factor,
                                                     const MixedValues& at, const MixedValues& v,
                                                     const MixedForces& to) {
        add_all_products(cells, factor, at, v, to);
    }
    [[gnu::noinline]] static void add_point_pressure_forces(const MixedTets<8>& cells,
                                                            const MixedValues& at,
                                                            std::span<const float> q,
                                                            std::span<float> f) {
        add_all_pressure_forces(cells, at, q, f);
    }

    /// A batch of boxes at a displacement.
    struct BoxState {
        MixedTets<8> batch;
        Matrix H{}, R;            ///< in the middle, of the cell
        bool is_moderate = true;  ///< also where the law does not ask

        template <CellAxes axes>
        BoxState(const lanes::Boxes<axes>& boxes, const MixedTets<8>& cells, std::size_t k,
                 const MixedValues& at)
            : batch{cells.batches, cells.per_modulus, {k, k + 1}, cells.rotations},
              R(lanes::load_rotation(rotation_of_batch(cells.rotations, k))) {
            if constexpr (!requires { requires Law::is_affine; }) {
                lanes::Vec3<float> modes[8];
                lanes::gather_modes(cells.batches[k], at.u.data(), modes);
                H = boxes.mean_gradient(modes);
                is_moderate = lanes::are_moderate(boxes, H, modes);
            }
        }
    };

    /// Pressures act on the mean gradient, with N in the cell's middle.
    template <CellAxes axes>
    [[gnu::flatten]] static void add_box_products(const lanes::Boxes<axes>& boxes,
                                                  const MixedTets<8>& cells, float factor,
                                                  const MixedValues& at, const MixedValues& v,
                                                  const MixedForces& to) {
        for (std::size_t k = cells.range.begin; k < cells.range.end; ++k) {
            const BoxState in(boxes, cells, k, at);
            if (!in.is_moderate) {
                add_point_products(in.batch, factor, at, v, to);
                continue;
            }
            const auto& b = cells.batches[k];
            const Number mu = lanes::all_lanes(factor) * lanes::load<float>(b.mu),
                         w = lanes::all_lanes(cells.per_modulus) * lanes::load<float>(b.lambda);
            const lanes::PointPressures<8> p(cells, k, at.p), dp(cells, k, v.p);
            lanes::Vec3<float> modes[8], forces[8]{};
            lanes::gather_modes(b, v.u.data(), modes);
            lanes::add_parts_beside_mean(Number{}, mu, boxes, in.R, modes, forces);
            const Matrix dF = boxes.mean_gradient(modes), N = Law::volume_gradient(in.H, in.R);
            boxes.set_mean_forces(
                Law::increment(Number{}, mu, in.H, in.R, dF) +
                    (factor * w * p.at(0)) * Law::volume_curvature(in.H, in.R, dF) +
                    (w * dp.at(0)) * N,
                forces);
            lanes::scatter_modes(b, forces, to.f.data());
            lanes::PointVolumes<8> volumes;
            volumes.add(0, w * lanes::dot(N, dF));
            volumes.scatter(cells, k, to.g);
        }
    }

    template <CellAxes axes>
    [[gnu::flatten]] static void add_box_pressure_forces(const lanes::Boxes<axes>& boxes,
                                                         const MixedTets<8>& cells,
                                                         const MixedValues& at,
                                                         std::span<const float> q,
                                                         std::span<float> f) {
        for (std::size_t k = cells.range.begin; k < cells.range.end; ++k) {
            const BoxState in(boxes, cells, k, at);
            if (!in.is_moderate) {
                add_point_pressure_forces(in.batch, at, q, f);
                continue;
            }
            const auto& b = cells.batches[k];
            const Number w = lanes::all_lanes(cells.per_modulus) * lanes::load<float>(b.lambda);
            lanes::Vec3<float> forces[8]{};
            boxes.set_mean_forces((w * lanes::PointPressures<8>(cells, k, q).at(0)) *
                                      Law::volume_gradient(in.H, in.R),
                                  forces);
            lanes::scatter_modes(b, forces, f.data());
        }
    }
};

}  // namespace livetet
