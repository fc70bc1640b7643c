#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "mesh/tet_mesh.hpp"

namespace livetet {

/// For each node the lowest node of its connected piece.
std::vector<std::int32_t> connected_pieces(const TetMesh& mesh);

/// Which rigid motions a set of constrained components prevents.
class RigidMotionConstraints {
  public:
    using Matrix6 = Eigen::Matrix<double, 6, 6>;
    /// Turns are about `centre`, and as long as at `size` m from it, the body's extent.
    RigidMotionConstraints(const Vector3& centre, double size) : centre_(centre), size_(size) {}
    /// `components`: bit 0: x, 1: y, 2: z.
    void constrain(const Vector3& x, std::uint8_t components);
    /// Sum over the constrained components of (motion there)^2, of motions t + w x (x - centre) /
    /// size as (t, w).
    const Matrix6& gram() const { return gram_; }
    const Vector3& centre() const { return centre_; }
    double size() const { return size_; }
    /// In its place, as from a sum over parts of the body.
    void set_gram(const Matrix6& gram) { gram_ = gram; }
    /// Whether all six are prevented, with a margin that accepts a patch of 1/100 of the body's
    /// extent.
    bool constrains_all() const;

  private:
    Vector3 centre_;
    double size_;
    Matrix6 gram_ = Matrix6::Zero();
};

/// A rigid motion that no constraint prevents.
struct FreeMotion {
    std::string description;  ///< "translation along (0, 0, 1)", "rotation about (0, 0, 1) through
                              ///< (1.0, 2.0, 3.0) mm"
};

/// The rigid motions of one piece that `held` leaves free; each description ends in `where`.
std::vector<FreeMotion> free_motions(const RigidMotionConstraints& held,
                                     const std::string& where = {});

/// The rigid motions of each connected piece of the mesh that its held components leave free: what
/// a static solve has no answer for. `held`: for every node, bit 0: x, 1: y, 2: z. O(tets).
std::vector<FreeMotion> free_rigid_motions(const TetMesh& mesh, std::span<const std::uint8_t> held);

}  // namespace livetet
