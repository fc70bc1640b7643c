#include "solvers/assembly/matrix_free_coupling.hpp"

#include <algorithm>

namespace livetet {

MatrixFreeCoupling::MatrixFreeCoupling(const LevelAssembler& level, double scale)
    : level_(level),
      scale_(scale),
      v_(3 * level.share().nodes.size() + 1, 0.0F),
      f_(v_),
      p_(level.single()->pressures.size(), 0.0F),
      q_(p_),
      g_(p_) {}

void MatrixFreeCoupling::take(const Configuration& at) {
    at_ = at.rotations;
    level_.take_pressures(at.p, p_);
}

void MatrixFreeCoupling::clear() {
    level_.over_components([&](std::size_t i) { f_[i] = 0; });
    std::fill(g_.begin(), g_.end(), 0.0F);
}

void MatrixFreeCoupling::take_scaled(std::span<const double> q) {
    const auto places = std::span(level_.single()->pressure_places);
    for (std::size_t i = 0; i < places.size(); ++i)
        q_[places[i]] = q.empty() ? 0 : static_cast<float>(scale_ * q[i]);
}

void MatrixFreeCoupling::write_results(std::span<double> f, std::span<double> g) const {
    const auto places = std::span(level_.single()->pressure_places);
    level_.over_components([&](std::size_t i) { f[i] = f_[i]; });
    for (std::size_t i = 0; i < places.size(); ++i) g[i] = scale_ * g_[places[i]];
}

void MatrixFreeCoupling::multiply(double factor, std::span<const double> v,
                                  std::span<const double> q, std::span<double> f,
                                  std::span<double> g, Support of_v) {
    level_.over_components([&](std::size_t i) { v_[i] = static_cast<float>(v[i]); });
    take_scaled(q);
    clear();
    level_.add_mixed_products(static_cast<float>(factor), *at_, p_, {v_, q_}, {f_, g_}, of_v);
    write_results(f, g);
}

void MatrixFreeCoupling::multiply_transposed(std::span<const double> q, std::span<double> f) {
    take_scaled(q);
    clear();
    level_.add_pressure_forces(*at_, q_, f_);
    const auto constrained = level_.constrained();
    level_.over_components(
        [&](std::size_t i) { f[i] = constrained[i / 3] >> (i % 3) & 1 ? 0 : f_[i]; });
}

void MatrixFreeCoupling::evaluate(std::span<double> f, std::span<double> g) {
    clear();
    level_.add_mixed_forces(*at_, p_, {f_, g_});
    write_results(f, g);
}

}  // namespace livetet
