#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "mechanics/constraints.hpp"
#include "support/shapes.hpp"

namespace livetet::test {

/// A beam of beam_size held at x = 0, with a square of its top that is moved: all nodes less than
/// `half_width` metres from the middle in x and y.
inline Constraints pressed_beam(const TetMesh& mesh, double half_width, const Vector3& motion) {
    Constraints constraints(mesh.nodes.size());
    constraints.prescribe(nodes_where(mesh, [](const Vector3& x) { return x.x() < 1e-9; }),
                          Vector3::Zero());
    constraints.prescribe(nodes_where(mesh,
                                      [half_width](const Vector3& x) {
                                          return x.z() > 0.0999 &&
                                                 std::abs(x.x() - 0.1) < half_width &&
                                                 std::abs(x.y() - 0.05) < half_width;
                                      }),
                          motion);
    return constraints;
}

/// Both ends of the beam held, one moved towards the other by a share of the length.
inline Constraints shortened_beam(const TetMesh& mesh, double share) {
    Constraints constraints(mesh.nodes.size());
    for (const double end : {0.0, beam_size.x()})
        constraints.prescribe(
            nodes_where(mesh, [end](const Vector3& x) { return std::abs(x.x() - end) < 1e-9; }),
            Vector3(-share * end, 0, 0));
    return constraints;
}

/// The largest distance between corresponding places, m.
inline double largest_gap(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
    double largest = 0;
    for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, (a[i] - b[i]).norm());
    return largest;
}

}  // namespace livetet::test
