#pragma once

#include <Eigen/Geometry>

#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "base/thread_team.hpp"
#include "mechanics/batch_law.hpp"
#include "mechanics/hex_stiffness.hpp"
#include "mechanics/mapped_hexahedron.hpp"
#include "mechanics/material.hpp"
#include "mechanics/rotation.hpp"
#include "solvers/assembly/block_matrix.hpp"
#include "solvers/assembly/configuration.hpp"
#include "solvers/assembly/operator_terms.hpp"
#include "solvers/assembly/pressure_space.hpp"

namespace livetet {

/// Mean values over one tet.
struct TetFields {
    Eigen::Matrix3d cauchy_stress_Pa = Eigen::Matrix3d::Zero();
    double volume_change = 0;  ///< det F - 1; small strain: tr eps
    double strain_energy_J_per_m3 = 0;
};

/// The elements of a level that keeps no matrix, in single precision, their law, and room for what
/// its kernels read and add to. Relative to force_at_unit_strain(), forces are accurate to about
/// 1e-7: rounding u to float moves an equilibrium by no more than that rounding.
struct SinglePrecisionBatches {
    std::variant<TetBatches<float>, TetBatches<float, 10>, TetBatches<float, 8>> batches;
    const BatchLaw& law;
    std::unique_ptr<const BatchLaw> own_law;  ///< where no model has written it
    std::vector<float> values, forces;  ///< three numbers a local node, one number behind the last
    float per_modulus = 0;              ///< mixed form: see MixedTets
    std::vector<std::int32_t> pressure_places{};  ///< of each local pressure in MixedValues::p
    std::vector<float> pressures{};               ///< room for MixedValues::p

    const TetBatches<float>& four_nodes() const { return std::get<0>(batches); }
    std::size_t batch_count() const {
        return std::visit([](const auto& b) { return b.all().end; }, batches);
    }
};

/// Where a direction may be other than zero: at all components, or at constrained ones alone, so
/// that only the tets around these are computed (on a level in single precision).
enum class Support { all, constrained };

/// What a level keeps to be computed with: a matrix of that layout, and whatever its forces need in
/// double precision; no matrix, and its elements in single precision; no matrix, its elements in
/// double precision, and a copy in single precision to smooth with (see add_single_products); or
/// nothing.
struct SinglePrecision {};
struct BothPrecisions {};
struct GeometryOnly {};
using LevelStorage = std::variant<MatrixLayout, SinglePrecision, BothPrecisions, GeometryOnly>;

/// Elements and operator of one mesh level, of P1 or P2 tets or hexahedra: the sum of a tangent
/// stiffness, damping and the lumped mass that OperatorTerms names; rows and columns of constrained
/// components are those of the identity. In the mixed form K is that of the displacements alone,
/// psi_mu + p theta at a given p. A grid's hexahedra have no matrix; their mixed form is Q1-P0. In
/// single precision the pressures of the cells are unknowns; else each cell eliminates its own,
/// p = lambda times the cell's mean of theta. Quadratic hexahedra have a matrix alone; their mixed
/// form is Q2-P1, of pressures that are linear in each cell.
///
/// An assembler holds what does not change with the displacement: elements, moduli, constraints,
/// the matrix. Where the body is comes as a Configuration with each call. To evaluate forces at u:
///
///     ElementRotations rotations = level.make_rotations();    // once
///     update_ghosts(u);
///     level.update_rotations(u, rotations);
///     level.elastic_force({u, p, &rotations}, f);
class LevelAssembler {
  public:
    /// Collective. `materials` by region: exactly one applies to each tet (throws Error where none
    /// does); those that name no model are of `model`. `team` works on the batches and must outlive
    /// this.
    LevelAssembler(PartitionedMesh share, std::span<const Material> materials,
                   const ModelChoice& model, Formulation formulation, LevelStorage storage,
                   ThreadTeam& team = ThreadTeam::alone());

    const PartitionedMesh& share() const { return share_; }
    /// Whether all models are of small strain: forces and operators are linear in u.
    bool is_linear() const { return is_linear_; }
    /// Whether rotations are taken: a model rotates with its elements, or the preconditioner of a
    /// level in single precision does.
    bool rotates() const { return rotates_; }
    /// Whether ElementRotations must be taken anew before any evaluation.
    bool reads_rotations() const { return rotates_ || keeps_displacement(); }
    /// Gradients, volume and moduli of a local tet, or of a quadratic hexahedron those of
    /// mapped_element. Computed from the places of its nodes on each call; storing it would add a
    /// third to the level's memory.
    TetElement element(std::size_t e) const;
    MappedHexahedron mapped_element(std::size_t e) const;
    /// Integrals of the products of an element's pressure_shape, m^3.
    Eigen::Matrix4d pressure_mass(std::size_t e) const;
    /// The same as the operator of the displacements has it. In the mixed form without lambda; in
    /// single precision with the least mu in its place, by which batches hold volumes (see
    /// MixedTets): a preconditioner of that small Poisson's ratio does as well.
    TetElement operator_element(std::size_t e) const;
    std::vector<TetElement> elements() const;  ///< all of them, as the operator has them
    /// Of the nodes at rest, m, of the whole mesh. Collective.
    Eigen::AlignedBox3d bounding_box() const;
    Mat matrix() const { return matrix_ ? matrix_->get() : nullptr; }
    /// Gives a level of BothPrecisions a matrix beside. Collective.
    void make_matrix(MatrixLayout layout);
    /// Tells the matrix of the six rigid motions, for algebraic multigrid. Collective.
    void set_rigid_motions() { matrix_->set_rigid_motions(share_, share_.rest); }
    /// Where the pressures live; empty in the displacement form.
    const PressureSpace* pressure_space() const { return pressure_ ? &*pressure_ : nullptr; }

    /// A vector of displacements, or of pressures in the mixed form. On one rank, of a level that
    /// is or has a copy in single precision, its sums and updates run on the team.
    PetscHandle<Vec> make_vector() const;
    PetscHandle<Vec> make_pressure_vector() const;
    /// Lumped mass of each owned node, kg; empty before `find_mass`.
    std::span<const double> node_mass() const { return node_mass_; }
    void find_mass();
    /// Memory of the matrix, bytes.
    double matrix_bytes() const;
    /// Constrained components of each local node (bit 0: x, 1: y, 2: z).
    std::span<const std::uint8_t> constrained() const { return constrained_; }

    /// `components`: of this rank's own nodes, which come first; its ghosts get theirs from their
    /// owners. Collective.
    void set_constrained(std::span<const std::uint8_t> components);
    /// Springs to ground, N/m, of this rank's own nodes; empty: none.
    void set_springs(std::span<const double> stiffness);
    /// Of each owned node, N/m; empty: none.
    std::span<const double> springs() const { return springs_; }

    /// Rotations in the layout of this level, all the identity.
    ElementRotations make_rotations() const;
    /// Takes the rotation of every quadrature point from `u` (ghosts up to date). Does nothing for
    /// a model that does not rotate.
    void update_rotations(Vec u, ElementRotations& rotations) const;
    /// The same for a preconditioner of hexahedra, of each cell alone; levels in single precision
    /// only. Keeps the displacement where the body turns.
    ElementRotations make_rotations_of_cells() const;
    /// Of each hexahedron from its mean gradient, for a preconditioner.
    std::vector<Eigen::Matrix3d> cell_rotations(Vec u) const;
    /// The rotations from rotations.single_u; levels in single precision only.
    void update_single_rotations(ElementRotations& rotations) const;
    /// The tets in single precision, of a level that has nothing else or a copy; else null.
    const SinglePrecisionBatches* single() const { return single_ ? single_.get() : copy_.get(); }
    /// Rotations for the copy of BothPrecisions, of the present ones.
    void round_rotations(const ElementRotations& from, ElementRotations& to) const;
    const BatchParts& parts() const { return parts_; }

    /// Writes the sum of `terms` and the springs into the matrix; `at`: where K is taken.
    void assemble(const Configuration& at, const OperatorTerms& terms);

    /// Keeps the stiffness K_d at `at` by which damping is taken until the next call: with frozen
    /// rotations, or the positive part of finite strain's tangent, so that damping never adds
    /// energy. Levels in double precision only (keeps_damping). Collective.
    void keep_damping(const Configuration& at);
    bool keeps_damping() const { return matrix_ || copy_ || is_grid_without_matrix(); }
    /// f += factor K_d v, constrained components too. Ghosts of v are up to date.
    void add_damping_times(double factor, Vec v, Vec f) const;
    /// The same on a grid without a matrix, after keep_damping.
    void add_grid_damping_times(double factor, std::span<const double> v,
                                std::span<double> f) const;

    /// f = elastic force of `at`, in N, at all owned nodes, constrained ones too (where it is the
    /// reaction).
    void elastic_force(const Configuration& at, Vec f) const;

    /// Whether a level in single precision is of Hooke's law: its K is positive, and its rotations
    /// are the law's, of each point. Else they are the preconditioner's, of each tet.
    bool has_hooke_batches() const { return single_ && &single_->law == &hooke_law(); }
    /// Whether `frozen_force` can be had: linear or corotated strain over batches, without
    /// pressures.
    bool has_frozen_force() const { return batches_ || (has_hooke_batches() && !is_mixed()); }
    /// f = elastic force at the displacement `y` (ghosts up to date) by given rotations, of which
    /// it is affine in y.
    void frozen_force(Vec y, const ElementRotations& rotations, Vec f) const;

    /// f += factor K v, K at `at`: with frozen rotations, or finite strain's exact tangent. Ghosts
    /// of v are up to date.
    void add_stiffness_times(double factor, const Configuration& at, Vec v, Vec f,
                             Support of_v = Support::all) const;

    /// f = factor K v on a level of BothPrecisions, K of that tangent at `at`. Ghosts of v are up
    /// to date.
    void tangent_times(double factor, Tangent tangent, const Configuration& at, Vec v, Vec f) const;

    /// f += factor K v on hexahedra. Tangent::frozen_rotation: exact for models without rotations.
    void add_hexahedra_times(double factor, Tangent tangent, const Configuration& at,
                             std::span<const double> v, std::span<double> f) const;
    /// Whether hexahedra eliminate their pressures: each cell's p = lambda mean(theta). Where the p
    /// of a Configuration is given, of one number a cell, it is taken in place of that.
    bool has_mean_dilation() const { return has_mean_dilation_; }
    PetscHandle<Vec> make_cell_vector() const;  ///< of such a level: one number a cell
    /// On such a level, p = lambda mean(theta + d theta : grad v) of each cell, at the displacement
    /// of `at`, Pa; v null: zero.
    void find_cell_pressures(const Configuration& at, Vec v, Vec p) const;
    /// The derivative of each cell's mean(theta) by its corners' displacements, 1/m.
    std::vector<CellDilation> cell_dilations(const Configuration& at) const;
    /// visit(n as a constant) for the nodes of an element of a level that batches can have.
    template <class Visitor>
    decltype(auto) with_batch_shape(Visitor&& visitor) const {
        if (!share_.hexahedra.empty()) return visitor(std::integral_constant<int, 8>{});
        return share_.edge_nodes.empty() ? visitor(std::integral_constant<int, 4>{})
                                         : visitor(std::integral_constant<int, 10>{});
    }
    /// Lame's moduli of a local tet or hexahedron.
    std::pair<double, double> lame_moduli(std::size_t e) const {
        return {moduli(e).lambda, moduli(e).mu};
    }

    /// f += factor K v on a level in single precision, or by the copy of one that has both.
    /// Tangent::exact: K of its law, at the displacement of `at`; else Hooke's law turned by the
    /// rotations of `at`, which is positive semi-definite. Three numbers a local node, one number
    /// behind.
    void add_single_products(float factor, Tangent tangent, const ElementRotations& at,
                             std::span<const float> v, std::span<float> f,
                             Support of_v = Support::all) const;

    /// The mixed form on a level in single precision. Writes a vector of pressures to `places`, in
    /// the layout of MixedValues::p.
    void take_pressures(Vec p, std::span<float> places) const;
    /// f and g (see MixedLaw) at `p` and the displacement of `at`.
    void add_mixed_forces(const ElementRotations& at, std::span<const float> p,
                          const MixedForces& to) const;
    /// Their derivative.
    void add_mixed_products(float factor, const ElementRotations& at, std::span<const float> p,
                            const MixedValues& v, const MixedForces& to,
                            Support of_v = Support::all) const;
    void add_pressure_forces(const ElementRotations& at, std::span<const float> q,
                             std::span<float> f) const;

    /// work(i) on each displacement component of the local nodes, by pieces of the team.
    template <class Work>
    void over_components(Work&& work) const {
        team_.run_pieces(3 * share_.nodes.size(), 1000, [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) work(i);
        });
    }

    /// |f|, f_n = sum over the tets at node n of V (|lambda| + 2 mu) |grad L_i|, N (mixed form:
    /// without lambda): the size of forces at a strain of one. Collective.
    double force_at_unit_strain() const;

    /// Error of forces by round-off, relative to force_at_unit_strain: 16 epsilons of double, or
    /// one epsilon of float on a level in single precision.
    double force_epsilon() const;

    /// Strain energy, J; collective.
    double strain_energy(const Configuration& at) const;

    /// `visit(local tet, its mean volume change and energy)` for each local tet; the stress is left
    /// to visit_stress.
    template <class Visit>
    void visit_fields(const Configuration& at, Visit&& visit) const;

    /// `visit(local tet, det F)`, the mean over its quadrature points, whatever the model.
    template <class Visit>
    void visit_volume_ratio(const Configuration& at, Visit&& visit) const;

    /// `visit(local tet, point, the volume it stands for, Cauchy stress Pa)` at every quadrature
    /// point.
    template <class Visit>
    void visit_stress(const Configuration& at, Visit&& visit) const;

    /// Theta and its derivative at each point: `visit(e, point, weight m^3, theta, n)` with n (3 x
    /// nodes) the derivative of theta by the nodes' displacements.
    template <class Visit>
    void visit_volume_strain(const Configuration& at, Visit&& visit) const;

  private:
    struct Moduli {
        double lambda, mu;  ///< Pa
        double density;     ///< kg/m^3
        ModelChoice model;
    };
    static double away_from_zero(double J) { return std::abs(J) > 1e-12 ? J : 1e-12; }

    template <int nodes>
    using Nodal = Eigen::Matrix<double, 3, nodes>;

    /// visit(n as a constant) for the nodes of an element of this level.
    template <class Visitor>
    decltype(auto) with_shape(Visitor&& visitor) const {
        if (!share_.quadratic_hexahedra.empty()) return visitor(std::integral_constant<int, 27>{});
        return with_batch_shape(visitor);
    }
    /// The element as element_point takes it.
    template <int nodes>
    auto shaped_element(std::size_t e) const {
        if constexpr (nodes == 27)
            return mapped_element(e);
        else
            return element(e);
    }

    void find_moduli(std::span<const Material> materials, const ModelChoice& model);
    const Moduli& moduli(std::size_t e) const {
        return moduli_[moduli_of_tet_.empty() ? 0 : moduli_of_tet_[e]];
    }
    /// Whether the kernels over batches compute this level: P1 by displacements, of one model.
    bool is_batched() const;
    void make_double_batches();
    void make_single_batches();
    /// The copy of BothPrecisions.
    void make_copy();
    /// Of the mixed form.
    void make_single_pressures();
    double least_mu() const;
    /// The law of a level in single precision: that of its models if they share one, or one that
    /// calls the models.
    const BatchLaw* shared_law() const;
    /// The table from a tet to its lane.
    void number_lanes();
    /// The batches of a level in single precision around constrained components, in ranges.
    void find_constrained_batches();
    /// work(batches) on all of them by the whole team, or on those around constrained components;
    /// work may add to nodes.
    template <class Work>
    void over_batches(Work&& work, Support support = Support::all) const {
        if (support == Support::constrained) {
            for (const BatchRange range : constrained_batches_) work(range);
            return;
        }
        for (const auto& round : parts_.rounds)
            team_.run_tasks(round.size(), [&](std::size_t part) { work(round[part]); });
    }
    /// work(batches, range of them) on those in double precision, as over_batches.
    template <class Work>
    void over_double_batches(Work&& work) const {
        std::visit(
            [&](const auto& batches) {
                over_batches([&](BatchRange range) { work(batches, range); });
            },
            *batches_);
    }
    const TetBatches<double>& four_node_batches() const { return std::get<0>(*batches_); }
    /// work(nodes of each tet).
    template <class Work>
    void with_nodes(Work&& work) const {
        if (share_.edge_nodes.empty()) return work(share_.tets);
        std::vector<std::array<std::int32_t, 10>> nodes(share_.tets.size());
        for (std::size_t e = 0; e < nodes.size(); ++e)
            for (int i = 0; i < 10; ++i) nodes[e][i] = share_.node(e, i);
        work(nodes);
    }
    /// f += the elastic forces at u of a level in single precision.
    void add_single_forces(const ElementRotations& rotations, std::span<const float> u,
                           std::span<float> f) const;
    /// to += what add(from as floats, floats) adds, on a level in single precision.
    template <class Add>
    void add_in_single(std::span<const double> from, std::span<double> to, Add&& add) const;
    /// The local form's array of a vector, ghosts behind: what batches read and add to.
    static std::span<const double> all_of(const LocalValues& values, const PartitionedMesh& share) {
        return {values.data(), 3 * share.nodes.size()};
    }
    bool is_mixed() const { return pressure_.has_value(); }
    /// lambda times the mean of theta over an element's points, of equal weight.
    template <class Shape, class Values>
    double mean_pressure(const Configuration& at, std::size_t e, const TetElement& element,
                         const Values& values) const;
    CellDilation cell_dilation(const Configuration& at, std::size_t e, const TetElement& element,
                               const Nodal<8>& values) const;
    /// work(mixed law, tets of a batch range) on all batches of a level in single precision.
    template <class Work>
    void over_mixed_batches(const ElementRotations& at, Work&& work,
                            Support support = Support::all) const;
    /// Whether ElementRotations keep the displacement: for the law of a level in single precision.
    bool keeps_displacement() const { return single_ && (rotates_ || !has_frozen_force()); }
    /// Adds factor K at `at`.
    void add_stiffness(BlockMatrix::Filling& matrix, const Configuration& at, double factor,
                       Tangent tangent);
    template <int nodes>
    Nodal<nodes> values_at(std::size_t e, const double* values) const {
        Nodal<nodes> u;
        for (int i = 0; i < nodes; ++i)
            u.col(i) = Eigen::Map<const Eigen::Vector3d>(values + 3 * share_.node(e, i));
        return u;
    }
    /// Of a quadrature point, where the model rotates; H = F - I there.
    Eigen::Matrix3d rotation(const Configuration& at, std::size_t e, int point, int points,
                             const Eigen::Matrix3d& H) const {
        if (!rotates_ || moduli(e).model->kinematics() != Kinematics::corotated)
            return Eigen::Matrix3d::Identity();
        const ElementRotations& r = *at.rotations;
        const std::size_t lane = lane_of_tet_.empty() ? e : lane_of_tet_[e];
        if (single_)  // of other laws, rotations are the preconditioner's
            return has_hooke_batches() ? rotation_at<float>(r.single, lane, point, points)
                                       : rotation_of(Eigen::Matrix3d::Identity() + H);
        return batches_ ? rotation_at<double>(r.batches, lane, point, points)
                        : r.points[e * points + point];
    }
    /// lambda theta, or the interpolated pressure.
    template <int nodes, class Element>
    double pressure_at(const ConstitutiveModel& model, std::size_t e, const Element& element,
                       int point, const double* pressures, const Eigen::Matrix3d& H,
                       const Eigen::Matrix3d& R) const {
        if (!is_mixed()) return element.lambda * model.volume_strain(H, R);
        double p = 0;
        const Eigen::Vector4d L = pressure_shape<nodes>(element, point);
        for (int i = 0; i < 4; ++i) p += L[i] * pressures[pressure_->tets[e][i]];
        return p;
    }
    /// visit(model, e, element, point, its ElementPoint, H = F - I, R, p) at every quadrature point
    /// of every local tet or hexahedron.
    template <class Visit>
    void visit_points(const Configuration& at, Visit&& visit) const;

    /// Whether the level is one of hexahedra in double precision, which keep no matrix.
    bool is_grid_without_matrix() const {
        return !share_.hexahedra.empty() && !single_ && !matrix_;
    }
    void keep_grid_damping(const Configuration& at);

    PartitionedMesh share_;
    std::vector<Moduli> moduli_;  ///< those that there are
    bool is_linear_ = true, rotates_ = false;
    std::vector<std::int32_t> moduli_of_tet_;  ///< which of them; empty where there is but one
    // Of levels that batches compute (is_batched), and those of BothPrecisions.
    ThreadTeam& team_;
    BatchParts parts_;
    std::optional<std::variant<TetBatches<double>, TetBatches<double, 10>>> batches_;
    std::vector<std::int32_t> lane_of_tet_;           ///< empty: its own number
    std::unique_ptr<SinglePrecisionBatches> single_;  ///< without a matrix: instead of batches_
    std::unique_ptr<SinglePrecisionBatches> copy_;    ///< without a matrix: of batches_
    std::vector<double> node_mass_, springs_;
    std::vector<std::uint8_t> constrained_;
    std::vector<BatchRange> constrained_batches_;
    std::optional<BlockMatrix> matrix_;
    std::unique_ptr<BlockMatrix> damping_;  ///< K_d, without constraints
    ElementRotations damping_rotations_;    ///< those of K_d, on a level without a matrix
    bool keeps_damping_rotations_ = false;
    /// Shares of the cells in K_d, on a grid without a matrix.
    std::vector<Eigen::Matrix<float, 24, 24>> damping_of_cells_;
    PetscHandle<Vec> damping_force_;  ///< K_d v, N/s
    std::optional<PressureSpace> pressure_;
    bool has_mean_dilation_ = false;  ///< hexahedra
};

}  // namespace livetet
