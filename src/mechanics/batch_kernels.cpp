#include "mechanics/batch_kernels.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cstring>
#include <numeric>

#include "mechanics/hex_lanes.hpp"
#include "mechanics/lanes.hpp"
#include "mechanics/materials/corotated.hpp"
#include "mechanics/rotation.hpp"
#include "mechanics/scaled_stiffness.hpp"

namespace livetet {

using namespace lanes;

namespace {

template <class Real>
std::array<std::int32_t, 4> nodes_of_lane(const TetBatch<Real>& b, int lane) {
    return {b.offset[0][lane] / 3, b.offset[1][lane] / 3, b.offset[2][lane] / 3,
            b.offset[3][lane] / 3};
}

/// The first eight numbers of a column-major 3x3 block take so many registers.
template <class Real>
inline constexpr int block_parts = 8 / batch_width<Real>;

/// For p = {x, y, z, any}, rows = (x y z x y z x y) and columns = (x x x y y y z z): the first
/// eight numbers of a b^T are rows of a times columns of b.
template <class Real>
void spread(const Real* p, Lanes<Real> (&rows)[block_parts<Real>],
            Lanes<Real> (&columns)[block_parts<Real>]) {
    const Four<Real> a = load_four(p);
    if constexpr (block_parts<Real> == 1) {
        rows[0] = __builtin_shufflevector(a, a, 0, 1, 2, 0, 1, 2, 0, 1);
        columns[0] = __builtin_shufflevector(a, a, 0, 0, 0, 1, 1, 1, 2, 2);
    } else {
        rows[0] = __builtin_shufflevector(a, a, 0, 1, 2, 0);
        rows[1] = __builtin_shufflevector(a, a, 1, 2, 0, 1);
        columns[0] = __builtin_shufflevector(a, a, 0, 0, 0, 1);
        columns[1] = __builtin_shufflevector(a, a, 1, 1, 2, 2);
    }
}

/// The first eight numbers of the unit matrix; in double, both halves are the same.
template <class Real>
constexpr Lanes<Real> unit_block() {
    if constexpr (block_parts<Real> == 1)
        return Lanes<Real>{1, 0, 0, 0, 1, 0, 0, 0};
    else
        return Lanes<Real>{1, 0, 0, 0};
}

template <class Real>
void add_to(Real* p, const Lanes<Real>& x) {
    Lanes<Real> sum;
    std::memcpy(&sum, p, sizeof sum);
    sum += x;
    std::memcpy(p, &sum, sizeof sum);
}

}  // namespace

namespace {

/// Which of `tets` go to each part, and behind them those that wait for another round.
template <class Nodes>
std::vector<std::vector<std::int32_t>> cut_into_parts(std::span<const Nodes> all,
                                                      std::span<const std::int32_t> tets, int parts,
                                                      std::size_t nodes) {
    std::vector<std::vector<std::int32_t>> cut;
    const auto count = static_cast<double>(tets.size());
    double waiting = 0;
    // How many wait is known only when it was cut: a second cut makes the work even.
    for (int trial = 0; trial < (parts > 1 ? 3 : 1); ++trial) {
        cut.assign(parts + 1, {});
        const double first = (1 - waiting) / parts;
        const auto part_of = [&](std::size_t k) {
            const double place = (static_cast<double>(k) + 0.5) / count;
            return place < first
                       ? 0
                       : std::min(parts - 1, 1 + static_cast<int>((place - first) / (1 - first) *
                                                                  (parts - 1)));
        };
        std::vector<int> earliest(nodes, parts);
        for (std::size_t k = 0; k < tets.size(); ++k)
            for (const std::int32_t n : all[tets[k]])
                earliest[n] = std::min(earliest[n], part_of(k));
        for (std::size_t k = 0; k < tets.size(); ++k) {
            const Nodes& tet = all[tets[k]];
            const bool own = std::all_of(tet.begin(), tet.end(),
                                         [&](std::int32_t n) { return earliest[n] == part_of(k); });
            cut[own ? part_of(k) : parts].push_back(tets[k]);
        }
        waiting = static_cast<double>(cut[parts].size()) / std::max(count, 1.0);
    }
    return cut;
}

/// Whether `next` is the cell behind `cell` along x, and its nodes are the next ones.
bool follows(const std::array<std::int32_t, 8>& cell, const std::array<std::int32_t, 8>& next) {
    for (int c = 0; c < 8; c += 2)
        if (cell[c + 1] != cell[c] + 1 || next[c] != cell[c + 1] || next[c + 1] != next[c] + 1)
            return false;
    return true;
}

/// The cells of a part, whole rows of `width` first.
void put_rows_first(std::span<const std::array<std::int32_t, 8>> cells,
                    std::vector<std::int32_t>& part, int width) {
    std::vector<std::int32_t> rows, others;
    for (auto begin = part.begin(); begin != part.end();) {
        auto end = begin + 1;
        while (end != part.end() && end - begin < width && follows(cells[end[-1]], cells[*end]))
            ++end;
        auto& list = end - begin == width ? rows : others;
        list.insert(list.end(), begin, end);
        begin = end;
    }
    rows.insert(rows.end(), others.begin(), others.end());
    part = std::move(rows);
}

template <class Nodes>
BatchParts part_lanes(std::span<const Nodes> tets, int parts, int width) {
    std::size_t nodes = 0;
    for (const Nodes& t : tets)
        for (const std::int32_t n : t) nodes = std::max(nodes, static_cast<std::size_t>(n) + 1);
    BatchParts result;
    std::vector<std::int32_t> left(tets.size());
    std::iota(left.begin(), left.end(), 0);
    do {
        auto cut = cut_into_parts<Nodes>(tets, left, parts, nodes);
        left = std::move(cut.back());
        cut.pop_back();
        result.rounds.emplace_back();
        for (std::vector<std::int32_t>& part : cut) {
            if constexpr (std::tuple_size_v<Nodes> == 8) put_rows_first(tets, part, width);
            part.resize((part.size() + width - 1) / width * width, -1);
            const std::size_t begin = result.tet_of_lane.size() / width;
            result.tet_of_lane.insert(result.tet_of_lane.end(), part.begin(), part.end());
            result.rounds.back().push_back({begin, result.tet_of_lane.size() / width});
        }
        parts = std::max(1, parts / 2);
    } while (!left.empty());
    return result;
}

}  // namespace

BatchParts part_batches(std::span<const std::array<std::int32_t, 4>> tets, int parts, int width) {
    return part_lanes(tets, parts, width);
}

BatchParts part_batches(std::span<const std::array<std::int32_t, 10>> tets, int parts, int width) {
    return part_lanes(tets, parts, width);
}

BatchParts part_batches(std::span<const std::array<std::int32_t, 8>> cells, int parts, int width) {
    return part_lanes(cells, parts, width);
}

template <class Real, int nodes>
TetBatches<Real, nodes>::TetBatches(const ElementOf& element, std::span<const Nodes> tets)
    : TetBatches(element, tets, part_batches(tets, 1, batch_width<Real>)) {}

template <class Real, int nodes>
TetBatches<Real, nodes>::TetBatches(const ElementOf& element, std::span<const Nodes> tets,
                                    const BatchParts& parts)
    : tet_of_lane_(parts.tet_of_lane), batches_(tet_of_lane_.size() / batch_width<Real>) {
    std::int32_t last = 0;
    for (std::size_t k = 0; k < tet_of_lane_.size(); ++k) {
        TetBatch<Real, nodes>& b = batches_[k / batch_width<Real>];
        const std::size_t lane = k % batch_width<Real>;
        const bool empty = tet_of_lane_[k] < 0;
        const std::int32_t e = empty ? last : tet_of_lane_[k];
        const TetElement of_tet = element(static_cast<std::size_t>(e));
        const double volume = empty ? 0 : of_tet.volume;
        last = e;
        for (int m = 0; m < 9; ++m)
            b.gradients[m][lane] = static_cast<Real>(of_tet.gradients(m % 3, 1 + m / 3));
        b.lambda[lane] = static_cast<Real>(volume * of_tet.lambda);
        b.mu[lane] = static_cast<Real>(volume * of_tet.mu);
        for (int i = 0; i < nodes; ++i) b.offset[i][lane] = 3 * tets[e][i];
    }
    if constexpr (nodes == 8) {
        find_rows(tets);
        constexpr Real rounding = Real(1e-7);  // of gradients that are zero but for it
        const bool are_aligned = std::all_of(batches_.begin(), batches_.end(), [](const auto& b) {
            for (int m = 0; m < 9; ++m)
                for (int l = 0; l < batch_width<Real>; ++l)
                    if (m % 4 != 0 && std::abs(b.gradients[m][l]) >
                                          rounding * std::abs(b.gradients[m / 3 * 4][l]))
                        return false;
            return true;
        });
        if (are_aligned) axes_ = CellAxes::aligned;
    }
}

template <class Real, int nodes>
void TetBatches<Real, nodes>::find_rows(std::span<const Nodes> cells) {
    if constexpr (nodes == 8)
        for (std::size_t k = 0; k < batches_.size(); ++k) {
            const std::int32_t* lanes = tet_of_lane_.data() + k * batch_width<Real>;
            bool& is_row = batches_[k].is_row;
            is_row = lanes[batch_width<Real> - 1] >= 0;
            for (int l = 1; l < batch_width<Real> && is_row; ++l)
                is_row = follows(cells[lanes[l - 1]], cells[lanes[l]]);
        }
}

template <class Real, int nodes>
std::vector<RotationBatch<Real>> TetBatches<Real, nodes>::make_fixed_rotations() {
    RotationBatch<Real> identity{};
    std::fill_n(identity.quaternion[0], batch_width<Real>, Real(1));
    return {identity};
}

template <class Real, int nodes>
std::vector<RotationBatch<Real>> TetBatches<Real, nodes>::make_rotations() const {
    return std::vector<RotationBatch<Real>>(points * batches_.size(),
                                            make_fixed_rotations().front());
}

namespace {

/// R with rotation_of(F) in the lanes that are `left`.
template <class Real, class Mask>
Mat3<Real> with_rotations_of(const Mat3<Real>& F, const Mask& left, const Mat3<Real>& R) {
    Real of_F[9][batch_width<Real>], of_R[9][batch_width<Real>];
    store_matrix(F, of_F);
    store_matrix(R, of_R);
    for (int l = 0; l < batch_width<Real>; ++l) {
        if (!left[l]) continue;
        Eigen::Matrix3d one;
        for (int m = 0; m < 9; ++m) one(m % 3, m / 3) = of_F[m][l];
        one = rotation_of(one);
        for (int m = 0; m < 9; ++m) of_R[m][l] = static_cast<Real>(one(m % 3, m / 3));
    }
    return load_matrix<Real>(of_R);
}

template <class Real>
Mat3<Real> rotations_of(const Mat3<Real>& F) {
    // The error after a step is about half the square of the step.
    constexpr Real small_enough = sizeof(Real) == 4 ? Real(1e-7) : Real(1e-14);
    const Lanes<Real> n = dot(F, F), third = n * Real(1. / 3), det = dot(F.x, cross(F.y, F.z));
    // rotation_of's det >= 0.1 at |F|^2 = 3, and a size at which no power of it over- or
    // underflows.
    const auto usual = det > 0 && det * det > Real(0.01) * third * third * third &&
                       n > Real(1e-2) && n < Real(1e2);
    Mat3<Real> R = F;
    auto moving = usual;
    for (int step = 0; step < 12 && any(moving); ++step) {
        const Mat3<Real> c = cofactor(R);
        const Lanes<Real> half = all_lanes(Real(0.5)), s = half / dot(R.x, c.x);
        const Mat3<Real> next{half * R.x + s * c.x, half * R.y + s * c.y, half * R.z + s * c.z};
        const Mat3<Real> change = next - R;
        R = next;
        moving = usual && dot(change, change) > small_enough;
    }
    const auto left = !usual || moving;
    return any(left) ? with_rotations_of(F, left, R) : R;
}

}  // namespace

namespace {

template <CellAxes axes, class Real, int nodes>
void update_rotations_along(const TetBatches<Real, nodes>& batches, BatchRange range,
                            std::span<const Real> u, std::span<RotationBatch<Real>> rotations) {
    constexpr int points = TetBatches<Real, nodes>::points;
    for (std::size_t k = range.begin; k < range.end; ++k) {
        const PointGradients<Real, nodes, axes> H(batches[k], u.data());
        if (rotations.size() == batches.all().end) {
            store_rotation(rotations_of(plus_identity(H.centre())), rotations[k]);
            continue;
        }
        for (int q = 0; q < points; ++q)
            store_rotation(rotations_of(plus_identity(H.at(q))), rotations[points * k + q]);
    }
}

}  // namespace

template <class Real, int nodes>
void update_rotations(const TetBatches<Real, nodes>& batches, BatchRange range,
                      std::span<const Real> u, std::span<RotationBatch<Real>> rotations) {
    along_axes(batches, [&](auto axes) {
        update_rotations_along<decltype(axes)::value>(batches, range, u, rotations);
    });
}

namespace {

/// f_i += sum_q stress(lambda, mu, R, H) grad N_i with the moduli times the volume of the point and
/// `factor`, and H = grad u.
template <class Real, int nodes, class Stress>
void add_point_forces(Real factor, const TetBatches<Real, nodes>& batches, BatchRange range,
                      std::span<const RotationBatch<Real>> rotations, std::span<const Real> u,
                      std::span<Real> f, Stress&& stress) {
    constexpr int points = TetBatches<Real, nodes>::points;
    const Lanes<Real> share = all_lanes(factor / points);
    for (std::size_t k = range.begin; k < range.end; ++k) {
        const TetBatch<Real, nodes>& b = batches[k];
        const Lanes<Real> lambda = share * load<Real>(b.lambda), mu = share * load<Real>(b.mu);
        const PointGradients<Real, nodes> H(b, u.data());
        PointForces<Real, nodes> forces(b);
        for (int q = 0; q < points; ++q) {
            const auto& rotation = rotation_of_batch(rotations, points * k + q);
            forces.add(q, stress(lambda, mu, load_rotation(rotation), H.at(q)));
        }
        forces.scatter(f.data());
    }
}

}  // namespace

template <class Real, int nodes>
void add_forces(const TetBatches<Real, nodes>& batches, BatchRange range,
                std::span<const RotationBatch<Real>> rotations, std::span<const Real> u,
                std::span<Real> f) {
    add_point_forces(Real(1), batches, range, rotations, u, f,
                     [](const auto& lambda, const auto& mu, const auto& R, const auto& H) {
                         return hooke_stress(lambda, mu, R, plus_identity(H), Real(1));
                     });
}

// Products are flattened, so that less goes through memory.

template <class Real, int nodes>
[[gnu::flatten]] void add_stiffness_times(Real factor, const TetBatches<Real, nodes>& batches,
                                          BatchRange range,
                                          std::span<const RotationBatch<Real>> rotations,
                                          std::span<const Real> v, std::span<Real> f) {
    add_point_forces(factor, batches, range, rotations, v, f,
                     [](const auto& lambda, const auto& mu, const auto& R, const auto& H) {
                         return hooke_stress(lambda, mu, R, H, Real(0));
                     });
}

/// h, the dot products and the last number of each block are made lane by lane; then each tet's
/// blocks are made on their own, eight numbers a register (or two), because they go to memory that
/// way: of a 3x3 block in column-major order, h_i h_j^T is (x y z x y z x y) of h_i times (x x x y
/// y y z z) of h_j, and its transpose the same with i and j exchanged.
template <class Real>
void assemble(const TetBatches<Real>& batches, BatchRange range,
              std::span<const RotationBatch<Real>> rotations, Real scale,
              const BlockPattern& pattern, std::span<Real> values, int part) {
    constexpr int width = batch_width<Real>, parts = block_parts<Real>;
    for (std::size_t k = range.begin; k < range.end; ++k) {
        const TetBatch<Real>& b = batches[k];
        const Mat3<Real> g = load_matrix<Real>(b.gradients),
                         R = load_rotation(rotation_of_batch(rotations, k));
        const Lanes<Real> lambda = scale * load<Real>(b.lambda), mu = scale * load<Real>(b.mu);
        Vec3<Real> h[4] = {{}, R * g.x, R * g.y, R * g.z};
        h[0] = -(h[1] + h[2] + h[3]);
        alignas(32) Real corners[4][width][4], dots[4][4][width], last[4][4][width];
        for (int i = 0; i < 4; ++i) {
            transpose(h[i], i == 0 ? lambda : mu, corners[i]);
            for (int j = i; j < 4; ++j) {
                const Lanes<Real> d = mu * dot(h[i], h[j]);
                store<Real>(d, dots[i][j]);
                store<Real>((lambda + mu) * h[i].z * h[j].z + d, last[i][j]);
            }
        }
        for (int l = 0; l < width; ++l) {
            const std::int32_t e = batches.tet_at(k, l);
            if (e < 0) continue;
            const int p = place<Real>(l);
            const Real l_lambda = corners[0][p][3], l_mu = corners[1][p][3];
            Lanes<Real> row[4][parts], column[4][parts], lambda_row[4][parts], mu_row[4][parts];
            for (int i = 0; i < 4; ++i) {
                spread(corners[i][p], row[i], column[i]);
                for (int n = 0; n < parts; ++n) {
                    lambda_row[i][n] = l_lambda * row[i][n];
                    mu_row[i][n] = l_mu * row[i][n];
                }
            }
            const std::array<std::int32_t, 4> node = nodes_of_lane(b, l);
            // Unrolled so that the spread corners stay in registers: 1.4 times as fast.
#pragma GCC unroll 4
            for (int i = 0; i < 4; ++i) {
                if (node[i] >= pattern.owned()) continue;
#pragma GCC unroll 4
                for (int j = 0; j < 4; ++j) {
                    if (pattern.part_of(node[j]) != part) continue;
                    Real* value = values.data() + 9 * static_cast<std::size_t>(
                                                          pattern.place(e, i, j, node[i], node[j]));
                    const int low = std::min(i, j), high = std::max(i, j);
                    const Lanes<Real> d = dots[low][high][l] * unit_block<Real>();
                    for (int n = 0; n < parts; ++n)
                        add_to(value + n * width,
                               lambda_row[i][n] * column[j][n] + (mu_row[j][n] * column[i][n] + d));
                    value[8] += last[low][high][l];
                }
            }
        }
    }
}

namespace {

/// What the derivative of the rotation adds to the corotated tangent at a point: with S = R^T F,
/// G = tr(S) I - S and p the pressure,
///
///     N = (p - 2 mu) (R G R^T)^-1,   dP = 2 mu dF + lambda (R : dF) R + [N a]x R,
///
/// a = the axial vector of dF R^T - R dF^T (from dR = R [w]x, G w = axial(R^T dF - dF^T R)). In the
/// modes of N the tangent has the eigenvalues 2 (mu + n): n = -mu where it is to have none that is
/// negative, and where an eigenvalue of G, a sum of two stretches, is too small to divide by.
/// `mu` and `p`: times the volume of the point.
Mat3<double> turn_stiffness(const Mat3<double>& R, const Mat3<double>& F, const Lanes<double>& mu,
                            const Lanes<double>& p, Tangent tangent) {
    using Lane = Lanes<double>;
    // R G R^T = tr(S) I - F R^T, symmetric: (xx, yy, zz, xy, yz, zx)
    const Lane trace = dot(R, F);
    const Lane xx = trace - (F.x.x * R.x.x + F.y.x * R.y.x + F.z.x * R.z.x),
               yy = trace - (F.x.y * R.x.y + F.y.y * R.y.y + F.z.y * R.z.y),
               zz = trace - (F.x.z * R.x.z + F.y.z * R.y.z + F.z.z * R.z.z),
               xy = -(F.x.x * R.x.y + F.y.x * R.y.y + F.z.x * R.z.y),
               yz = -(F.x.y * R.x.z + F.y.y * R.y.z + F.z.y * R.z.z),
               zx = -(F.x.z * R.x.x + F.y.z * R.y.x + F.z.z * R.z.x);
    // Its eigenvalues are above `min_eigenvalue` where the leading minors of R G R^T -
    // min_eigenvalue I are positive.
    const Lane cut = all_lanes(Corotated::min_turned_stretch), zero_below = 2 - p / mu;
    const Lane min_eigenvalue =
        tangent == Tangent::positive ? (zero_below > cut ? zero_below : cut) : cut;
    const Lane ax = xx - min_eigenvalue, ay = yy - min_eigenvalue, az = zz - min_eigenvalue,
               minor = ax * ay - xy * xy;
    const auto usual =
        ax > 0 && minor > 0 && az * minor - ax * yz * yz - ay * zx * zx + 2 * xy * yz * zx > 0;
    const Vec3<double> c0{yy * zz - yz * yz, yz * zx - xy * zz, xy * yz - yy * zx};
    const Lane factor = (p - 2 * mu) / (xx * c0.x + xy * c0.y + zx * c0.z);
    const Lane nxx = factor * c0.x, nxy = factor * c0.y, nzx = factor * c0.z,
               nyy = factor * (xx * zz - zx * zx), nyz = factor * (xy * zx - xx * yz),
               nzz = factor * (xx * yy - xy * xy);
    Mat3<double> N{{nxx, nxy, nzx}, {nxy, nyy, nyz}, {nzx, nyz, nzz}};
    if (!any(!usual)) return N;
    for (int l = 0; l < batch_width<double>; ++l) {
        if (usual[l]) continue;
        Eigen::Matrix3d of_lane;
        of_lane << xx[l], xy[l], zx[l], xy[l], yy[l], yz[l], zx[l], yz[l], zz[l];
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> modes(of_lane);
        Eigen::Vector3d n;
        for (int k = 0; k < 3; ++k) {
            const double sum = modes.eigenvalues()[k];
            n[k] = sum > Corotated::min_turned_stretch ? (p[l] - 2 * mu[l]) / sum : -mu[l];
            if (tangent == Tangent::positive) n[k] = std::max(n[k], -mu[l]);
        }
        of_lane = modes.eigenvectors() * n.asDiagonal() * modes.eigenvectors().transpose();
        N.x.x[l] = of_lane(0, 0), N.y.y[l] = of_lane(1, 1), N.z.z[l] = of_lane(2, 2);
        N.x.y[l] = N.y.x[l] = of_lane(0, 1);
        N.y.z[l] = N.z.y[l] = of_lane(1, 2);
        N.x.z[l] = N.z.x[l] = of_lane(0, 2);
    }
    return N;
}

}  // namespace

void assemble_exact_tangent(const TetBatches<double>& batches, BatchRange range,
                            std::span<const RotationBatch<double>> rotations,
                            std::span<const double> u, Tangent tangent, double scale,
                            const BlockPattern& pattern, std::span<double> values, int part) {
    using Lane = Lanes<double>;
    constexpr int width = batch_width<double>;
    for (std::size_t k = range.begin; k < range.end; ++k) {
        const TetBatch<double>& b = batches[k];
        const Mat3<double> g = load_matrix<double>(b.gradients),
                           R = load_rotation(rotation_of_batch(rotations, k));
        const Mat3<double> F = plus_identity(gradient_of(b, u.data()));
        const Lane lambda = scale * load<double>(b.lambda), mu = scale * load<double>(b.mu);
        const Mat3<double> N = turn_stiffness(R, F, mu, lambda * (dot(R, F) - 3), tangent);
        Vec3<double> h[4] = {{}, R * g.x, R * g.y, R * g.z};
        h[0] = -(h[1] + h[2] + h[3]);
        alignas(32) double blocks[4][4][9][width];
        for (int j = 0; j < 4; ++j) {
            const Vec3<double>&w = h[j], wx = w.z * N.y - w.y * N.z, wy = w.x * N.z - w.z * N.x,
                  wz = w.y * N.x - w.x * N.y;
            for (int i = 0; i <= j; ++i) {
                const Lane d = 2 * mu * dot(h[i], w);
                Vec3<double> x = cross(wx, h[i]) + (lambda * w.x) * h[i],
                             y = cross(wy, h[i]) + (lambda * w.y) * h[i],
                             z = cross(wz, h[i]) + (lambda * w.z) * h[i];
                x.x += d, y.y += d, z.z += d;
                store3<double>(x, blocks[i][j]);
                store3<double>(y, blocks[i][j] + 3);
                store3<double>(z, blocks[i][j] + 6);
            }
        }
        for (int l = 0; l < width; ++l) {
            const std::int32_t e = batches.tet_at(k, l);
            if (e < 0) continue;
            const std::array<std::int32_t, 4> node = nodes_of_lane(b, l);
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j) {
                    if (node[i] >= pattern.owned() || pattern.part_of(node[j]) != part) continue;
                    double* value = values.data() + 9 * static_cast<std::size_t>(pattern.place(
                                                            e, i, j, node[i], node[j]));
                    const auto& block = blocks[std::min(i, j)][std::max(i, j)];
                    for (int m = 0; m < 9; ++m)
                        value[m] += block[i <= j ? m : m % 3 * 3 + m / 3][l];
                }
        }
    }
}

template <int nodes>
[[gnu::flatten]] void add_tangent_times(double factor, const TetBatches<double, nodes>& batches,
                                        BatchRange range,
                                        std::span<const RotationBatch<double>> rotations,
                                        std::span<const double> u, Tangent tangent,
                                        std::span<const double> v, std::span<double> f) {
    constexpr int points = TetBatches<double, nodes>::points;
    using Lane = Lanes<double>;
    const Lane share = all_lanes(factor / points), zero = all_lanes(0.0);
    for (std::size_t k = range.begin; k < range.end; ++k) {
        const TetBatch<double, nodes>& b = batches[k];
        const Lane lambda = share * load<double>(b.lambda), mu = share * load<double>(b.mu);
        const PointGradients<double, nodes> H(b, u.data()), of_v(b, v.data());
        PointForces<double, nodes> forces(b);
        for (int q = 0; q < points; ++q) {
            const Mat3<double> R = load_rotation(rotation_of_batch(rotations, points * k + q));
            const Mat3<double> dF = of_v.at(q);
            const Mat3<double> F = plus_identity(H.at(q));
            const Mat3<double> N = turn_stiffness(R, F, mu, lambda * (dot(R, F) - 3), tangent);
            const Mat3<double> A = dF * transposed(R);
            const Vec3<double> y = N * Vec3<double>{A.y.z - A.z.y, A.z.x - A.x.z, A.x.y - A.y.x};
            const Mat3<double> turn{{zero, y.z, -y.y}, {-y.z, zero, y.x}, {y.y, -y.x, zero}};
            forces.add(q, 2 * mu * dF + (lambda * dot(R, dF)) * R + turn * R);
        }
        forces.scatter(f.data());
    }
}

void rotate_gradients(const TetBatches<float>& batches, BatchRange range,
                      std::span<const RotationBatch<float>> rotations, std::span<RotatedTet> tets) {
    constexpr int width = batch_width<float>;
    for (std::size_t k = range.begin; k < range.end; ++k) {
        const TetBatch<float>& b = batches[k];
        const Mat3<float> g = load_matrix<float>(b.gradients),
                          R = load_rotation(rotation_of_batch(rotations, k));
        const Lanes<float> lambda = load<float>(b.lambda), mu = load<float>(b.mu);
        Vec3<float> h[4] = {{}, R * g.x, R * g.y, R * g.z};
        h[0] = -(h[1] + h[2] + h[3]);
        alignas(32) float corners[4][width][4];
        for (int i = 0; i < 4; ++i) transpose(h[i], i == 0 ? lambda : mu, corners[i]);
        for (int l = 0; l < width; ++l)
            for (int i = 0; i < 4; ++i)
                std::memcpy(tets[k * width + l].corner[i], corners[i][place<float>(l)],
                            4 * sizeof(float));
    }
}

#define LIVETET_INSTANTIATE(Real)                                                                  \
    template class TetBatches<Real>;                                                               \
    template void update_rotations(const TetBatches<Real, 4>&, BatchRange, std::span<const Real>,  \
                                   std::span<RotationBatch<Real>>);                                \
    template void add_forces(const TetBatches<Real, 4>&, BatchRange,                               \
                             std::span<const RotationBatch<Real>>, std::span<const Real>,          \
                             std::span<Real>);                                                     \
    template void add_stiffness_times(Real, const TetBatches<Real, 4>&, BatchRange,                \
                                      std::span<const RotationBatch<Real>>, std::span<const Real>, \
                                      std::span<Real>);                                            \
    template void assemble(const TetBatches<Real>&, BatchRange,                                    \
                           std::span<const RotationBatch<Real>>, Real, const BlockPattern&,        \
                           std::span<Real>, int);
LIVETET_INSTANTIATE(float)
LIVETET_INSTANTIATE(double)
#undef LIVETET_INSTANTIATE

template class TetBatches<double, 10>;
template void update_rotations(const TetBatches<double, 10>&, BatchRange, std::span<const double>,
                               std::span<RotationBatch<double>>);
template void add_forces(const TetBatches<double, 10>&, BatchRange,
                         std::span<const RotationBatch<double>>, std::span<const double>,
                         std::span<double>);
template void add_stiffness_times(double, const TetBatches<double, 10>&, BatchRange,
                                  std::span<const RotationBatch<double>>, std::span<const double>,
                                  std::span<double>);
template void add_tangent_times(double, const TetBatches<double, 4>&, BatchRange,
                                std::span<const RotationBatch<double>>, std::span<const double>,
                                Tangent, std::span<const double>, std::span<double>);
template void add_tangent_times(double, const TetBatches<double, 10>&, BatchRange,
                                std::span<const RotationBatch<double>>, std::span<const double>,
                                Tangent, std::span<const double>, std::span<double>);
template class TetBatches<float, 10>;
template void update_rotations(const TetBatches<float, 10>&, BatchRange, std::span<const float>,
                               std::span<RotationBatch<float>>);
template class TetBatches<float, 8>;
template void update_rotations(const TetBatches<float, 8>&, BatchRange, std::span<const float>,
                               std::span<RotationBatch<float>>);

}  // namespace livetet
