#pragma once

#include <memory>
#include <span>
#include <vector>

#include "mechanics/batch_kernels.hpp"
#include "solvers/elastic_level.hpp"
#include "solvers/transfer.hpp"

namespace livetet {

/// A geometric multigrid cycle in single precision over the levels of a hierarchy, each re-discretised with its own
/// rotations: what a live frame is preconditioned with, on one rank, P1, linear and corotated strain. Its finest
/// operator is the frame's too. Chebyshev smoothing on 3x3 block Jacobi, the coarsest level by a dense Cholesky factor
/// made when constraints or coefficients change. After `set_constrained` and the first `update`, nothing allocates.
class FloatMultigrid {
  public:
    /// `levels`, finest first, and the maps between them must outlive this.
    FloatMultigrid(std::vector<const ElasticLevel*> levels, std::vector<const BarycentricMap*> maps, int smoothing_steps);
    ~FloatMultigrid();

    const BarycentricMap& map(std::size_t level) const { return *maps_[level]; }

    /// Takes up the levels' constrained components and springs.
    void set_constrained();

    /// The operators s K(R) + m M at displacement `u` (m, 3 numbers a node).
    void update(std::span<const double> u, double s, double m);

    /// y = A x on the finest level; constrained components as the identity's, scaled.
    void multiply(std::span<const double> x, std::span<double> y);
    /// z = one symmetric V-cycle for A z = r from zero.
    void cycle(std::span<const double> r, std::span<double> z);

    /// Bytes that one `update` and one `cycle` with one `multiply` have to move, from and to memory.
    double bytes_of_update() const;
    double bytes_of_iteration() const;

  private:
    struct Level;
    void restrict_displacements();
    void find_bounds(Level& level);
    void factor_coarsest();
    void descend(std::size_t l);

    std::vector<std::unique_ptr<Level>> levels_;
    std::vector<const BarycentricMap*> maps_;
    int smoothing_steps_;
    double s_ = 0, m_ = 0;  ///< of the coarsest factor
    bool fresh_ = true;     ///< constraints are new: bounds and factor must be made
};

}  // namespace livetet
