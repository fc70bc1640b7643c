#include "mechanics/materials/holzapfel_gasser_ogden.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>

#include "mechanics/materials/neohookean.hpp"

namespace livetet {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Matrix3d no_rotation = Matrix3d::Identity();
constexpr double matrix_mu = 3000;

Matrix3d stretched(double x, double y, double z) { return Vector3d(x, y, z).asDiagonal(); }

Matrix3d fibre_stress(const HolzapfelGasserOgden& tissue, const Matrix3d& F) {
    return tissue.shear_stress(matrix_mu, F - no_rotation, no_rotation) -
           NeoHookean().shear_stress(matrix_mu, F - no_rotation, no_rotation);
}

/// Along the fibre, without dispersion: P11 = 2 l k1 E exp(k2 E^2), E = l^2 - 1.
TEST(HolzapfelGasserOgden, FibresPullAlongTheirDirection) {
    const HolzapfelGasserOgden tissue;
    for (const double l : {1.01, 1.3, 1.8}) {
        const Matrix3d P = fibre_stress(tissue, stretched(l, 0.8, 1.1));
        const double E = l * l - 1;
        const double expected = 2 * l * tissue.k1_Pa * E * std::exp(tissue.k2 * E * E);
        EXPECT_NEAR(P(0, 0), expected, 1e-12 * expected);
        EXPECT_LT((P - Matrix3d(stretched(P(0, 0), 0, 0))).norm(), 1e-9);
    }
}

TEST(HolzapfelGasserOgden, FibresCarryNoCompression) {
    const HolzapfelGasserOgden tissue;
    for (const double l : {0.99, 0.5, 0.0, -0.9}) {
        const Matrix3d F = stretched(l, 1.4, 1.2);
        EXPECT_EQ(fibre_stress(tissue, F).norm(), 0);
        EXPECT_EQ(tissue.shear_energy(matrix_mu, F - no_rotation, no_rotation),
                  NeoHookean().shear_energy(matrix_mu, F - no_rotation, no_rotation));
    }
}

/// With kappa = 1/3 E is (I1 - 3) / 3 whatever the fibres' direction.
TEST(HolzapfelGasserOgden, FullDispersionIsIsotropic) {
    HolzapfelGasserOgden along_x, along_z;
    along_x.dispersion = along_z.dispersion = 1.0 / 3;
    along_z.fibre_1 = Vector3d(0, 0, 5);
    const Matrix3d F{{1.2, 0.3, -0.1}, {-0.4, 0.9, 0.2}, {0.1, 0.25, 1.1}};
    const double E = (F.squaredNorm() - 3) / 3;
    EXPECT_LT((fibre_stress(along_x, F) - fibre_stress(along_z, F)).norm(), 1e-9);
    EXPECT_NEAR(along_x.shear_energy(matrix_mu, F - no_rotation, no_rotation) -
                    NeoHookean().shear_energy(matrix_mu, F - no_rotation, no_rotation),
                along_x.k1_Pa / (2 * along_x.k2) * std::expm1(along_x.k2 * E * E), 1e-9);
}

TEST(HolzapfelGasserOgden, TwoFamiliesAddUp) {
    HolzapfelGasserOgden both, first, second;
    first.fibre_1 = both.fibre_1 = Vector3d(1, 0.5, 0);
    second.fibre_1 = Vector3d(1, -0.5, 0.2);
    both.fibre_2 = second.fibre_1;
    const Matrix3d F{{1.4, 0.3, -0.1}, {-0.1, 0.9, 0.2}, {0.1, 0.25, 1.1}};
    const Matrix3d of_first = fibre_stress(first, F), of_second = fibre_stress(second, F);
    EXPECT_GT(of_first.norm(), 100);
    EXPECT_GT(of_second.norm(), 100);
    EXPECT_LT((fibre_stress(both, F) - of_first - of_second).norm(), 1e-9);
}

/// Where k2 E^2 = 10 the exponential ends: energy, stress and stiffness go on from there.
TEST(HolzapfelGasserOgden, EnergyIsSmoothWhereTheExponentialEnds) {
    const HolzapfelGasserOgden tissue;
    const double end = std::sqrt(1 + std::sqrt(10 / tissue.k2)), h = 1e-9;
    const Matrix3d below = stretched(end - h, 1, 1) - no_rotation,
                   above = stretched(end + h, 1, 1) - no_rotation;
    const auto expect_near = [](double a, double b) { EXPECT_NEAR(a, b, 1e-6 * std::abs(a)); };
    expect_near(tissue.shear_energy(matrix_mu, below, no_rotation),
                tissue.shear_energy(matrix_mu, above, no_rotation));
    expect_near(tissue.shear_stress(matrix_mu, below, no_rotation)(0, 0),
                tissue.shear_stress(matrix_mu, above, no_rotation)(0, 0));
    expect_near(tissue.shear_tangent(matrix_mu, 0, below, Tangent::exact)(0, 0),
                tissue.shear_tangent(matrix_mu, 0, above, Tangent::exact)(0, 0));
}

}  // namespace
}  // namespace livetet
