#pragma once

#include <array>
#include <optional>
#include <variant>

#include "geometry/triangle_mesh.hpp"

namespace livetet {

/// A plane that cuts; or a disc or a parallelogram in it, both about `point`, border included.
struct PlanePatch {
    Vector3 point = Vector3::Zero();                ///< m
    Vector3 normal = Vector3::UnitZ();              ///< of any length but zero
    std::optional<double> radius{};                 ///< of a disc, m
    std::optional<std::array<Vector3, 2>> edges{};  ///< of a parallelogram in the plane, m
};

/// Triangles cut on both sides alike: their winding does not matter.
using CutSurface = std::variant<PlanePatch, TriangleMesh>;

/// Whether a point of a patch's plane lies in the patch, or not farther from it than `rounding`, m.
bool is_in_patch(const PlanePatch& patch, const Vector3& x, double rounding);

}  // namespace livetet
