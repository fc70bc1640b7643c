#pragma once

#include <Eigen/Core>

#include <memory>
#include <span>
#include <vector>

#include "mesh/hex_hierarchy.hpp"
#include "solvers/linear/matrix_free_smoother.hpp"
#include "solvers/linear/node_transfer.hpp"

namespace livetet {

/// A multigrid cycle in single precision over a grid of hexahedra and its nested coarser levels:
/// what a live frame on a grid is preconditioned with. No level has a matrix. Each is
/// re-discretised: Hooke's law of its cells by their shares, turned by one rotation a cell that is
/// taken from the displacement, carried down as means. Smoothing on the diagonal; trilinear
/// transfers; the coarsest level by its dense inverse, made anew when constraints or coefficients
/// change. After `set_constrained` and the first `update`, nothing allocates.
class GridCycle {
  public:
    /// The coarsest level has no more cells, unless coarsening brings no fewer ...
    static constexpr std::size_t cells_to_invert = 150;
    /// ... and no more nodes: its inverse is dense.
    static constexpr std::size_t max_coarsest_nodes = 2000;

    /// `levels` (hexahedra in single precision), finest first, and the team must outlive this;
    /// `grids`: the same levels.
    GridCycle(std::vector<LevelAssembler*> levels, std::span<const HexLevel> grids,
              int smoothing_steps, ThreadTeam& team);
    ~GridCycle();

    /// Takes up the levels' constrained components and springs.
    void set_constrained();
    /// Renews s K(R) + m M for the displacement of `at` on all levels.
    void update(const ElementRotations& at, double s, double m);
    /// z = one symmetric V-cycle for A z = r from zero; r and z zero at constrained components.
    void cycle(std::span<const double> r, std::span<double> z);

    double bytes_of_cycle() const;

  private:
    struct Level;
    void carry_displacements(const ElementRotations& finest);
    void invert_coarsest();
    void descend(std::size_t level);
    void restrict_residual(std::size_t level);
    void add_correction(std::size_t level);

    ThreadTeam& team_;
    int smoothing_steps_;
    std::vector<std::unique_ptr<Level>> levels_;
    Eigen::MatrixXf inverse_;  ///< of the coarsest operator
    double s_ = 0, m_ = 0;     ///< of that
    bool is_new_ = true;       ///< constraints are: bounds and inverse must be made
};

}  // namespace livetet
