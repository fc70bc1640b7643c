#pragma once

#include "solvers/assembly/level_assembler.hpp"

namespace livetet {

/// The rows and columns that pressures add to a level's operator,
///     [ K   B^T ]
///     [ B  -C   ],   B = d/du of integral N_i theta,   C = integral N_i N_j / lambda
/// (with P1, C + stabilisation),
/// and the residual of the constraint theta = p / lambda. P2 with P1 pressures is stable by itself
/// (Taylor and Hood 1973); P1 with P1 pressures takes the polynomial pressure projection of
/// Dohrmann and Bochev (2004): C += 1/(2 mu) integral (N_i - mean N_i) (N_j - mean N_j), which is
/// local and keeps the order. Both are kept in `scale` times their units, so that all rows are
/// forces: the unknown of the matrices is p / scale.
class PressureCoupling {
  public:
    explicit PressureCoupling(const LevelAssembler& level);

    Mat b() const { return b_.get(); }
    Mat minus_c() const { return minus_c_.get(); }
    /// The pressure that a unit of the scaled unknown stands for, Pa/m.
    double scale() const { return scale_; }

    /// Renews B at `at`; columns of constrained components are zero.
    void assemble(const Configuration& at);

    /// g = scale (integral N_i theta(u) - C p), at owned pressures, in N; at.p in Pa.
    void residual(const Configuration& at, Vec g);

    /// g += scale integral N_i d theta(u) : grad v, constrained components too.
    void add_residual_increment(const Configuration& at, Vec v, Vec g);

    /// -S, diagonal, for an approximate Schur complement S = C + B K^-1 B^T: lumped mass / lambda +
    /// lumped mass / (2 mu).
    PetscHandle<Mat> minus_schur() const;

  private:
    void make_c();

    const LevelAssembler& level_;
    double scale_ = 1;
    PetscHandle<Mat> b_, minus_c_;
    PetscHandle<Vec> schur_;  ///< the diagonal of S
    std::vector<PetscScalar> values_;
};

}  // namespace livetet
