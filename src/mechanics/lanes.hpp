#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <utility>

#include "mechanics/batch_kernels.hpp"
#include "mesh/tet_mesh.hpp"

// Vectors wider than the machine's are passed between functions that are all inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

/// Arithmetic for the kernels over batches: a number, a vector or a matrix of each tet in the lanes
/// of a register. For the .cpp files of kernels and of material models only.
namespace livetet::lanes {

/// One number of each tet of a batch: a vector of the compiler, with + - * / < and ?: by lane.
template <class Real>
struct LanesOf {
    using type [[gnu::vector_size(32)]] = Real;
};
template <class Real>
using Lanes = typename LanesOf<Real>::type;

template <class Real>
Lanes<Real> load(const Real (&row)[batch_width<Real>]) {
    Lanes<Real> x;
    std::memcpy(&x, row, sizeof x);
    return x;
}

template <class Real>
void store(const Lanes<Real>& x, Real (&row)[batch_width<Real>]) {
    std::memcpy(row, &x, sizeof x);
}

template <class Real>
Lanes<Real> all_lanes(Real x) {
    return x - Lanes<Real>{};
}

template <class Real>
Lanes<Real> roots_of(const Lanes<Real>& a) {
    Lanes<Real> roots;
    for (int l = 0; l < batch_width<Real>; ++l) roots[l] = std::sqrt(a[l]);
    return roots;
}
inline Lanes<float> sqrt(const Lanes<float>& a) { return roots_of<float>(a); }
inline Lanes<double> sqrt(const Lanes<double>& a) { return roots_of<double>(a); }

template <class Real>
struct Vec3 {
    Lanes<Real> x, y, z;
};

/// work(std::integral_constant<int, k>) for k from 0 to count - 1, written out: arrays that are
/// indexed by k alone stay in registers, where a loop would keep them in memory.
template <int count, class Work>
constexpr void for_each_index(Work&& work) {
    [&]<int... k>(std::integer_sequence<int, k...>) {
        (work(std::integral_constant<int, k>()), ...);
    }
    (std::make_integer_sequence<int, count>());
}

// Of single precision, as the laws need them.
inline Lanes<float> abs(const Lanes<float>& a) { return a < 0 ? -a : a; }
inline Lanes<float> max(const Lanes<float>& a, const Lanes<float>& b) { return a > b ? a : b; }
inline Lanes<float> min(const Lanes<float>& a, const Lanes<float>& b) { return a < b ? a : b; }

template <class Real>
Vec3<Real> operator+(const Vec3<Real>& a, const Vec3<Real>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Real>
Vec3<Real> operator-(const Vec3<Real>& a, const Vec3<Real>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Real>
Vec3<Real> operator-(const Vec3<Real>& a) {
    return {-a.x, -a.y, -a.z};
}
template <class Real>
Vec3<Real> operator*(const Lanes<Real>& s, const Vec3<Real>& a) {
    return {s * a.x, s * a.y, s * a.z};
}
template <class Real>
Lanes<Real> dot(const Vec3<Real>& a, const Vec3<Real>& b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class Real>
Vec3<Real> cross(const Vec3<Real>& a, const Vec3<Real>& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A 3x3 matrix by its columns.
template <class Real>
struct Mat3 {
    Vec3<Real> x, y, z;
};
template <class Real>
Vec3<Real> operator*(const Mat3<Real>& m, const Vec3<Real>& a) {
    return a.x * m.x + a.y * m.y + a.z * m.z;
}
template <class Real>
Mat3<Real> operator-(const Mat3<Real>& a, const Mat3<Real>& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class Real>
Mat3<Real> operator+(const Mat3<Real>& a, const Mat3<Real>& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class Real>
Mat3<Real> operator*(const Lanes<Real>& s, const Mat3<Real>& a) {
    return {s * a.x, s * a.y, s * a.z};
}
template <class Real>
Mat3<Real> operator*(const Mat3<Real>& a, const Mat3<Real>& b) {
    return {a * b.x, a * b.y, a * b.z};
}
template <class Real>
Mat3<Real> transposed(const Mat3<Real>& m) {
    return {{m.x.x, m.y.x, m.z.x}, {m.x.y, m.y.y, m.z.y}, {m.x.z, m.y.z, m.z.z}};
}
template <class Real>
Lanes<Real> trace(const Mat3<Real>& m) {
    return m.x.x + m.y.y + m.z.z;
}
/// m + s I.
template <class Real>
Mat3<Real> plus_diagonal(const Mat3<Real>& m, const Lanes<Real>& s) {
    return {{m.x.x + s, m.x.y, m.x.z}, {m.y.x, m.y.y + s, m.y.z}, {m.z.x, m.z.y, m.z.z + s}};
}
template <class Real>
Lanes<Real> dot(const Mat3<Real>& a, const Mat3<Real>& b) {
    return dot(a.x, b.x) + dot(a.y, b.y) + dot(a.z, b.z);
}
template <class Real>
Mat3<Real> cofactor(const Mat3<Real>& m) {
    return {cross(m.y, m.z), cross(m.z, m.x), cross(m.x, m.y)};
}
/// The derivative of the cofactor of m in the direction d.
template <class Real>
Mat3<Real> cofactor_increment(const Mat3<Real>& m, const Mat3<Real>& d) {
    return {cross(m.y, d.z) + cross(d.y, m.z), cross(m.z, d.x) + cross(d.z, m.x),
            cross(m.x, d.y) + cross(d.x, m.y)};
}

/// Rows 3 i .. 3 i + 2 of a batch.
template <class Real>
Vec3<Real> load3(const Real (*rows)[batch_width<Real>]) {
    return {load<Real>(rows[0]), load<Real>(rows[1]), load<Real>(rows[2])};
}
template <class Real>
Mat3<Real> load_matrix(const Real (&rows)[9][batch_width<Real>]) {
    return {load3<Real>(rows), load3<Real>(rows + 3), load3<Real>(rows + 6)};
}
template <class Real>
void store3(const Vec3<Real>& a, Real (*rows)[batch_width<Real>]) {
    store<Real>(a.x, rows[0]);
    store<Real>(a.y, rows[1]);
    store<Real>(a.z, rows[2]);
}

/// R of the quaternion w, x, y, z.
template <class Real>
Mat3<Real> load_rotation(const RotationBatch<Real>& rotation) {
    const auto& q = rotation.quaternion;
    const Lanes<Real> w = load<Real>(q[0]), x = load<Real>(q[1]), y = load<Real>(q[2]),
                      z = load<Real>(q[3]), x2 = x + x, y2 = y + y, z2 = z + z;
    const Lanes<Real> wx = w * x2, wy = w * y2, wz = w * z2, xx = x * x2, xy = x * y2, zx = x * z2,
                      yy = y * y2, yz = y * z2, zz = z * z2;
    return {{1 - (yy + zz), xy + wz, zx - wy},
            {xy - wz, 1 - (xx + zz), yz + wx},
            {zx + wy, yz - wx, 1 - (xx + yy)}};
}

/// Keeps R. With q its quaternion, 4 q q^T has sums of R's numbers alone (Shepperd 1978); of its
/// columns, all multiples of q, the one with the largest number on the diagonal is normalised.
template <class Real>
void store_rotation(const Mat3<Real>& R, RotationBatch<Real>& rotation) {
    const Lanes<Real> wx = R.y.z - R.z.y, wy = R.z.x - R.x.z, wz = R.x.y - R.y.x,
                      xy = R.x.y + R.y.x, yz = R.y.z + R.z.y, zx = R.z.x + R.x.z;
    const Lanes<Real> columns[4][4] = {{1 + R.x.x + R.y.y + R.z.z, wx, wy, wz},
                                       {wx, 1 + R.x.x - R.y.y - R.z.z, xy, zx},
                                       {wy, xy, 1 - R.x.x + R.y.y - R.z.z, yz},
                                       {wz, zx, yz, 1 - R.x.x - R.y.y + R.z.z}};
    Lanes<Real> q[4], largest = columns[0][0], squares{};
    for (int i = 0; i < 4; ++i) q[i] = columns[0][i];
    for (int c = 1; c < 4; ++c) {
        const auto larger = columns[c][c] > largest;
        largest = larger ? columns[c][c] : largest;
        for (int i = 0; i < 4; ++i) q[i] = larger ? columns[c][i] : q[i];
    }
    for (const Lanes<Real>& number : q) squares += number * number;
    const Lanes<Real> scale = 1 / sqrt(squares);
    for (int i = 0; i < 4; ++i) store<Real>(scale * q[i], rotation.quaternion[i]);
}

template <class Real>
struct FourOf {
    using type [[gnu::vector_size(4 * sizeof(Real))]] = Real;
};
template <class Real>
using Four = typename FourOf<Real>::type;
template <class Real>
Four<Real> load_four(const Real* p) {
    Four<Real> x;
    std::memcpy(&x, p, sizeof x);
    return x;
}

/// Where lane l stands after `transpose`.
template <class Real>
constexpr int place(int l) {
    return batch_width<Real> == 4 ? l : l % 4 * 2 + l / 4;
}

/// rows[place(l)] = {a.x, a.y, a.z, w} of lane l.
template <class Real>
void transpose(const Vec3<Real>& a, const Lanes<Real>& w, Real (&rows)[batch_width<Real>][4]) {
    Lanes<Real> out[4];
    if constexpr (batch_width<Real> == 4) {
        const Lanes<Real> xy02 = __builtin_shufflevector(a.x, a.y, 0, 4, 2, 6),
                          xy13 = __builtin_shufflevector(a.x, a.y, 1, 5, 3, 7),
                          zw02 = __builtin_shufflevector(a.z, w, 0, 4, 2, 6),
                          zw13 = __builtin_shufflevector(a.z, w, 1, 5, 3, 7);
        out[0] = __builtin_shufflevector(xy02, zw02, 0, 1, 4, 5);
        out[1] = __builtin_shufflevector(xy13, zw13, 0, 1, 4, 5);
        out[2] = __builtin_shufflevector(xy02, zw02, 2, 3, 6, 7);
        out[3] = __builtin_shufflevector(xy13, zw13, 2, 3, 6, 7);
    } else {
        const Lanes<Real> xy01 = __builtin_shufflevector(a.x, a.y, 0, 8, 1, 9, 4, 12, 5, 13),
                          xy23 = __builtin_shufflevector(a.x, a.y, 2, 10, 3, 11, 6, 14, 7, 15),
                          zw01 = __builtin_shufflevector(a.z, w, 0, 8, 1, 9, 4, 12, 5, 13),
                          zw23 = __builtin_shufflevector(a.z, w, 2, 10, 3, 11, 6, 14, 7, 15);
        out[0] = __builtin_shufflevector(xy01, zw01, 0, 1, 8, 9, 4, 5, 12, 13);
        out[1] = __builtin_shufflevector(xy01, zw01, 2, 3, 10, 11, 6, 7, 14, 15);
        out[2] = __builtin_shufflevector(xy23, zw23, 0, 1, 8, 9, 4, 5, 12, 13);
        out[3] = __builtin_shufflevector(xy23, zw23, 2, 3, 10, 11, 6, 7, 14, 15);
    }
    std::memcpy(rows, out, sizeof rows);
}

template <class Real>
void store_matrix(const Mat3<Real>& m, Real (&rows)[9][batch_width<Real>]) {
    store3<Real>(m.x, rows);
    store3<Real>(m.y, rows + 3);
    store3<Real>(m.z, rows + 6);
}

/// The values of u at corner i of each tet. In float, one number behind u's last is read, too.
template <class Real>
Vec3<Real> gather(const Real* u, const std::int32_t (&offset)[batch_width<Real>]) {
    Vec3<Real> a;
    if constexpr (batch_width<Real> == 8) {  // four at once, then a transpose: half the time
        Lanes<Real> row[4];
        for (int l = 0; l < 4; ++l)
            row[l] = __builtin_shufflevector(load_four(u + offset[l]), load_four(u + offset[l + 4]),
                                             0, 1, 2, 3, 4, 5, 6, 7);
        const Lanes<Real> xy01 = __builtin_shufflevector(row[0], row[1], 0, 8, 1, 9, 4, 12, 5, 13),
                          xy23 = __builtin_shufflevector(row[2], row[3], 0, 8, 1, 9, 4, 12, 5, 13),
                          z01 = __builtin_shufflevector(row[0], row[1], 2, 10, 2, 10, 6, 14, 6, 14),
                          z23 = __builtin_shufflevector(row[2], row[3], 2, 10, 2, 10, 6, 14, 6, 14);
        a.x = __builtin_shufflevector(xy01, xy23, 0, 1, 8, 9, 4, 5, 12, 13);
        a.y = __builtin_shufflevector(xy01, xy23, 2, 3, 10, 11, 6, 7, 14, 15);
        a.z = __builtin_shufflevector(z01, z23, 0, 1, 8, 9, 4, 5, 12, 13);
    } else {  // x and y at once; no number behind z is read
        using Two [[gnu::vector_size(2 * sizeof(Real))]] = Real;
        Two xy[4];
        for (int l = 0; l < 4; ++l) std::memcpy(&xy[l], u + offset[l], sizeof xy[l]);
        const Lanes<Real> xy01 = __builtin_shufflevector(xy[0], xy[1], 0, 1, 2, 3),
                          xy23 = __builtin_shufflevector(xy[2], xy[3], 0, 1, 2, 3);
        a.x = __builtin_shufflevector(xy01, xy23, 0, 2, 4, 6);
        a.y = __builtin_shufflevector(xy01, xy23, 1, 3, 5, 7);
        for (int l = 0; l < 4; ++l) a.z[l] = u[offset[l] + 2];
    }
    return a;
}

/// f += a at corner i of each tet, one after the other: tets may share nodes.
template <class Real>
void scatter_add(const Vec3<Real>& a, const std::int32_t (&offset)[batch_width<Real>], Real* f) {
    using Two [[gnu::vector_size(2 * sizeof(Real))]] = Real;
    alignas(32) Real rows[batch_width<Real>][4];
    transpose(a, Lanes<Real>{}, rows);
    for (int l = 0; l < batch_width<Real>; ++l) {
        Real* p = f + offset[l];
        const Real* row = rows[place<Real>(l)];
        Two sum, more;
        std::memcpy(&sum, p, sizeof sum);
        std::memcpy(&more, row, sizeof more);
        sum += more;
        std::memcpy(p, &sum, sizeof sum);
        p[2] += row[2];
    }
}

/// grad u = sum_i (u_i - u_0) g_i^T, i = 1, 2, 3.
template <class Real>
Mat3<Real> gradient_of(const TetBatch<Real>& b, const Real* u) {
    const Vec3<Real> u0 = gather(u, b.offset[0]);
    const Mat3<Real> d{gather(u, b.offset[1]) - u0, gather(u, b.offset[2]) - u0,
                       gather(u, b.offset[3]) - u0};
    const Mat3<Real> g = load_matrix<Real>(b.gradients);
    return {d * Vec3<Real>{g.x.x, g.y.x, g.z.x}, d * Vec3<Real>{g.x.y, g.y.y, g.z.y},
            d * Vec3<Real>{g.x.z, g.y.z, g.z.z}};
}

template <class Real>
Mat3<Real> plus_identity(const Mat3<Real>& m) {
    return plus_diagonal(m, all_lanes<Real>(1));
}

/// R (2 mu eps + lambda tr(eps) I) with eps = sym(R^T A) - shift I.
template <class Real>
Mat3<Real> hooke_stress(const Lanes<Real>& lambda, const Lanes<Real>& mu, const Mat3<Real>& R,
                        const Mat3<Real>& A, Real shift) {
    const Lanes<Real> xx = dot(R.x, A.x) - shift, yy = dot(R.y, A.y) - shift,
                      zz = dot(R.z, A.z) - shift;
    const Lanes<Real> pressure = lambda * (xx + yy + zz);
    const Lanes<Real> xy = mu * (dot(R.x, A.y) + dot(R.y, A.x)),
                      yz = mu * (dot(R.y, A.z) + dot(R.z, A.y)),
                      zx = mu * (dot(R.z, A.x) + dot(R.x, A.z));
    return {R * Vec3<Real>{2 * mu * xx + pressure, xy, zx},
            R * Vec3<Real>{xy, 2 * mu * yy + pressure, yz},
            R * Vec3<Real>{zx, yz, 2 * mu * zz + pressure}};
}

/// f_i += P g_i.
template <class Real>
void scatter_forces(const TetBatch<Real>& b, const Mat3<Real>& P, Real* f) {
    const Mat3<Real> g = load_matrix<Real>(b.gradients);
    const Vec3<Real> f1 = P * g.x, f2 = P * g.y, f3 = P * g.z;
    scatter_add(-(f1 + f2 + f3), b.offset[0], f);
    scatter_add(f1, b.offset[1], f);
    scatter_add(f2, b.offset[2], f);
    scatter_add(f3, b.offset[3], f);
}

template <class Mask>
bool any(const Mask& mask) {
    std::uint64_t words[4], some = 0;
    std::memcpy(words, &mask, sizeof words);
    for (const std::uint64_t w : words) some |= w;
    return some;
}

/// work(axes), an std::integral_constant: CellAxes::aligned where batches are of such hexahedra.
template <class Real, int nodes, class Work>
void along_axes(const TetBatches<Real, nodes>& batches, Work&& work) {
    if constexpr (nodes == 8)
        if (batches.axes() == CellAxes::aligned)
            return work(std::integral_constant<CellAxes, CellAxes::aligned>());
    work(std::integral_constant<CellAxes, CellAxes::any>());
}

/// H = grad u at the quadrature points of the tets of a batch: made from u once, then asked for
/// point by point.
template <class Real, int nodes, CellAxes axes = CellAxes::any>
class PointGradients;

template <class Real>
class PointGradients<Real, 4> {
  public:
    PointGradients(const TetBatch<Real>& b, const Real* u) : H_(gradient_of(b, u)) {}
    Mat3<Real> at(int) const { return H_; }
    Mat3<Real> centre() const { return H_; }

  private:
    Mat3<Real> H_;
};

/// The sum of the forces V_q P_q grad N_i of the points of the tets of a batch; `P`: V_q P_q, N m.
template <class Real, int nodes, CellAxes axes = CellAxes::any>
class PointForces;

template <class Real>
class PointForces<Real, 4> {
  public:
    explicit PointForces(const TetBatch<Real>& b) : b_(b) {}
    void add(int, const Mat3<Real>& P) { P_ = P; }
    void scatter(Real* f) const { scatter_forces(b_, P_, f); }

  private:
    const TetBatch<Real>& b_;
    Mat3<Real> P_;
};

/// Ten nodes, L_q = near at point q and far elsewhere (TetShape<10>). A derivative by L_a,
///     d_a = (4 L_a - 1) u_a + 4 sum_b L_b u_ab,
/// is the same at all points but for what belongs to point q: corner q and the edges at it.
struct TenNodes {
    static constexpr double near = 0.58541019662496845446, far = 0.13819660112501051518;
    static constexpr double more = 4 * (near - far);
    /// The edge between two corners (tet_edges), or -1.
    static constexpr int edges[4][4] = {{-1, 0, 2, 3}, {0, -1, 1, 4}, {2, 1, -1, 5}, {3, 4, 5, -1}};
    static constexpr int edge(int a, int b) { return edges[a][b]; }
};

template <class Real>
class PointGradients<Real, 10> {
  public:
    PointGradients(const TetBatch<Real, 10>& b, const Real* u)
        : g_(load_matrix<Real>(b.gradients)) {
        for_each_index<10>([&](auto i) { u_[i] = gather(u, b.offset[i]); });
        for_each_index<4>([&](auto a) {
            shared_[a] = all_lanes(static_cast<Real>(4 * TenNodes::far - 1)) * u_[a] +
                         all_lanes(static_cast<Real>(4 * TenNodes::far)) * at_edges_of(a);
        });
    }
    Mat3<Real> at(int q) const {
        const Lanes<Real> more = all_lanes(static_cast<Real>(TenNodes::more));
        Vec3<Real> d[4];
        for_each_index<4>([&](auto a) {
            d[a] = shared_[a] + more * (a == q ? u_[a] : u_[4 + TenNodes::edge(a, q)]);
        });
        return gradient(d);
    }
    /// At L_a = 1/4.
    Mat3<Real> centre() const {
        Vec3<Real> d[4];
        for_each_index<4>([&](auto a) { d[a] = at_edges_of(a); });
        return gradient(d);
    }

  private:
    /// The sum of u at the middles of the edges that meet in corner a.
    template <class Index>
    Vec3<Real> at_edges_of(Index a) const {
        Vec3<Real> sum{};
        for_each_index<4>([&](auto c) {
            if constexpr (c != Index::value) sum = sum + u_[4 + TenNodes::edge(a, c)];
        });
        return sum;
    }
    /// sum_a d_a g_a^T, g_0 minus the sum of the others.
    Mat3<Real> gradient(const Vec3<Real> (&d)[4]) const {
        const Mat3<Real> D{d[1] - d[0], d[2] - d[0], d[3] - d[0]};
        return {D * Vec3<Real>{g_.x.x, g_.y.x, g_.z.x}, D * Vec3<Real>{g_.x.y, g_.y.y, g_.z.y},
                D * Vec3<Real>{g_.x.z, g_.y.z, g_.z.z}};
    }

    Mat3<Real> g_;
    Vec3<Real> u_[10], shared_[4];
};

template <class Real>
class PointForces<Real, 10> {
  public:
    explicit PointForces(const TetBatch<Real, 10>& b) : b_(b), g_(load_matrix<Real>(b.gradients)) {}
    void add(int q, const Mat3<Real>& P) {
        Vec3<Real> t[4] = {{}, P * g_.x, P * g_.y, P * g_.z};
        t[0] = -(t[1] + t[2] + t[3]);
        for_each_index<4>([&](auto a) {
            sum_[a] = sum_[a] + t[a];
            Vec3<Real>& own = own_[a == q ? a : 4 + TenNodes::edge(a, q)];
            own = own + t[a];
        });
    }
    void scatter(Real* f) const {
        const Lanes<Real> more = all_lanes(static_cast<Real>(TenNodes::more)),
                          edge = all_lanes(static_cast<Real>(4 * TenNodes::far)),
                          corner = all_lanes(static_cast<Real>(4 * TenNodes::far - 1));
        for_each_index<4>(
            [&](auto a) { scatter_add(corner * sum_[a] + more * own_[a], b_.offset[a], f); });
        for_each_index<6>([&](auto k) {
            scatter_add(edge * (sum_[tet_edges[k][0]] + sum_[tet_edges[k][1]]) + more * own_[4 + k],
                        b_.offset[4 + k], f);
        });
    }

  private:
    const TetBatch<Real, 10>& b_;
    Mat3<Real> g_;
    Vec3<Real> sum_[4]{}, own_[10]{};
};

}  // namespace livetet::lanes
