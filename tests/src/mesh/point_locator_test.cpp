// The tet that a point lies in, or the nearest place of the mesh.

#include "mesh/point_locator.hpp"

#include <gtest/gtest.h>

#include <random>

#include "base/error.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

const Vector3 located_box(0.2, 0.1, 0.1);

Vector3 place_of(const TetMesh& mesh, const PointLocator::Hit& hit) {
    Vector3 x = Vector3::Zero();
    for (int c = 0; c < 4; ++c) x += hit.weights[c] * mesh.nodes[hit.corners[c]];
    return x;
}

/// What holds of each hit: its corners are the tet's, its weights are shares.
void check(const TetMesh& mesh, const PointLocator::Hit& hit) {
    ASSERT_GE(hit.tet, 0);
    ASSERT_LT(hit.tet, std::ssize(mesh.tets));
    EXPECT_TRUE(std::ranges::is_permutation(hit.corners, mesh.tets[hit.tet]));
    double sum = 0;
    for (const double w : hit.weights) {
        EXPECT_GE(w, 0);
        EXPECT_LE(w, 1);
        sum += w;
    }
    EXPECT_NEAR(sum, 1, 1e-12);
}

TEST(PointLocator, FindsWhatLiesInside) {
    const TetMesh mesh = test::block({6, 3, 4}, located_box);
    const PointLocator locator(mesh);
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int k = 0; k < 2000; ++k) {
        const Vector3 x =
            located_box.cwiseProduct(Vector3(uniform(random), uniform(random), uniform(random)));
        const PointLocator::Hit hit = locator.find(x);
        check(mesh, hit);
        EXPECT_EQ(hit.distance, 0) << x.transpose();
        EXPECT_LT((place_of(mesh, hit) - x).norm(), 1e-12);
    }
    for (const Vector3& x : mesh.nodes) {
        const PointLocator::Hit hit = locator.find(x);
        check(mesh, hit);
        EXPECT_LT(hit.distance, 1e-12);
        EXPECT_LT((place_of(mesh, hit) - x).norm(), 1e-12);
    }
}

/// The nearest place of a box is the point with its coordinates clamped.
TEST(PointLocator, FindsTheNearestPlaceOutside) {
    const TetMesh mesh = test::block({6, 3, 4}, located_box);
    const PointLocator locator(mesh);
    std::mt19937 random(2);
    std::uniform_real_distribution<double> uniform(-1, 2);
    int outside = 0;
    for (int k = 0; k < 2000; ++k) {
        const Vector3 x =
            located_box.cwiseProduct(Vector3(uniform(random), uniform(random), uniform(random)));
        const Vector3 nearest = x.cwiseMax(Vector3::Zero()).cwiseMin(located_box);
        if (nearest == x) continue;
        ++outside;
        const PointLocator::Hit hit = locator.find(x);
        check(mesh, hit);
        EXPECT_NEAR(hit.distance, (x - nearest).norm(), 1e-12);
        EXPECT_LT((place_of(mesh, hit) - nearest).norm(), 1e-9) << x.transpose();
    }
    EXPECT_GT(outside, 1000);
    const PointLocator::Hit far = locator.find({1e6, -1e6, 1e6});
    check(mesh, far);
    EXPECT_NEAR(far.distance, 1e6 * std::sqrt(3.0), 1);
}

/// In the notch of an L the nearest place is on one of its two inner faces.
TEST(PointLocator, FindsTheNearestPlaceInANotch) {
    TetMesh mesh = test::block({4, 4, 2}, {4, 4, 2});
    std::erase_if(mesh.tets, [&](const Tet& t) {
        Vector3 middle = Vector3::Zero();
        for (const std::int32_t n : t) middle += mesh.nodes[n] / 4;
        return middle.x() > 2 && middle.y() > 2;
    });
    const PointLocator locator(mesh);
    const PointLocator::Hit hit = locator.find({2.3, 3.1, 1.2});
    check(mesh, hit);
    EXPECT_NEAR(hit.distance, 0.3, 1e-12);
    EXPECT_LT((place_of(mesh, hit) - Vector3(2, 3.1, 1.2)).norm(), 1e-12);
}

TEST(PointLocator, RefusesAMeshWithoutTets) {
    const TetMesh empty;
    EXPECT_THROW(PointLocator{empty}, Error);
}

}  // namespace
}  // namespace livetet
