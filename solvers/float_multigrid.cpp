#include "solvers/float_multigrid.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>

namespace livetet {

namespace {

using Four = float __attribute__((vector_size(16)));

Four load(const float* p) {
    Four v;
    __builtin_memcpy(&v, p, sizeof v);
    return v;
}

/// Rows of 3x3 blocks, each of nine floats, column-major; room for one float more behind the last.
struct Blocks {
    std::vector<std::int32_t> start, columns, diagonal;
    std::vector<float> values;

    /// visit(row, A x in the first three lanes).
    template <class Visit>
    void multiply(const float* x, Visit&& visit) const {
        const float* a = values.data();
        for (std::size_t i = 0; i + 1 < start.size(); ++i) {
            Four even{}, odd{};
            std::int32_t k = start[i];
            for (; k + 1 < start[i + 1]; k += 2) {
                const float *p = a + 9 * static_cast<std::size_t>(k), *q = p + 9;
                const float *u = x + 3 * columns[k], *v = x + 3 * columns[k + 1];
                even += load(p) * u[0] + load(p + 3) * u[1] + load(p + 6) * u[2];
                odd += load(q) * v[0] + load(q + 3) * v[1] + load(q + 6) * v[2];
            }
            if (k < start[i + 1]) {
                const float* p = a + 9 * static_cast<std::size_t>(k);
                const float* u = x + 3 * columns[k];
                even += load(p) * u[0] + load(p + 3) * u[1] + load(p + 6) * u[2];
            }
            visit(i, even + odd);
        }
    }
};

void add3(float* to, Four v) {
    for (int c = 0; c < 3; ++c) to[c] += v[c];
}

}  // namespace

struct FloatMultigrid::Level {
    const ElasticLevel& level;
    TetBatches<float> batches;
    std::vector<RotationBatch<float>> rotations;
    std::vector<std::int32_t> slots;
    Blocks A;
    std::vector<float> inverse;  ///< of the diagonal blocks, as A's values
    std::vector<float> u, b, x, r, d;
    struct Masked {
        std::int32_t block;
        std::uint8_t row, column;
        bool diagonal;
    };
    std::vector<Masked> masked;
    std::vector<float> keep;  ///< 0 at constrained components, else 1
    std::vector<float> column_sum;  ///< of the transfer to this level: the weight that fine nodes lend
    double bound = 2;         ///< largest eigenvalue of D^-1 A
    Eigen::LLT<Eigen::MatrixXf> factor;

    explicit Level(const ElasticLevel& l)
        : level(l), batches(l.elements(), l.share().tets), rotations(batches.make_rotations()) {
        const std::size_t nodes = l.share().nodes.size();
        for (std::vector<float>* v : {&u, &b, &x, &r, &d, &keep}) v->assign(3 * nodes + 1, 0.0F);
        std::vector<std::vector<std::int32_t>> neighbours(nodes);
        for (const Tet& t : l.share().tets)
            for (const std::int32_t i : t) neighbours[i].insert(neighbours[i].end(), t.begin(), t.end());
        A.start.push_back(0);
        for (std::size_t i = 0; i < nodes; ++i) {
            auto& row = neighbours[i];
            std::sort(row.begin(), row.end());
            row.erase(std::unique(row.begin(), row.end()), row.end());
            A.diagonal.push_back(static_cast<std::int32_t>(
                A.columns.size() + (std::lower_bound(row.begin(), row.end(), static_cast<std::int32_t>(i)) - row.begin())));
            A.columns.insert(A.columns.end(), row.begin(), row.end());
            A.start.push_back(static_cast<std::int32_t>(A.columns.size()));
        }
        A.values.assign(9 * A.columns.size() + 4, 0.0F);
        inverse.assign(9 * nodes + 4, 0.0F);
        for (const Tet& t : l.share().tets)
            for (const std::int32_t i : t)
                for (const std::int32_t j : t)
                    slots.push_back(static_cast<std::int32_t>(
                        std::lower_bound(A.columns.begin() + A.start[i], A.columns.begin() + A.start[i + 1], j) -
                        A.columns.begin()));
    }

    std::size_t nodes() const { return A.diagonal.size(); }

    void set_constrained() {
        masked.clear();
        const auto components = level.constrained();
        for (std::size_t i = 0; i < nodes(); ++i) {
            for (int c = 0; c < 3; ++c) keep[3 * i + c] = components[i] >> c & 1 ? 0.0F : 1.0F;
            for (std::int32_t k = A.start[i]; k < A.start[i + 1]; ++k)
                if (const std::int32_t j = A.columns[k]; components[i] | components[j])
                    masked.push_back({k, components[i], components[j], static_cast<std::size_t>(j) == i});
        }
    }

    void assemble(double s, double m) {
        std::fill(A.values.begin(), A.values.end(), 0.0F);
        livetet::assemble<float>(batches, batches.all(), rotations, static_cast<float>(s), slots, A.values);
        const auto mass = level.node_mass(), springs = level.springs();
        double sum = 0;
        for (std::size_t i = 0; i < nodes(); ++i) {
            float* block = A.values.data() + 9 * static_cast<std::size_t>(A.diagonal[i]);
            const auto more = static_cast<float>(m * mass[i] + (springs.empty() ? 0 : springs[i]));
            for (int c = 0; c < 3; ++c) sum += block[4 * c] += more;
        }
        const auto identity = static_cast<float>(sum / (3.0 * static_cast<double>(nodes())));
        for (const Masked& k : masked)
            for (int b = 0; b < 3; ++b)
                for (int a = 0; a < 3; ++a)
                    if ((k.row >> a & 1) || (k.column >> b & 1))
                        A.values[9 * static_cast<std::size_t>(k.block) + 3 * b + a] = k.diagonal && a == b ? identity : 0;
        for (std::size_t i = 0; i < nodes(); ++i)
            Eigen::Map<Eigen::Matrix3f>(inverse.data() + 9 * i) =
                Eigen::Map<const Eigen::Matrix3f>(A.values.data() + 9 * static_cast<std::size_t>(A.diagonal[i])).inverse();
    }

    Four jacobi(std::size_t i, Four v) const {
        const float* p = inverse.data() + 9 * i;
        return load(p) * v[0] + load(p + 3) * v[1] + load(p + 6) * v[2];
    }

    /// Chebyshev steps for A x = b on [bound / 10, bound] of D^-1 A (Saad 2003, algorithm 12.1); `from_zero`: x is 0.
    void smooth(int steps, bool from_zero) {
        const auto high = static_cast<float>(1.1 * bound), low = 0.1F * high;
        const float theta = (high + low) / 2, delta = (high - low) / 2, sigma = theta / delta;
        float rho = 1 / sigma;
        for (int step = 0; step < steps; ++step) {
            const float next = step == 0 ? rho : 1 / (2 * sigma - rho);
            const float of_d = step == 0 ? 0 : next * rho, of_r = step == 0 ? 1 / theta : 2 * next / delta;
            const auto advance = [&](std::size_t i, Four Ax) {
                const Four z = jacobi(i, load(b.data() + 3 * i) - Ax);
                for (int c = 0; c < 3; ++c) d[3 * i + c] = of_d * d[3 * i + c] + of_r * z[c];
            };
            if (step == 0 && from_zero)
                for (std::size_t i = 0; i < nodes(); ++i) advance(i, Four{});
            else
                A.multiply(x.data(), advance);
            if (step == 0 && from_zero)
                std::copy(d.begin(), d.end(), x.begin());
            else
                for (std::size_t i = 0; i < x.size(); ++i) x[i] += d[i];
            rho = next;
        }
    }

    void residual() {
        A.multiply(x.data(), [&](std::size_t i, Four Ax) {
            for (int c = 0; c < 3; ++c) r[3 * i + c] = b[3 * i + c] - Ax[c];
        });
    }
};

FloatMultigrid::FloatMultigrid(std::vector<const ElasticLevel*> levels, std::vector<const BarycentricMap*> maps,
                               int smoothing_steps)
    : maps_(std::move(maps)), smoothing_steps_(smoothing_steps) {
    for (const ElasticLevel* level : levels) levels_.push_back(std::make_unique<Level>(*level));
    for (std::size_t l = 0; l < maps_.size(); ++l) {
        auto& sum = levels_[l + 1]->column_sum;
        sum.assign(levels_[l + 1]->nodes(), 0.0F);
        for (std::size_t i = 0; i < maps_[l]->size(); ++i)
            for (int k = 0; k < 4; ++k) sum[maps_[l]->nodes[i][k]] += static_cast<float>(maps_[l]->weights[i][k]);
    }
}

FloatMultigrid::~FloatMultigrid() = default;

void FloatMultigrid::set_constrained() {
    for (auto& level : levels_) level->set_constrained();
    fresh_ = true;
}

void FloatMultigrid::restrict_displacements() {
    for (std::size_t l = 0; l < maps_.size(); ++l) {
        const Level& fine = *levels_[l];
        Level& coarse = *levels_[l + 1];
        std::fill(coarse.u.begin(), coarse.u.end(), 0.0F);
        for (std::size_t i = 0; i < maps_[l]->size(); ++i)
            for (int k = 0; k < 4; ++k) {
                const auto w = static_cast<float>(maps_[l]->weights[i][k]);
                const std::int32_t n = maps_[l]->nodes[i][k];
                for (int c = 0; c < 3; ++c) coarse.u[3 * n + c] += w * fine.u[3 * i + c];
            }
        for (std::size_t n = 0; n < coarse.nodes(); ++n)
            for (int c = 0; c < 3; ++c) coarse.u[3 * n + c] /= std::max(coarse.column_sum[n], 1e-6F);
    }
}

void FloatMultigrid::update(std::span<const double> u, double s, double m) {
    std::copy(u.begin(), u.end(), levels_.front()->u.begin());
    restrict_displacements();
    for (auto& level : levels_) {
        if (level->level.strain() == StrainModel::corotated)
            update_rotations<float>(level->batches, level->batches.all(), level->u, level->rotations);
        if (fresh_) {  // mass only lowers the bound
            level->assemble(s, 0);
            find_bounds(*level);
        }
        if (level != levels_.back() || fresh_ || s != s_ || m != m_) level->assemble(s, m);
    }
    if (fresh_ || s != s_ || m != m_) factor_coarsest();
    fresh_ = false;
    s_ = s;
    m_ = m;
}

void FloatMultigrid::find_bounds(Level& level) {
    // Power iteration on D^-1 A from a rough vector; Chebyshev's interval ends a tenth above.
    std::uint32_t state = 12345;
    for (float& v : level.x)
        v = static_cast<float>(state = state * 1664525u + 1013904223u) / 4294967296.0F - 0.5F;
    for (int k = 0; k < 20; ++k) {
        double before = 0, after = 0;
        for (const float v : level.x) before += v * v;
        level.A.multiply(level.x.data(), [&](std::size_t i, Four Ax) {
            const Four z = level.jacobi(i, Ax);
            for (int c = 0; c < 3; ++c) level.d[3 * i + c] = z[c];
        });
        for (const float v : level.d) after += v * v;
        level.bound = std::sqrt(after / before);
        const auto scale = static_cast<float>(1 / std::sqrt(after));
        for (std::size_t i = 0; i < level.x.size(); ++i) level.x[i] = scale * level.d[i];
    }
}

void FloatMultigrid::factor_coarsest() {
    Level& level = *levels_.back();
    const auto n = static_cast<Eigen::Index>(3 * level.nodes());
    Eigen::MatrixXf dense = Eigen::MatrixXf::Zero(n, n);
    for (std::size_t i = 0; i < level.nodes(); ++i)
        for (std::int32_t k = level.A.start[i]; k < level.A.start[i + 1]; ++k)
            dense.block<3, 3>(static_cast<Eigen::Index>(3 * i), 3 * level.A.columns[k]) =
                Eigen::Map<const Eigen::Matrix3f>(level.A.values.data() + 9 * static_cast<std::size_t>(k));
    level.factor.compute(dense);
}

void FloatMultigrid::descend(std::size_t l) {
    Level& level = *levels_[l];
    if (l + 1 == levels_.size()) {
        Eigen::Map<Eigen::VectorXf> x(level.x.data(), static_cast<Eigen::Index>(3 * level.nodes()));
        x = Eigen::Map<const Eigen::VectorXf>(level.b.data(), x.size());
        level.factor.matrixL().solveInPlace(x);
        level.factor.matrixU().solveInPlace(x);
        return;
    }
    level.smooth(smoothing_steps_, true);
    level.residual();
    Level& coarse = *levels_[l + 1];
    const BarycentricMap& map = *maps_[l];
    std::fill(coarse.b.begin(), coarse.b.end(), 0.0F);
    for (std::size_t i = 0; i < map.size(); ++i)
        for (int k = 0; k < 4; ++k) {
            const auto w = static_cast<float>(map.weights[i][k]);
            const std::int32_t n = map.nodes[i][k];
            for (int c = 0; c < 3; ++c) coarse.b[3 * n + c] += w * level.keep[3 * i + c] * level.r[3 * i + c];
        }
    for (std::size_t i = 0; i < coarse.b.size(); ++i) coarse.b[i] *= coarse.keep[i];
    descend(l + 1);
    for (std::size_t i = 0; i < map.size(); ++i) {
        Four sum{};
        for (int k = 0; k < 4; ++k)
            sum += static_cast<float>(map.weights[i][k]) * load(coarse.x.data() + 3 * map.nodes[i][k]);
        add3(level.x.data() + 3 * i, sum * load(level.keep.data() + 3 * i));
    }
    level.smooth(smoothing_steps_, false);
}

void FloatMultigrid::multiply(std::span<const double> x, std::span<double> y) {
    Level& fine = *levels_.front();
    std::copy(x.begin(), x.end(), fine.d.begin());
    fine.A.multiply(fine.d.data(), [&](std::size_t i, Four Ax) {
        for (int c = 0; c < 3; ++c) y[3 * i + c] = Ax[c];
    });
}

void FloatMultigrid::cycle(std::span<const double> r, std::span<double> z) {
    Level& fine = *levels_.front();
    // Scaled to its own size: single precision has few exponents to lose.
    double size = 0;
    for (const double v : r) size = std::max(size, std::abs(v));
    if (!(size > 0) || !std::isfinite(size)) {
        std::fill(z.begin(), z.end(), 0.0);
        return;
    }
    for (std::size_t i = 0; i < r.size(); ++i) fine.b[i] = static_cast<float>(r[i] / size);
    descend(0);
    for (std::size_t i = 0; i < z.size(); ++i) z[i] = size * fine.x[i];
}

double FloatMultigrid::bytes_of_update() const {
    double bytes = 0;
    for (const auto& level : levels_)  // batches and rotations twice, slots, the blocks added to
        bytes += static_cast<double>(level->batches.tets()) * (2 * (60 + 36) + 64) + 72.0 * level->A.columns.size();
    return bytes;
}

double FloatMultigrid::bytes_of_iteration() const {
    double bytes = 0;
    const double products = 2 * smoothing_steps_;  // one is saved by the start from zero, one is the residual's
    for (const auto& level : levels_) {
        const double product = 40.0 * level->A.columns.size() + 60.0 * level->nodes();
        bytes += (products + (level == levels_.front() ? 1 : 0)) * product + 200.0 * level->nodes();
    }
    return bytes;
}

}  // namespace livetet
