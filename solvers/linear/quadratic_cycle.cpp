#include "solvers/linear/quadratic_cycle.hpp"

namespace livetet {

QuadraticCycle::QuadraticCycle(MatrixFreeOperator& fine, LevelAssembler& linear_level,
                               std::unique_ptr<SinglePrecisionMultigrid> multigrid,
                               const BarycentricMap& map, int smoothing_steps, ThreadTeam& team)
    : fine_(fine),
      linear_level_(linear_level),
      multigrid_(std::move(multigrid)),
      map_(map),
      restriction_(map, linear_level.share().nodes.size()),
      corner_of_(linear_level.share().nodes.size()),
      smoothing_steps_(smoothing_steps),
      smoother_(fine, smoothing_steps),
      team_(team),
      linear_rotations_(linear_level.make_rotations()),
      coarse_r_(3 * corner_of_.size(), 0.0),
      coarse_z_(coarse_r_) {
    for (std::size_t i = 0; i < map.size(); ++i)
        for (int k = 0; k < 4; ++k)
            if (map.weights[i][k] == 1) corner_of_[map.nodes[i][k]] = static_cast<std::int32_t>(i);
    r_.assign(fine.components() + 1, 0.0F);
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
    const RenewalExtent renewed = multigrid_->update(linear_rotations_, s, m, wanted);
    smoother_.find_bound();
    return renewed;
}

void QuadraticCycle::correct_by_linear_tets() {
    const auto free = fine_.free();
    smoother_.residual(r_);
    team_.run_pieces(corner_of_.size(), 150, [&](std::size_t begin, std::size_t end) {
        for (std::size_t n = begin; n < end; ++n) {
            const FourFloats sum = restriction_.gather(n, r_.data());
            for (int c = 0; c < 3; ++c) coarse_r_[3 * n + c] = sum[c];
        }
    });
    multigrid_->cycle(coarse_r_, coarse_z_);
    std::vector<float>& x = smoother_.x();
    team_.run_pieces(map_.size(), 150, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i)
            for (int c = 0; c < 3; ++c) {
                double sum = 0;
                for (int k = 0; k < 4; ++k)
                    sum += map_.weights[i][k] * coarse_z_[3 * map_.nodes[i][k] + c];
                x[3 * i + c] += free[3 * i + c] * static_cast<float>(sum);
            }
    });
}

template <class Scalar>
void QuadraticCycle::apply(std::span<const Scalar> r, std::span<Scalar> z) {
    std::vector<float>&b = smoother_.b(), &x = smoother_.x();
    fine_.over_components([&](std::size_t i) { b[i] = static_cast<float>(r[i]); });
    smoother_.smooth(true);
    correct_by_linear_tets();
    smoother_.smooth(false);
    fine_.over_components([&](std::size_t i) { z[i] = x[i]; });
}

template void QuadraticCycle::apply(std::span<const double>, std::span<double>);
template void QuadraticCycle::apply(std::span<const float>, std::span<float>);

}  // namespace livetet
