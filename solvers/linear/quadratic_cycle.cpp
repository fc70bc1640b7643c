#include "solvers/linear/quadratic_cycle.hpp"

#include <cmath>

#include "solvers/linear/chebyshev_steps.hpp"

namespace livetet {

QuadraticCycle::QuadraticCycle(MatrixFreeOperator& fine, LevelAssembler& linear_level,
                               SinglePrecisionMultigrid& multigrid, const BarycentricMap& map,
                               int smoothing_steps, ThreadTeam& team)
    : fine_(fine),
      linear_level_(linear_level),
      multigrid_(multigrid),
      map_(map),
      restriction_(map, linear_level.share().nodes.size()),
      corner_of_(linear_level.share().nodes.size()),
      smoothing_steps_(smoothing_steps),
      team_(team),
      linear_rotations_(linear_level.make_rotations()),
      coarse_r_(3 * corner_of_.size(), 0.0),
      coarse_z_(coarse_r_) {
    for (std::size_t i = 0; i < map.size(); ++i)
        for (int k = 0; k < 4; ++k)
            if (map.weights[i][k] == 1) corner_of_[map.nodes[i][k]] = static_cast<std::int32_t>(i);
    for (std::vector<float>* v : {&b_, &x_, &d_, &r_}) v->assign(fine.components() + 1, 0.0F);
}

RenewalExtent QuadraticCycle::update(const ElementRotations& at, double s, double m,
                                     RenewalExtent wanted) {
    if (linear_level_.rotates() && !at.single_u.empty()) {
        float* u = linear_rotations_.single_u.data();
        team_.run_pieces(corner_of_.size(), 150, [&](std::size_t begin, std::size_t end) {
            for (std::size_t n = begin; n < end; ++n)
                store_node(load_node(at.single_u.data() + 3 * corner_of_[n]), u + 3 * n);
        });
        linear_level_.update_single_rotations(linear_rotations_);
    }
    const RenewalExtent renewed = multigrid_.update(linear_rotations_, s, m, wanted);
    if (bound_ == 0) find_bound();
    return renewed;
}

void QuadraticCycle::find_bound() {
    const auto free = fine_.free();
    std::uint32_t state = 12345;
    for (std::size_t i = 0; i < fine_.components(); ++i) {
        state = state * 1664525u + 1013904223u;
        x_[i] = free[i] * (static_cast<float>(state) / 4294967296.0F - 0.5F);
    }
    bound_ = 1;
    for (int k = 0; k < 20; ++k) {
        double before = 0, after = 0;
        for (const float v : x_) before += v * v;
        fine_.visit_stiffness(x_, [&](std::size_t i, float Kx) {
            d_[i] = free[i] * Kx / fine_.stiffness_diagonal(i);
        });
        for (const float v : d_) after += v * v;
        if (!(before > 0 && after > 0)) return;  // the level has no free component
        bound_ = std::sqrt(after / before);
        const auto scale = static_cast<float>(1 / std::sqrt(after));
        for (std::size_t i = 0; i < x_.size(); ++i) x_[i] = scale * d_[i];
    }
}

void QuadraticCycle::smooth(bool from_zero) {
    const auto free = fine_.free(), diagonal = fine_.diagonal();
    ChebyshevSteps chebyshev(bound_);
    for (int step = 0; step < smoothing_steps_; ++step) {
        const ChebyshevSteps::Factors f = chebyshev.next();
        if (step == 0 && from_zero) {
            fine_.over_components(
                [&](std::size_t i) { x_[i] = d_[i] = f.of_r * b_[i] / diagonal[i]; });
        } else {
            fine_.visit_positive(x_, [&](std::size_t i, float Ax) {
                d_[i] = f.of_d * d_[i] + f.of_r * free[i] * (b_[i] - Ax) / diagonal[i];
                x_[i] += d_[i];
            });
        }
    }
}

void QuadraticCycle::correct_by_linear_tets() {
    const auto free = fine_.free();
    fine_.visit_positive(x_, [&](std::size_t i, float Ax) { r_[i] = free[i] * (b_[i] - Ax); });
    team_.run_pieces(corner_of_.size(), 150, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            const FourFloats sum = restriction_.gather(n, r_.data());
            for (int c = 0; c < 3; ++c) coarse_r_[3 * n + c] = sum[c];
        }
    });
    multigrid_.cycle(coarse_r_, coarse_z_);
    team_.run_pieces(map_.size(), 150, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            for (int c = 0; c < 3; ++c) {
                double sum = 0;
                for (int k = 0; k < 4; ++k)
                    sum += map_.weights[i][k] * coarse_z_[3 * map_.nodes[i][k] + c];
                x_[3 * i + c] += free[3 * i + c] * static_cast<float>(sum);
            }
    });
}

void QuadraticCycle::cycle(std::span<const double> r, std::span<double> z) {
    fine_.over_components([&](std::size_t i) { b_[i] = static_cast<float>(r[i]); });
    smooth(true);
    correct_by_linear_tets();
    smooth(false);
    fine_.over_components([&](std::size_t i) { z[i] = x_[i]; });
}

}  // namespace livetet
