#pragma once

#include <Eigen/Cholesky>

#include <memory>
#include <span>
#include <vector>

#include "base/thread_team.hpp"
#include "mechanics/batch_kernels.hpp"
#include "mechanics/scaled_stiffness.hpp"
#include "solvers/linear/live_cycle.hpp"
#include "solvers/linear/transfer.hpp"

namespace livetet {

/// The cycle of tets of four nodes, over the levels of a hierarchy, each re-discretised with its
/// own rotations; of Hooke's law. Its finest operator can be the frame's too. Chebyshev smoothing
/// on 3x3 block Jacobi; the coarsest level by its dense Cholesky factor, made anew when
/// constraints, springs or coefficients change.
class SinglePrecisionMultigrid final : public LiveCycle {
  public:
    /// The coarsest level's factor is dense: 150 MB at so many nodes.
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
    ~SinglePrecisionMultigrid() override;

    const BarycentricMap& map(std::size_t level) const { return *maps_[level]; }

    void set_constrained() override;
    /// If `wanted` is half: of the finest level only the half that was not renewed last, unless
    /// constraints are new or s or m has changed by more than 5 %.
    RenewalExtent update(const ElementRotations& finest, double s, double m,
                         RenewalExtent wanted = RenewalExtent::whole) override;

    /// y = A x on the finest level, x and y zero at constrained components.
    void multiply(std::span<const double> x, std::span<double> y) { multiply_by(x, y); }
    void multiply(std::span<const float> x, std::span<float> y) { multiply_by(x, y); }
    void cycle(std::span<const double> r, std::span<double> z) override { apply(r, z); }
    void cycle(std::span<const float> r, std::span<float> z) override { apply(r, z); }

    double bytes_of_update() const override;
    double bytes_of_multiply() const;
    double bytes_of_cycle() const override;

  private:
    template <class Scalar>
    void apply(std::span<const Scalar> r, std::span<Scalar> z);
    template <class Scalar>
    void multiply_by(std::span<const Scalar> x, std::span<Scalar> y);
    struct Level;
    void restrict_displacements(const ElementRotations& finest);
    void find_bound(Level& level, std::span<const RotationBatch<float>> rotations);
    void factor_coarsest();
    void descend(std::size_t l);

    ThreadTeam& team_;
    std::vector<std::unique_ptr<Level>> levels_;
    std::vector<const BarycentricMap*> maps_;
    int smoothing_steps_;
    Eigen::MatrixXf dense_;  ///< below and on its diagonal: the factor L of the coarsest operator
    double s_ = 0, m_ = 0;   ///< of the coarsest factor
    double s_now_ = 1;       ///< of the other levels' operators
    Renewal half_ = Renewal::whole;  ///< that was written last of the finest level
    bool fresh_ = true;              ///< constraints or springs are new: the factor must be made
    bool bounds_known_ = false;      ///< of the levels' smoothers
};

}  // namespace livetet
