#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include <memory>
#include <span>
#include <vector>

#include "base/lists.hpp"
#include "mesh/hex_hierarchy.hpp"
#include "solvers/linear/live_cycle.hpp"
#include "solvers/linear/matrix_free_smoother.hpp"
#include "solvers/linear/node_transfer.hpp"

namespace livetet {

/// The cycle of a grid of hexahedra and its nested coarser levels. No level has a matrix. Each is
/// re-discretised: Hooke's law of its cells by their shares, turned by one rotation a cell that is
/// taken from the displacement, carried down as means. Smoothing on the diagonal; trilinear
/// transfers; the coarsest level by its dense Cholesky factor, made anew when constraints, springs
/// or coefficients change.
class GridCycle final : public LiveCycle {
  public:
    /// The coarsest level has no more cells, unless coarsening brings no fewer ...
    static constexpr std::size_t cells_to_factor = 150;
    /// ... and no more nodes: its factor is dense.
    static constexpr std::size_t max_coarsest_nodes = 2000;

    /// `levels` (hexahedra in single precision), finest first, and the team must outlive this;
    /// `grids`: the same levels.
    GridCycle(std::vector<LevelAssembler*> levels, std::span<const HexLevel> grids,
              int smoothing_steps, ThreadTeam& team);
    ~GridCycle() override;

    void set_constrained() override;
    /// All of it, whatever is `wanted`: there are no matrices.
    RenewalExtent update(const ElementRotations& at, double s, double m,
                         RenewalExtent wanted = RenewalExtent::whole) override;
    /// The residual that a start leaves is smooth: the first cycle after it does not smooth the
    /// finest level before its correction, which saves a product and brings as much.
    void begin_solve(bool has_start) override { smooths_before_ = !has_start; }
    void cycle(std::span<const double> r, std::span<double> z) override { apply(r, z); }
    void cycle(std::span<const float> r, std::span<float> z) override { apply(r, z); }

    double bytes_of_update() const override;
    double bytes_of_cycle() const override;

  private:
    template <class Scalar>
    void apply(std::span<const Scalar> r, std::span<Scalar> z);
    struct Level;
    /// The rotations of the finest level's cells, once those of all levels are found.
    const ElementRotations& find_rotations(const ElementRotations& finest);
    void factor_coarsest();
    void descend(std::size_t level, bool smooths_before);
    void restrict_residual(std::size_t level, const std::vector<float>& r);
    enum class To { x, zero };  ///< what a correction is added to
    void add_correction(std::size_t level, To to);

    ThreadTeam& team_;
    int smoothing_steps_;
    bool smooths_before_ = true;  ///< on the finest level, in the next cycle
    std::vector<std::unique_ptr<Level>> levels_;
    Lists coarsest_neighbours_;  ///< of each node of the coarsest level
    std::vector<std::vector<std::int32_t>> coarsest_groups_;  ///< of its nodes, which are apart
    Eigen::LLT<Eigen::MatrixXf> factor_;                      ///< of the coarsest operator
    double s_ = 0, m_ = 0;                                    ///< of that
    bool is_new_ = true;  ///< constraints or springs are: the factor must be made
};

}  // namespace livetet
