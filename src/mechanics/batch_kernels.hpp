#pragma once

#include <Eigen/Geometry>

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "mechanics/block_pattern.hpp"
#include "mechanics/material.hpp"
#include "mechanics/tet_element.hpp"

/// The kernels of corotated tets for many at once, a tet in each lane of a vector register; `Real`
/// is float or double. All are pure, allocate nothing, and run over a range of batches: ranges
/// whose tets share no node (add_*) or no block (assemble) may run at once. Vectors of nodes hold 3
/// numbers a node, x y z; those of floats one number behind the last node's, which is read but not
/// used. Those of ten nodes are in double precision; batch_law.hpp has the others: other laws, and
/// hexahedra.
namespace livetet {

/// Tets in a batch: one AVX register's worth, whatever the compiler's flags, so that every file
/// sees the same layout.
template <class Real>
inline constexpr int batch_width = 32 / sizeof(Real);

/// See TetBatch; `[..][lane]`.
template <class Real, int nodes>
struct alignas(32) BatchNumbers {
    Real gradients[9][batch_width<Real>];  ///< row 3 i + a: component a of g_{i+1}, 1/m; g_0 = -
                                           ///< g_1 - g_2 - g_3
    Real lambda[batch_width<Real>];        ///< volume times lambda, N m
    Real mu[batch_width<Real>];            ///< volume times mu, N m
    std::int32_t offset[nodes][batch_width<Real>];  ///< 3 * node: where node i of the tet, corners
                                                    ///< first, stands in a vector of nodes
};
/// What the kernels read of `batch_width` tets of 4 or 10 nodes, or hexahedra of 8 by their corner
/// tets (ElementShape<8>).
template <class Real, int nodes = 4>
struct TetBatch : BatchNumbers<Real, nodes> {};
template <class Real>
struct TetBatch<Real, 8> : BatchNumbers<Real, 8> {
    /// The cells are next to each other along x, and so are the numbers of their nodes: corner
    /// 2 k + i of the cell in lane l is node offset[2 k][0] / 3 + l + i.
    bool is_row = false;
};

/// Where the edges of hexahedra lead: anywhere, or along the body's x, y and z in this order,
/// forwards or backwards.
enum class CellAxes { any, aligned };

/// A rotation for each tet of a batch, as the unit quaternion w, x, y, z: four numbers to keep and
/// to read in place of a matrix's nine. Tets of ten nodes have one batch of rotations for each
/// quadrature point, one behind the other.
template <class Real>
struct alignas(32) RotationBatch {
    Real quaternion[4][batch_width<Real>];
};

/// Batches [begin, end).
struct BatchRange {
    std::size_t begin, end;
};

/// Batches for threads to work on at once, in rounds. No two parts of a round share a node, so that
/// threads may add to the nodes of different parts; a round begins when the one before it is done.
/// A node's sum is then the same to the bit, whichever threads work and however many.
struct BatchParts {
    std::vector<std::int32_t> tet_of_lane;        ///< batch after batch; -1: none
    std::vector<std::vector<BatchRange>> rounds;  ///< the parts of each; at least one round

    /// All batches behind the first round.
    BatchRange later() const { return {rounds.front().back().end, rounds.back().back().end}; }
};

/// The first round has `parts` parts of consecutive tets, about as many to each, in batches of
/// `width`. Tets that touch nodes of an earlier part than their own are cut again for the next
/// round, into half as many parts. Few are where tets that are near in space are near in number
/// (sort_for_locality). Of hexahedra, a part has those of whole rows first (TetBatch<Real, 8>).
BatchParts part_batches(std::span<const std::array<std::int32_t, 4>> tets, int parts, int width);
BatchParts part_batches(std::span<const std::array<std::int32_t, 10>> tets, int parts, int width);
BatchParts part_batches(std::span<const std::array<std::int32_t, 8>> cells, int parts, int width);

/// The tets of a mesh in batches. Empty lanes hold copies of a tet that have no volume: their
/// forces and stiffness are zero.
template <class Real, int nodes = 4>
class TetBatches {
  public:
    using Nodes = std::array<std::int32_t, nodes>;
    /// Quadrature points of a tet.
    static constexpr int points = nodes == 8 ? 8 : nodes == 10 ? 4 : 1;

    /// `element(e)`: of the tet with the nodes `tets[e]`; a list of all would take more than the
    /// batches do. One after the other (hexahedra: whole rows first), or as `parts` says.
    using ElementOf = std::function<TetElement(std::size_t)>;
    TetBatches(const ElementOf& element, std::span<const Nodes> tets);
    TetBatches(const ElementOf& element, std::span<const Nodes> tets, const BatchParts& parts);

    /// The tet in a lane, or -1.
    std::int32_t tet_at(std::size_t batch, std::size_t lane) const {
        return tet_of_lane_[batch * batch_width<Real> + lane];
    }
    BatchRange all() const { return {0, batches_.size()}; }
    const TetBatch<Real, nodes>& operator[](std::size_t batch) const { return batches_[batch]; }
    CellAxes axes() const { return axes_; }
    /// A rotation store filled with identities: one for each point of each batch.
    std::vector<RotationBatch<Real>> make_rotations() const;
    /// The same where no tet turns: one identity for all batches.
    static std::vector<RotationBatch<Real>> make_fixed_rotations();

  private:
    void find_rows(std::span<const Nodes> cells);

    std::vector<std::int32_t> tet_of_lane_;
    std::vector<TetBatch<Real, nodes>> batches_;
    CellAxes axes_ = CellAxes::any;
};

/// Rotations of a batch; a store of size one serves all batches.
template <class Real>
const RotationBatch<Real>& rotation_of_batch(std::span<const RotationBatch<Real>> rotations,
                                             std::size_t batch) {
    return rotations[rotations.size() == 1 ? 0 : batch];
}

/// R = rotation_of(F), F = I + grad u, of each point of each tet, or at the centre of each tet
/// where there is one batch of rotations for a batch of tets; u in metres. By Newton's iteration in
/// all lanes (Higham 1986, as in rotation.cpp); tets that are flat, inverted, non-finite or
/// stretched out of all proportion go through rotation_of one by one.
template <class Real, int nodes>
void update_rotations(const TetBatches<Real, nodes>& batches, BatchRange range,
                      std::span<const Real> u, std::span<RotationBatch<Real>> rotations);

/// f_i += sum_q V_q P_q grad N_i, R fixed: P = R (2 mu eps + lambda tr(eps) I),
/// eps = sym(R^T F) - I; of tets of four nodes, and in double precision of ten, with a rotation for
/// each point or one that serves all. u in m, f in N.
template <class Real, int nodes = 4>
void add_forces(const TetBatches<Real, nodes>& batches, BatchRange range,
                std::span<const RotationBatch<Real>> rotations, std::span<const Real> u,
                std::span<Real> f);

/// f += factor K(R) v: the same with eps = sym(R^T grad v), times `factor`.
template <class Real, int nodes = 4>
void add_stiffness_times(Real factor, const TetBatches<Real, nodes>& batches, BatchRange range,
                         std::span<const RotationBatch<Real>> rotations, std::span<const Real> v,
                         std::span<Real> f);

/// Rotation of one lane at a quadrature point.
template <class Real>
Eigen::Matrix3d rotation_at(std::span<const RotationBatch<Real>> rotations, std::size_t lane,
                            int point = 0, int points = 1) {
    const std::size_t batch = lane / batch_width<Real> * points + point;
    const auto& q = rotation_of_batch(rotations, batch).quaternion;
    const std::size_t l = lane % batch_width<Real>;
    return Eigen::Quaterniond(q[0][l], q[1][l], q[2][l], q[3][l]).toRotationMatrix();
}

/// Adds `scale` times the sixteen 3x3 blocks of R K R^T of each tet,
/// K_ij = V (lambda h_i h_j^T + mu h_j h_i^T + mu (h_i . h_j) I) with h = R g, to blocks of nine
/// numbers, column-major; those that stand in one part of `pattern`, which has these tets. Values
/// in N/m for scale 1.
template <class Real>
void assemble(const TetBatches<Real>& batches, BatchRange range,
              std::span<const RotationBatch<Real>> rotations, Real scale,
              const BlockPattern& pattern, std::span<Real> values, int part = 0);

/// The same of the corotated energy's second derivative at `u` (m), where the rotations must have
/// been taken, so with their own derivative: with S = R^T F, G = tr(S) I - S and p = lambda (tr(S)
/// - 3), K_ij = V (2 mu (h_i . h_j) I + lambda h_i h_j^T + (p - 2 mu) [h_i]x^T (R G R^T)^-1 [h_j]x)
/// (from dR = R [w]x, G w = g x R^T du). `tangent`: Tangent::exact or ::positive.
void assemble_exact_tangent(const TetBatches<double>& batches, BatchRange range,
                            std::span<const RotationBatch<double>> rotations,
                            std::span<const double> u, Tangent tangent, double scale,
                            const BlockPattern& pattern, std::span<double> values, int part = 0);

/// f += factor K v with that K at `u`, of tets of four or ten nodes; rotations as add_forces has
/// them. v in m, f in N for factor 1.
template <int nodes>
void add_tangent_times(double factor, const TetBatches<double, nodes>& batches, BatchRange range,
                       std::span<const RotationBatch<double>> rotations, std::span<const double> u,
                       Tangent tangent, std::span<const double> v, std::span<double> f);

}  // namespace livetet
