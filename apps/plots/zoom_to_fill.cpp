#include "apps/plots/zoom_to_fill.hpp"

#include <vtkCamera.h>
#include <vtkRenderer.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace livetet {

double zoom_to_fill(vtkRenderer* renderer, std::span<const Vector3> points, double width,
                    double height) {
    vtkCamera* camera = renderer->GetActiveCamera();
    const Vector3 eye(camera->GetPosition()),
        ahead = (Vector3(camera->GetFocalPoint()) - eye).normalized();
    const Vector3 right = ahead.cross(Vector3(camera->GetViewUp())).normalized(),
                  up = right.cross(ahead);
    double widest = 0, highest = 0;  // tangents of viewing angles
    for (const Vector3& x : points) {
        const Vector3 seen = x - eye;
        const double depth = std::max(seen.dot(ahead), 1e-3);
        widest = std::max(widest, std::abs(seen.dot(right)) / depth);
        highest = std::max(highest, std::abs(seen.dot(up)) / depth);
    }
    const double half = std::tan(0.5 * std::numbers::pi / 180 * camera->GetViewAngle());
    return std::min(width * half * renderer->GetTiledAspectRatio() / widest,
                    height * half / highest);
}

}  // namespace livetet
