#pragma once

#include <Eigen/Cholesky>

#include <memory>
#include <span>
#include <vector>

#include "base/thread_team.hpp"
#include "mechanics/batch_kernels.hpp"
#include "mechanics/scaled_stiffness.hpp"
#include "solvers/assembly/level_assembler.hpp"
#include "solvers/linear/transfer.hpp"

namespace livetet {

/// A geometric multigrid cycle in single precision over the levels of a hierarchy, each
/// re-discretised with its own rotations: what a live frame is preconditioned with, on one rank,
/// P1, linear and corotated strain. Its finest operator is the frame's too. Chebyshev smoothing on
/// 3x3 block Jacobi; the coarsest level by its dense inverse, made anew when constraints or
/// coefficients change. After `set_constrained` and the first `update`, nothing allocates.
class SinglePrecisionMultigrid {
  public:
    /// The coarsest level's inverse is dense: 150 MB at so many nodes.
    static constexpr std::size_t max_coarsest_nodes = 2000;
    /// Largest ratio of Young's moduli. At 1e6 the stiffness of the soft part is lost in round-off,
    /// and bodies run away (`livetet bench stability`).
    static constexpr double max_contrast = 1e5;

    /// `levels` (without matrices), finest first, the maps between them and the team must outlive
    /// this. Precondition: why_not_live() is empty: at least two levels, the coarsest of at most
    /// max_coarsest_nodes.
    SinglePrecisionMultigrid(std::vector<LevelAssembler*> levels,
                             std::vector<const BarycentricMap*> maps, int smoothing_steps,
                             ThreadTeam& team);
    ~SinglePrecisionMultigrid();

    const BarycentricMap& map(std::size_t level) const { return *maps_[level]; }

    /// Takes up the levels' constrained components and springs.
    void set_constrained();

    /// Renews the operators s K(R) + m M with the rotations of the finest level. If `wanted` is
    /// half: of the finest level only the half that was not renewed last, unless constraints are
    /// new or s or m has changed by more than 5 %. Returns what was renewed.
    RenewalExtent update(const ElementRotations& finest, double s, double m,
                         RenewalExtent wanted = RenewalExtent::whole);

    /// y = A x on the finest level, x and y zero at constrained components.
    void multiply(std::span<const double> x, std::span<double> y);
    /// z = one symmetric V-cycle for A z = r from zero; r and z zero at constrained components.
    void cycle(std::span<const double> r, std::span<double> z);

    /// What one `update`, one `multiply` and one `cycle` have to move, from and to memory, if every
    /// array is read or written once where it is used; bytes.
    double bytes_of_update() const;
    double bytes_of_multiply() const;
    double bytes_of_cycle() const;

  private:
    struct Level;
    void restrict_displacements(const ElementRotations& finest);
    void find_bounds(Level& level);
    void invert_coarsest();
    void descend(std::size_t l);

    ThreadTeam& team_;
    std::vector<std::unique_ptr<Level>> levels_;
    std::vector<const BarycentricMap*> maps_;
    int smoothing_steps_;
    Eigen::MatrixXf dense_;  ///< the coarsest operator's inverse
    Eigen::LLT<Eigen::MatrixXf> factor_;
    double s_ = 0, m_ = 0;           ///< of the coarsest inverse
    double s_now_ = 1;               ///< of the other levels' operators
    Renewal half_ = Renewal::whole;  ///< that was written last of the finest level
    bool fresh_ = true;              ///< constraints are new: bounds and inverse must be made
};

}  // namespace livetet
