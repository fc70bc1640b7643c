#pragma once

#include <memory>

#include "solvers/assembly/matrix_free_coupling.hpp"

namespace livetet {

/// The rows and columns that pressures add to a level's operator,
///     [ K   B^T ]
///     [ B  -C   ],   B = d/du of integral N_i theta,   C = integral N_i N_j / lambda
/// (with P1, C + stabilisation),
/// and the residual of the constraint theta = p / lambda. P2 with P1 pressures is stable by itself
/// (Taylor and Hood 1973); P1 with P1 pressures takes the polynomial pressure projection of
/// Dohrmann and Bochev (2004): C += 1/(2 mu) integral (N_i - mean N_i) (N_j - mean N_j), which is
/// local and keeps the order. A grid's hexahedra have one pressure each (Q1-P0), quadratic ones
/// four (Q2-P1, stable by itself), without that. B and C are kept times powers of `scale`, so that
/// all rows are forces: the unknown of the matrices is p / scale. On a level in single precision, B
/// is applied by a MatrixFreeCoupling.
class PressureCoupling {
  public:
    explicit PressureCoupling(const LevelAssembler& level);

    /// Null on a level in single precision.
    Mat b() const { return b_.get(); }
    /// Null on a level with a matrix.
    MatrixFreeCoupling* matrix_free() const { return free_.get(); }
    Mat minus_c() const { return minus_c_.get(); }
    /// The pressure that a unit of the scaled unknown stands for, Pa/m.
    double scale() const { return scale_; }

    /// Renews B at `at`; columns of constrained components are zero.
    void assemble(const Configuration& at);

    /// g = scale (integral N_i theta(u) - C p), at owned pressures, in N; at.p in Pa.
    void residual(const Configuration& at, Vec g);

    /// f = the elastic force of `at`, N, of constrained components too, and g = residual(at); on a
    /// level in single precision in one pass over the tets.
    void evaluate(const Configuration& at, Vec f, Vec g);

    /// Hexahedra, whose C is diagonal: p = g / (scale C), Pa. Of residual() at p = 0 these are
    /// lambda times each cell's mean of theta.
    void pressures_of(Vec g, Vec p) const;

    /// g += scale integral N_i d theta(u) : grad v, constrained components too.
    void add_residual_increment(const Configuration& at, Vec v, Vec g);
    /// f = factor K v, with what add_residual_increment adds to g, of a v that is zero but at
    /// constrained components; its ghosts are up to date.
    void add_increments(const Configuration& at, double factor, Vec v, Vec f, Vec g);

    /// -S, an approximation of the Schur complement C + B K^-1 B^T, which a tet adds to by
    ///     S_e = M_e / lambda + f_e M_e / (2 mu),    M_e = integral N_i N_j;
    /// with P1, (1 - f_e) times the stabilisation is added. f_e is the free share of the tet's
    /// displacement components: B has no columns for constrained ones, so that a tet whose nodes
    /// are all held adds C alone. Renewed by set_constrained(); the diagonally scaled matrix has
    /// its eigenvalues in [1/2, 5/2] (Wathen 1987).
    Mat minus_schur() const { return minus_schur_.get(); }
    /// The level's constrained components are new.
    void set_constrained();

  private:
    /// A matrix between pressures of the sum of value(e, element, its pressure_mass) over all
    /// elements, a 4 x 4 matrix; a grid's hexahedra sum up its entries.
    template <class Value>
    void fill(PetscHandle<Mat>& matrix, Value&& value) const;
    double free_share(std::size_t e) const;
    void make_b();
    /// g = - scale C p, p in Pa.
    void multiply_c(Vec p, Vec g);

    const LevelAssembler& level_;
    double scale_ = 1;
    PetscHandle<Mat> b_, minus_c_, minus_schur_;
    std::vector<PetscScalar> values_;  ///< of B; or volumes, on a level in single precision
    std::unique_ptr<MatrixFreeCoupling> free_;
};

}  // namespace livetet
