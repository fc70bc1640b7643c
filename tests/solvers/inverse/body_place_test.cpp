// Places in a body, on four and on ten nodes a tet.

#include "solvers/inverse/body_place.hpp"

#include <gtest/gtest.h>

#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

TEST(BodyPlace, ReproducesLinearFieldsAndOnTenNodesQuadraticOnes) {
    const TetMesh linear = test::block({3, 2, 2}, Vector3(0.3, 0.2, 0.2));
    const std::vector<Vector3> points{{0.11, 0.07, 0.13}, {0.29, 0.01, 0.02}};
    for (const TetMesh& mesh : {linear, quadratic_mesh(linear)}) {
        const bool is_quadratic = mesh.nodes.size() > linear.nodes.size();
        const auto field = [&](const Vector3& x) {
            const double bend = is_quadratic ? x.x() * x.y() : 0;
            return Vector3(2 * x.x() - x.z() + bend, x.y(), 1 + x.z());
        };
        std::vector<Vector3> values;
        Eigen::MatrixXd column(3 * std::ssize(mesh.nodes), 1);
        for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
            values.push_back(field(mesh.nodes[n]));
            column.block<3, 1>(3 * static_cast<Eigen::Index>(n), 0) = values.back();
        }
        const std::vector<BodyPlace> places = places_in(mesh, points);
        for (std::size_t i = 0; i < points.size(); ++i) {
            EXPECT_LT((places[i].of(values) - field(points[i])).norm(), 1e-12);
            EXPECT_LT((places[i].rows_of(column) - field(points[i])).norm(), 1e-12);
        }
    }
}

}  // namespace
}  // namespace livetet
