#include "solvers/inverse/body_place.hpp"

#include "mesh/barycentric_map.hpp"
#include "mesh/quadratic.hpp"

namespace livetet {

Vector3 BodyPlace::of(std::span<const Vector3> values) const {
    Vector3 v = Vector3::Zero();
    for (std::size_t k = 0; k < nodes.size(); ++k) v += weights[k] * values[nodes[k]];
    return v;
}

Eigen::MatrixXd BodyPlace::rows_of(const Eigen::MatrixXd& fields) const {
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(3, fields.cols());
    for (std::size_t k = 0; k < nodes.size(); ++k)
        rows += weights[k] * fields.middleRows<3>(3 * static_cast<Eigen::Index>(nodes[k]));
    return rows;
}

std::vector<BodyPlace> places_in(const TetMesh& mesh, std::span<const Vector3> points) {
    const BarycentricMap map = map_into(mesh, points);
    const EdgeNodes edges(mesh);
    std::vector<BodyPlace> places(points.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
        const auto& corners = map.nodes[i];
        const auto& l = map.weights[i];
        BodyPlace& place = places[i];
        place.nodes.assign(corners.begin(), corners.end());
        for (const double w : l) place.weights.push_back(edges.empty() ? w : w * (2 * w - 1));
        if (edges.empty()) continue;
        for (int a = 0; a < 4; ++a)
            for (int b = a + 1; b < 4; ++b) {
                place.nodes.push_back(edges.between(corners[a], corners[b]));
                place.weights.push_back(4 * l[a] * l[b]);
            }
    }
    return places;
}

}  // namespace livetet
