#include "solvers/linear/single_precision_multigrid.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "base/sliced_task.hpp"
#include "mechanics/scaled_stiffness.hpp"
#include "solvers/linear/chebyshev_steps.hpp"
#include "solvers/linear/lanczos_bound.hpp"
#include "solvers/linear/node_transfer.hpp"

namespace livetet {

namespace {

/// Minimum number of nodes for which a further thread is woken.
constexpr std::size_t grain = 150;

}  // namespace

/// A level works on A / s = K + (m M + springs) / s with the nodes' values scaled as
/// ScaledStiffness scales them: its unknowns are S x, its right-hand sides S^-1 b / s.
struct SinglePrecisionMultigrid::Level {
    LevelAssembler& level;
    const TetBatches<float>& batches;
    ThreadTeam& team;
    ScaledStiffness A;
    std::vector<float>
        inverse;  ///< of the diagonal blocks, column-major; zero in constrained rows and columns
    std::vector<float> b, x, next, r, d;
    std::vector<float> scale,
        inverse_scale;           ///< S and 1 / S of each component, 0 where it is constrained
    ElementRotations rotations;  ///< of a coarse level; the finest one's are given
    std::unique_ptr<TransposedMap> restriction;  ///< to the next finer level's nodes
    std::vector<float> diagonal_shift;  ///< of each node: inertia and springs in the diagonal
    double bound = 2;                   ///< largest eigenvalue of D^-1 A

    Level(LevelAssembler& l, ThreadTeam& t)
        : level(l),
          batches(l.single()->four_nodes()),
          team(t),
          A(l.elements(), l.share().tets, l.parts(), l.share().nodes.size()) {
        for (std::vector<float>* v : {&b, &x, &next, &r, &d, &scale, &inverse_scale})
            v->assign(3 * nodes() + 1, 0.0F);
        inverse.assign(9 * nodes() + 4, 0.0F);
        diagonal_shift.assign(nodes(), 0.0F);
    }

    std::size_t nodes() const { return A.nodes(); }

    /// work(begin, end) on pieces of the rows.
    template <class Work>
    void over_rows(Work&& work) const {
        team.run_pieces(nodes(), grain, work);
    }

    void set_constrained() { hold(level.constrained()); }
    void hold_nothing() { hold(std::vector<std::uint8_t>(nodes(), 0)); }

    void hold(std::span<const std::uint8_t> components) {
        for (std::size_t i = 0; i < nodes(); ++i)
            for (int c = 0; c < 3; ++c) {
                const bool held = components[i] >> c & 1;
                scale[3 * i + c] = held ? 0 : A.scale()[i];
                inverse_scale[3 * i + c] = held ? 0 : 1 / A.scale()[i];
            }
    }

    /// A of all components at the given rotations. Constrained components are zero in the vectors,
    /// not in A.
    void assemble(std::span<const RotationBatch<float>> rotations, double m_over_s, double s,
                  Renewal renewal) {
        const BatchRange later = level.parts().later();
        team.run_pieces(later.end - later.begin, 30, [&](std::size_t begin, std::size_t end) {
            A.rotate_later({later.begin + begin, later.begin + end}, batches, rotations);
        });
        team.run_tasks(level.parts().rounds.front().size(), [&](std::size_t part) {
            A.write_part(static_cast<int>(part), renewal, batches, rotations);
        });
        const auto renewed = A.rows_of(renewal);
        team.run_pieces(renewed.size(), grain, [&](std::size_t begin, std::size_t end) {
            const auto rows = renewed.subspan(begin, end - begin);
            A.write_rows(rows);
            for (const std::int32_t i : rows) {
                diagonal_shift[i] = 0;
                shift_diagonal(i, m_over_s, s, true);
            }
        });
        if (renewed.size() == nodes()) return;
        over_rows([&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) shift_diagonal(i, m_over_s, s, false);
        });
    }

    /// Sets `diagonal_shift` to what inertia and springs add to the diagonal; `renewed`: the rest
    /// of the block is new too.
    void shift_diagonal(std::size_t i, double m_over_s, double s, bool renewed) {
        const auto mass = level.node_mass(), springs = level.springs();
        const auto now = static_cast<float>(
            ((m_over_s != 0 ? m_over_s * mass[i] : 0) + (springs.empty() ? 0 : springs[i] / s)) /
            (A.scale()[i] * A.scale()[i]));
        const float change = now - diagonal_shift[i];
        if (!renewed && std::abs(change) <= 1e-6F * diagonal_shift[i]) return;
        const auto block = A.diagonal(i);
        for (int c = 0; c < 3; ++c) block[4 * c] += change;
        diagonal_shift[i] = now;
        invert(block.data(), inverse_scale.data() + 3 * i, inverse.data() + 9 * i);
    }

    /// The inverse of the unconstrained part of a symmetric block (where `free` is not zero); zero
    /// in the other rows and columns.
    static void invert(const float* block, const float* free, float* to) {
        Eigen::Map<Eigen::Matrix3f> result(to);
        const Eigen::Map<const Eigen::Matrix3f> D(block);
        if (free[0] != 0 && free[1] != 0 && free[2] != 0) {
            result = D.inverse();
            return;
        }
        const Eigen::Vector3f keep(free[0] != 0, free[1] != 0, free[2] != 0);
        Eigen::Matrix3f kept = keep.asDiagonal() * D * keep.asDiagonal();
        kept.diagonal() +=
            std::max(D.diagonal().maxCoeff(), 1e-30F) * (Eigen::Vector3f::Ones() - keep);
        result = keep.asDiagonal() * kept.inverse() * keep.asDiagonal();
    }

    FourFloats jacobi(std::size_t i, FourFloats v) const {
        const float* p = inverse.data() + 9 * i;
        return load_node(p) * v[0] + load_node(p + 3) * v[1] + load_node(p + 6) * v[2];
    }

    /// ChebyshevSteps for A x = b; `from_zero`: x is 0.
    void smooth(int steps, bool from_zero) {
        ChebyshevSteps chebyshev(bound);
        for (int step = 0; step < steps; ++step) {
            const ChebyshevSteps::Factors f = chebyshev.next();
            if (step == 0 && from_zero)
                over_rows([&](std::size_t begin, std::size_t end) {
                    for (std::size_t i = begin; i < end; ++i) {
                        const FourFloats z = f.of_r * jacobi(i, load_node(b.data() + 3 * i));
                        store_node(z, d.data() + 3 * i);
                        store_node(z, next.data() + 3 * i);
                    }
                });
            else
                over_rows([&](std::size_t begin, std::size_t end) {
                    A.multiply(begin, end, x.data(), [&](std::size_t i, FourFloats Ax) {
                        const FourFloats z = f.of_d * load_node(d.data() + 3 * i) +
                                             f.of_r * jacobi(i, load_node(b.data() + 3 * i) - Ax);
                        store_node(z, d.data() + 3 * i);
                        store_node(load_node(x.data() + 3 * i) + z, next.data() + 3 * i);
                    });
                });
            std::swap(x, next);
        }
    }

    /// For lanczos_bound: p is d, and z and q are next.
    struct Gradients {
        Level& l;

        double dot(const std::vector<float>& x, const std::vector<float>& y) const {
            double sum = 0;
            for (std::size_t i = 0; i < 3 * l.nodes(); ++i) sum += double{x[i]} * y[i];
            return sum;
        }
        double residual() {
            l.over_rows([&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    store_node(l.jacobi(i, load_node(l.r.data() + 3 * i)), l.next.data() + 3 * i);
            });
            return dot(l.r, l.next);
        }
        void turn(double beta) {
            for (std::size_t i = 0; i < 3 * l.nodes(); ++i)
                l.d[i] = l.next[i] + static_cast<float>(beta) * l.d[i];
        }
        double curvature() {
            pause_point();
            l.over_rows([&](std::size_t begin, std::size_t end) {
                l.A.multiply(begin, end, l.d.data(), [&](std::size_t i, FourFloats Ax) {
                    store_node(Ax, l.next.data() + 3 * i);
                });
            });
            return dot(l.d, l.next);
        }
        void advance(double alpha) {
            for (std::size_t i = 0; i < 3 * l.nodes(); ++i)
                l.r[i] -= static_cast<float>(alpha) * l.next[i];
        }
    };
    Gradients gradients() { return {*this}; }

    /// r = S (b - A x), unscaled for the transfer; zero at constrained components.
    void residual() {
        over_rows([&](std::size_t begin, std::size_t end) {
            A.multiply(begin, end, x.data(), [&](std::size_t i, FourFloats Ax) {
                store_node((load_node(b.data() + 3 * i) - Ax) * load_node(scale.data() + 3 * i),
                           r.data() + 3 * i);
            });
        });
    }
};

SinglePrecisionMultigrid::SinglePrecisionMultigrid(std::vector<LevelAssembler*> levels,
                                                   std::vector<const BarycentricMap*> maps,
                                                   int smoothing_steps, ThreadTeam& team)
    : team_(team), maps_(std::move(maps)), smoothing_steps_(smoothing_steps) {
    for (LevelAssembler* level : levels) {
        levels_.push_back(std::make_unique<Level>(*level, team));
        pause_point();
    }
    for (std::size_t l = 0; l < maps_.size(); ++l) {
        levels_[l + 1]->rotations = levels_[l + 1]->level.make_rotations();
        levels_[l + 1]->restriction =
            std::make_unique<TransposedMap>(*maps_[l], levels_[l + 1]->nodes());
        pause_point();
    }
    dense_.resize(static_cast<Eigen::Index>(3 * levels_.back()->nodes()),
                  static_cast<Eigen::Index>(3 * levels_.back()->nodes()));
}

SinglePrecisionMultigrid::~SinglePrecisionMultigrid() = default;

void SinglePrecisionMultigrid::set_constrained() {
    for (auto& level : levels_) level->set_constrained();
    fresh_ = true;
}

void SinglePrecisionMultigrid::restrict_displacements(const ElementRotations& finest) {
    if (finest.single_u.empty() || !levels_.back()->level.rotates()) return;
    const float* fine = finest.single_u.data();
    for (std::size_t l = 0; l < maps_.size(); ++l) {
        Level& coarse = *levels_[l + 1];
        float* u = coarse.rotations.single_u.data();
        coarse.over_rows([&](std::size_t begin, std::size_t end) {
            for (std::size_t n = begin; n < end; ++n)
                store_node(coarse.restriction->mean(n, fine), u + 3 * n);
        });
        fine = u;
    }
}

RenewalExtent SinglePrecisionMultigrid::update(const ElementRotations& finest, double s, double m,
                                               RenewalExtent wanted) {
    restrict_displacements(finest);
    const bool is_new = fresh_ || std::abs(s - s_) > 0.05 * s_ || std::abs(m - m_) > 0.05 * m_;
    const RenewalExtent renewed = is_new ? RenewalExtent::whole : wanted;
    half_ = renewed == RenewalExtent::whole ? Renewal::whole
            : half_ == Renewal::first_half  ? Renewal::second_half
                                            : Renewal::first_half;
    for (auto& level : levels_) {
        if (level == levels_.back() && !is_new) break;
        const bool is_finest = level == levels_.front();
        if (!is_finest) level->level.update_single_rotations(level->rotations);
        const auto& rotations = is_finest ? finest.single : level->rotations.single;
        if (!bounds_known_ && level != levels_.back()) find_bound(*level, rotations);
        level->assemble(rotations, m / s, s, is_finest ? half_ : Renewal::whole);
    }
    bounds_known_ = true;
    s_now_ = s;
    if (is_new) {
        factor_coarsest();
        fresh_ = false;
        s_ = s;
        m_ = m;
    }
    return renewed;
}

/// The largest eigenvalue of D^-1 K. Chebyshev's interval ends a tenth above it. Mass, springs and
/// constraints only lower it (for constraints: Cauchy's interlacing theorem).
void SinglePrecisionMultigrid::find_bound(Level& level,
                                          std::span<const RotationBatch<float>> rotations) {
    level.hold_nothing();
    constexpr double of_stiffness_alone = std::numeric_limits<double>::infinity();
    level.assemble(rotations, 0, of_stiffness_alone, Renewal::whole);
    RoughValues rough;
    for (float& v : level.r) v = static_cast<float>(rough.next());
    std::ranges::fill(level.d, 0.0F);
    const double found = lanczos_bound(bound_steps, level.gradients());
    if (found > 0) level.bound = found;  // else it has no stiffness
    level.set_constrained();
}

void SinglePrecisionMultigrid::factor_coarsest() {
    Level& level = *levels_.back();
    dense_.setZero();
    const auto put = [&](std::size_t i, std::size_t j, const Eigen::Matrix3f& block) {
        for (int a = 0; a < 3; ++a)
            for (int c = 0; c < 3; ++c)
                if (level.inverse_scale[3 * i + a] != 0 && level.inverse_scale[3 * j + c] != 0)
                    dense_(static_cast<Eigen::Index>(3 * i + a),
                           static_cast<Eigen::Index>(3 * j + c)) = block(a, c);
    };
    for (std::size_t i = 0; i < level.nodes(); ++i) {
        put(i, i, Eigen::Map<const Eigen::Matrix3f>(level.A.diagonal(i).data()));
        level.A.visit_row(i, [&](std::int32_t j, const std::array<std::int16_t, 9>& block) {
            put(i, j,
                Eigen::Map<const Eigen::Matrix<std::int16_t, 3, 3>>(block.data()).cast<float>());
        });
    }
    const float largest = std::max(dense_.diagonal().maxCoeff(), 1e-30F);
    for (Eigen::Index i = 0; i < dense_.rows(); ++i)
        if (level.inverse_scale[i] == 0) dense_(i, i) = largest;
    [[maybe_unused]] const Eigen::LLT<Eigen::Ref<Eigen::MatrixXf>> in_place(dense_);
}

void SinglePrecisionMultigrid::descend(std::size_t l) {
    Level& level = *levels_[l];
    if (l + 1 == levels_.size()) {
        const auto n = static_cast<Eigen::Index>(3 * level.nodes());
        Eigen::Map<Eigen::VectorXf> x(level.x.data(), n);
        x = Eigen::Map<const Eigen::VectorXf>(level.b.data(), n);
        dense_.triangularView<Eigen::Lower>().solveInPlace(x);
        dense_.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
        return;
    }
    level.smooth(smoothing_steps_, true);
    level.residual();
    Level& coarse = *levels_[l + 1];
    coarse.over_rows([&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n)
            store_node(coarse.restriction->gather(n, level.r.data()) *
                           load_node(coarse.inverse_scale.data() + 3 * n),
                       coarse.b.data() + 3 * n);
    });
    descend(l + 1);
    const BarycentricMap& map = *maps_[l];
    level.over_rows([&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
            FourFloats sum{};
            for (int k = 0; k < 4; ++k) {
                const std::int32_t n = 3 * map.nodes[i][k];
                sum += static_cast<float>(map.weights[i][k]) * load_node(coarse.x.data() + n) *
                       load_node(coarse.inverse_scale.data() + n);
            }
            store_node(
                load_node(level.x.data() + 3 * i) + sum * load_node(level.scale.data() + 3 * i),
                level.x.data() + 3 * i);
        }
    });
    level.smooth(smoothing_steps_, false);
}

template <class Scalar>
void SinglePrecisionMultigrid::multiply_by(std::span<const Scalar> x, std::span<Scalar> y) {
    Level& fine = *levels_.front();
    const std::size_t size = 3 * fine.nodes();
    team_.run_pieces(size, 3 * grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            fine.d[i] = static_cast<float>(x[i]) * fine.scale[i];
    });
    fine.over_rows([&](std::size_t begin, std::size_t end) {
        fine.A.multiply(begin, end, fine.d.data(), [&](std::size_t i, FourFloats Ax) {
            for (int c = 0; c < 3; ++c)
                y[3 * i + c] = static_cast<Scalar>(s_now_ * fine.scale[3 * i + c] * Ax[c]);
        });
    });
}

template <class Scalar>
void SinglePrecisionMultigrid::apply(std::span<const Scalar> r, std::span<Scalar> z) {
    Level& fine = *levels_.front();
    const std::size_t size = 3 * fine.nodes();
    team_.run_pieces(size, 3 * grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            fine.b[i] = static_cast<float>(r[i] / s_now_) * fine.inverse_scale[i];
    });
    descend(0);
    team_.run_pieces(size, 3 * grain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) z[i] = fine.x[i] * fine.inverse_scale[i];
    });
}

template void SinglePrecisionMultigrid::multiply_by(std::span<const double>, std::span<double>);
template void SinglePrecisionMultigrid::multiply_by(std::span<const float>, std::span<float>);
template void SinglePrecisionMultigrid::apply(std::span<const double>, std::span<double>);
template void SinglePrecisionMultigrid::apply(std::span<const float>, std::span<float>);

double SinglePrecisionMultigrid::bytes_of_update() const {
    double bytes = 0;
    for (const auto& level : levels_) {
        if (level == levels_.back()) break;
        const auto batches = static_cast<double>(level->batches.all().end);
        const double rotations =
            level == levels_.front() ? 1 : 3;  // read; on coarse levels made here, too
        bytes += batches * ((rotations > 1 ? 2 : 1) * sizeof(TetBatch<float>) +
                            rotations * sizeof(RotationBatch<float>)) +
                 static_cast<double>(level->A.bytes_of_update()) +
                 (36.0 + 24) * static_cast<double>(level->nodes());
    }
    return bytes;
}

double SinglePrecisionMultigrid::bytes_of_multiply() const {
    const Level& fine = *levels_.front();
    return static_cast<double>(fine.A.bytes_of_product()) +
           4 * 12.0 * static_cast<double>(fine.nodes());
}

double SinglePrecisionMultigrid::bytes_of_cycle() const {
    double bytes = 0;
    for (const auto& level : levels_) {
        const auto nodes = static_cast<double>(level->nodes());
        if (level == levels_.back()) {
            bytes += 4 * 9 * nodes * nodes;
            break;
        }
        const double products = 2 * smoothing_steps_;  // before, but the first; the residual; after
        bytes += products * static_cast<double>(level->A.bytes_of_product()) +
                 nodes * (2 * smoothing_steps_ * (36 + 5 * 12) + 4 * 12 + 4 * (4 + 8) + 4 * 12);
    }
    return bytes + 2 * 12.0 * static_cast<double>(levels_.front()->nodes());
}

}  // namespace livetet
