#include "mechanics/materials/mooney_rivlin.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>

#include "mechanics/materials/neohookean.hpp"

namespace livetet {
namespace {

using Eigen::Matrix3d;

const Matrix3d identity_matrix = Matrix3d::Identity();
const Matrix3d bent{{1.2, 0.3, -0.1}, {-0.4, 0.8, 0.2}, {0.1, 0.25, 1.1}};

/// Mooney's energy is c10 (I1 - 3) + c01 (I2 - 3), 2 (c10 + c01) = mu, where the volume is kept.
TEST(MooneyRivlin, IsMooneysEnergyWhereTheVolumeIsKept) {
    const Matrix3d F = bent / std::cbrt(bent.determinant()), C = F.transpose() * F;
    const double I1 = C.trace(), I2 = (I1 * I1 - (C * C).trace()) / 2;
    for (const double share : {0.0, 0.3, 1.0}) {
        MooneyRivlin rubber;
        rubber.c01_share = share;
        EXPECT_NEAR(rubber.shear_energy(4, F - identity_matrix, identity_matrix),
                    2 * (1 - share) * (I1 - 3) + 2 * share * (I2 - 3), 1e-13);
    }
}

TEST(MooneyRivlin, WithoutItsSecondConstantIsNeoHookean) {
    MooneyRivlin rubber;
    rubber.c01_share = 0;
    EXPECT_NEAR(rubber.shear_energy(4, bent - identity_matrix, identity_matrix),
                NeoHookean().shear_energy(4, bent - identity_matrix, identity_matrix), 1e-13);
    EXPECT_LT((rubber.shear_stress(4, bent - identity_matrix, identity_matrix) -
               NeoHookean().shear_stress(4, bent - identity_matrix, identity_matrix))
                  .norm(),
              1e-13);
}

}  // namespace
}  // namespace livetet
