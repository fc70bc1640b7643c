#pragma once

#include <Eigen/SparseCholesky>

#include <span>
#include <vector>

#include "mechanics/hex_stiffness.hpp"
#include "mesh/hex_grid.hpp"

namespace livetet {

/// What the cells of a grid's finest level are.
struct HexCells {
    TetElement frame{};          ///< of a full cell, see ElementShape<8>; its moduli are not used
    std::vector<double> shares;  ///< of each cell
    std::vector<std::pair<double, double>> moduli;  ///< lambda and mu of each material, Pa
    std::vector<std::int32_t> material;             ///< of each cell
    Dilation dilation = Dilation::of_points;
};

/// Nested multigrid for Hooke's law on a grid of hexahedra,
///
///     A = s sum_e w_e R_e K R_e^T + D,
///
/// with one reference stiffness K a material, the share w_e and the rotation R_e of each cell, and
/// a diagonal D of mass and springs. Rows and columns of constrained components are zero. Where the
/// cells' dilations b_e are given, K is that of shear alone, and V lambda b_e b_e^T is added to
/// R_e K R_e^T. The turned reference dilation would leave an error of order lambda times the
/// strain.
///
/// Coarse operators are Galerkin products, cell by cell: K_C = sum over the cells c of C of P_c^T
/// K_c P_c, with P_c the trilinear values of C's corner functions at c's corners, and constrained
/// components left out. Cells that are whole, of one material, unturned and unconstrained share one
/// matrix. A cycle smooths by Chebyshev steps on 3x3 block Jacobi; the coarsest level is factored.
/// The cycle is symmetric. To use it:
///
///     set_constrained(...);            // when it changes
///     update(s, diagonal, rotations);  // when the operator changes
///     cycle(r, z);                     // as often as wanted
class HexMultigrid {
  public:
    /// `levels`: finest first, see hex_levels. `smoothing_steps` before and after each correction;
    /// 2 times as many on coarse levels if a place of one holds several cells (a cut, or another
    /// gap): there a bridge of one coarse cell is too wide, and too stiff.
    HexMultigrid(std::vector<HexLevel> levels, HexCells cells, int smoothing_steps);

    /// Of each node: bit 0: x, 1: y, 2: z.
    void set_constrained(std::span<const std::uint8_t> components);
    /// `diagonal`: of each node, N/m; empty: zero. `rotations`: of each cell; empty: the identity.
    /// `dilations`: the b_e, beside rotations; or empty.
    void update(double s, std::span<const double> diagonal,
                std::span<const Eigen::Matrix3d> rotations,
                std::span<const CellDilation> dilations = {});
    /// y = A x, on three components a node.
    void multiply(std::span<const double> x, std::span<double> y) const;
    /// z = an approximation of A^-1 r; zero where constrained.
    void cycle(std::span<const double> r, std::span<double> z);

    /// Estimates the smoothers' bounds anew, with more steps, after a cycle was found not to be
    /// positive. Returns whether one has risen.
    bool take_surer_bounds();

    std::size_t level_count() const { return levels_.size(); }
    /// Of what the levels keep.
    double bytes() const;

  private:
    using Matrix24f = Eigen::Matrix<float, 24, 24>;
    using Vector = Eigen::VectorXd;

    struct Level {
        HexLevel grid;
        std::vector<std::int32_t> uniform;     ///< material of a cell that shares its matrix, or -1
        std::vector<std::int32_t> matrix;      ///< of each cell; coarse levels
        std::vector<Matrix24f> matrices;       ///< coarse levels
        Vector free;                           ///< of each component: 1, or 0 where none moves it
        std::vector<Eigen::Matrix3d> inverse;  ///< of each node's diagonal block
        double largest = 0;                    ///< eigenvalue of the preconditioned operator
        std::vector<std::int32_t> from;        ///< see places_in_coarser
        Vector x, r, d, w;
    };

    /// Element matrix of a cell with its part of D, without constrained rows and columns.
    Matrix24f element_matrix(std::size_t level, std::size_t cell) const;
    const Matrix24& reference_stiffness(std::size_t cell) const {
        return (dilations_.empty() ? stiffness_ : shear_stiffness_)[cells_.material[cell]];
    }
    void find_uniform_cells();
    void form_coarse_level(std::size_t level);
    void invert_diagonal(std::size_t level);
    void factor_coarsest();
    void apply(std::size_t level, const Vector& x, Vector& y) const;
    void apply_finest(const double* x, double* y) const;
    double largest_eigenvalue(std::size_t level, int steps);
    void precondition(const Level& level, const Vector& r, Vector& z) const;
    /// x += Chebyshev steps on the residual r; d is the last one, which r does not know yet.
    void smooth(std::size_t level);
    void cycle_from(std::size_t level);

    HexCells cells_;
    // Of each material's full cell: K, K at lambda = 0, and V lambda, J.
    std::vector<Matrix24> stiffness_, shear_stiffness_;
    std::vector<double> volumetric_stiffness_;
    int smoothing_steps_, coarse_smoothing_steps_;
    std::vector<Level> levels_;
    double s_ = 1;
    std::vector<double> diagonal_, cells_at_node_;
    std::vector<Eigen::Matrix3d> rotations_;
    std::vector<CellDilation> dilations_;
    bool bounds_known_ = false;
    Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> coarsest_;
};

}  // namespace livetet
