#pragma once

#include <span>

#include "mesh/tet_mesh.hpp"

class vtkRenderer;

namespace livetet {

/// The factor of vtkCamera::Zoom at which `points`, mm, reach to `width` and `height` of the
/// renderer's view, 1 being its border.
double zoom_to_fill(vtkRenderer* renderer, std::span<const Vector3> points, double width,
                    double height);

}  // namespace livetet
