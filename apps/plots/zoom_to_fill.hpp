#pragma once

#include <span>

#include "mesh/tet_mesh.hpp"

class vtkRenderer;

namespace livetet {

/// The largest factor of vtkCamera::Zoom at which all points, mm, stay within these fractions of
/// the view's width and height.
double zoom_to_fill(vtkRenderer* renderer, std::span<const Vector3> points, double width,
                    double height);

}  // namespace livetet
