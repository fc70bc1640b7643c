#include "meshing/stars.hpp"

namespace livetet {

std::vector<Star> stars_of(const TetMesh& mesh) {
    std::vector<Star> stars(mesh.nodes.size());
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
        for (const std::int32_t n : mesh.tets[t]) stars[n].push_back(static_cast<std::int32_t>(t));
    return stars;
}

double mean_edge(const TetMesh& mesh, const Star& star, std::int32_t n) {
    double sum = 0;
    for (const std::int32_t t : star)
        for (const std::int32_t m : mesh.tets[t]) sum += (mesh.nodes[m] - mesh.nodes[n]).norm();
    return sum / (3.0 * static_cast<double>(star.size()));
}

}  // namespace livetet
