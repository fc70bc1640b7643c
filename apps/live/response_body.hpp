#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "apps/scene/body_factory.hpp"
#include "mesh/quadratic.hpp"
#include "mesh/surface_ring.hpp"

namespace livetet {

/// A patch as the responses take it.
struct ResponsePatch {
    std::vector<std::int32_t> nodes{}, wider_nodes{};
    double wider_by = 0, radius_spread = 0;  ///< of its radius, m
    Vector3 centre = Vector3::Zero();        ///< about which it turns: the sensor's base, m
    Vector3 place = Vector3::Zero();         ///< where it lies on the body at rest, m
    double radius = 0;                       ///< m
    std::optional<double> stiffness{};       ///< of springs, N/m; none: prescribed
    bool turns = false;                      ///< it follows the sensor's rotation
    SurfaceRing ring{};                      ///< the tissue around it
};

/// What holds a body beside its patches, all at rest.
struct Holding {
    Constraints constraints;
    Springs springs;
};

/// A body that responses are solved with, and the places at which they are sampled.
class ResponseBody {
  public:
    /// `held`: what holds the corners, without the patches.
    ResponseBody(const Scene& scene, const MeshHierarchy& hierarchy, Use use, const Holding& held,
                 std::span<const Vector3> samples);

    /// Displacements of the nodes for a unit motion of one patch while the others rest: along an
    /// axis (0 to 2), or about one (3 to 5). `wider`: of the patches' wider nodes. `start`: those
    /// of the model at the corners, or none. Throws Error if the solve does not converge.
    std::vector<Vector3> solve(std::span<const ResponsePatch> patches, std::size_t moved,
                               int motion, bool wider, const std::vector<Vector3>& start);
    const TetMesh& mesh() const { return body_.mesh(); }
    std::vector<Vector3> sample(const std::vector<Vector3>& field) const {
        return sampler_.sample(field);
    }

  private:
    std::vector<int> patches_at_nodes(std::span<const ResponsePatch> patches, bool wider) const;
    void hold(const ResponsePatch& patch, bool wider, int motion, std::span<const int> shared,
              Constraints& constraints, Springs& springs) const;

    SceneBody body_;
    Holding held_;
    PointSampler sampler_;
};

}  // namespace livetet
