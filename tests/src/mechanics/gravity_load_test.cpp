// Nodal forces of a body's weight: their sum and their moment are the body's, region by region.
#include "mechanics/gravity_load.hpp"

#include <gtest/gtest.h>

#include "mesh/quadratic.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

const Vector3 gravity(1, -2, -9.81);

/// A block of two halves along x, of 1000 and 3000 kg/m^3.
const std::vector<Material> materials{{.density_kg_per_m3 = 1000, .region = 1},
                                      {.density_kg_per_m3 = 3000, .region = 2}};

TetMesh two_halves() {
    TetMesh mesh = test::block({4, 2, 2}, {0.4, 0.1, 0.2});
    for (const Tet& t : mesh.tets) {
        double x = 0;
        for (const std::int32_t n : t) x += mesh.nodes[n].x() / 4;
        mesh.regions.push_back(x < 0.2 ? 1 : 2);
    }
    return mesh;
}

void expect_weight(const TetMesh& mesh) {
    const auto force = gravity_load(mesh, materials, gravity);
    ASSERT_EQ(force.size(), mesh.nodes.size());
    Vector3 sum = Vector3::Zero(), moment = Vector3::Zero();
    for (std::size_t n = 0; n < force.size(); ++n) {
        sum += force[n];
        moment += mesh.nodes[n].cross(force[n]);
    }
    const double half = 0.2 * 0.1 * 0.2;  // m^3
    const Vector3 weight = half * (1000 + 3000) * gravity;
    const Vector3 expected = half * (1000 * Vector3(0.1, 0.05, 0.1).cross(gravity) +
                                     3000 * Vector3(0.3, 0.05, 0.1).cross(gravity));
    EXPECT_LT((sum - weight).norm(), 1e-12 * weight.norm());
    EXPECT_LT((moment - expected).norm(), 1e-12 * expected.norm());
}

TEST(GravityLoad, HasTheWeightAndTheMomentOfTheBody) {
    expect_weight(two_halves());
    expect_weight(quadratic_mesh(two_halves()));
}

TEST(GravityLoad, ARegionWithoutMaterialIsRefused) {
    EXPECT_THROW(gravity_load(two_halves(), {materials.data(), 1}, gravity), Error);
}

}  // namespace
}  // namespace livetet
