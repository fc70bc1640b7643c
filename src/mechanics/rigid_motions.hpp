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

/// What held components of a body's points do against its rigid motions.
class HeldMotions {
  public:
    using Matrix6 = Eigen::Matrix<double, 6, 6>;
    /// Turns are about `centre`, and as long as at `size` m from it, the body's extent.
    HeldMotions(const Vector3& centre, double size) : centre_(centre), size_(size) {}
    /// `components`: bit 0: x, 1: y, 2: z.
    void hold(const Vector3& x, std::uint8_t components);
    /// Sum over the held components of (motion there)^2, of motions t + w x (x - centre) / size as
    /// (t, w).
    const Matrix6& gram() const { return gram_; }
    /// Whether none is free, nor as good as: a patch of a hundredth of the body's extent still
    /// holds it.
    bool all_held() const;

  private:
    Vector3 centre_;
    double size_;
    Matrix6 gram_ = Matrix6::Zero();
};

/// A rigid motion that nothing holds.
struct FreeMotion {
    std::string description;  ///< "translation along (0, 0, 1)", "rotation about (0, 0, 1) through
                              ///< (1.0, 2.0, 3.0) mm"
};

/// The rigid motions of each connected piece of the mesh that its held components leave free: what
/// a static solve has no answer for. `held`: for every node, bit 0: x, 1: y, 2: z. O(tets).
std::vector<FreeMotion> free_rigid_motions(const TetMesh& mesh, std::span<const std::uint8_t> held);

}  // namespace livetet
