#include "solvers/nonlinear/cell_pressures.hpp"

namespace livetet {

void CellPressures::begin() {
    const LevelAssembler& level = balance_.level();
    is_used_ = level.has_mean_dilation() && !level.is_linear();
    if (!is_used_) return;
    if (!p_)
        for (PetscHandle<Vec>* v : {&p_, &dp_, &trial_, &eliminated_})
            *v = level.make_cell_vector();
    level.find_cell_pressures(balance_.configuration(), nullptr, p_.get());
}

void CellPressures::step(Vec du) {
    balance_.level().find_cell_pressures(balance_.configuration(), du, p_.get());
}

CellPressures::Place CellPressures::aim(Vec du) {
    du_ = du;
    balance_.level().find_cell_pressures(balance_.configuration(), du, dp_.get());
    LIVETET_PETSC(VecAXPY(dp_.get(), -1, p_.get()));
    return at(0);
}

CellPressures::Place CellPressures::at(double length) {
    const LevelAssembler& level = balance_.level();
    LIVETET_PETSC(VecWAXPY(trial_.get(), length, dp_.get(), p_.get()));
    Place place;
    {
        const AtCellPressures at(balance_, trial_.get());
        place.norm = balance_.evaluate();
    }
    level.find_cell_pressures(balance_.configuration(), nullptr, eliminated_.get());
    LIVETET_PETSC(VecDot(balance_.residual(), du_, &place.slope));
    const ReadArray p(trial_.get()), wanted(eliminated_.get()), dp(dp_.get());
    for (std::size_t e = 0; e < p.span().size(); ++e) {
        const TetElement cell = level.element(e);
        place.slope += cell.volume / cell.lambda * (wanted[e] - p[e]) * dp[e];
    }
    return place;
}

void CellPressures::take(double length) { LIVETET_PETSC(VecAXPY(p_.get(), length, dp_.get())); }

}  // namespace livetet
