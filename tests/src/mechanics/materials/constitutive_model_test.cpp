#include "mechanics/materials/constitutive_model.hpp"

#include <gtest/gtest.h>

#include <random>

namespace livetet {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double mu = 1.3, lambda = 2.1;
constexpr StrainModel models[] = {StrainModel::linear, StrainModel::corotated, StrainModel::green,
                                  StrainModel::neohookean};

Matrix3d random_matrix(std::mt19937& generator, double size) {
    std::normal_distribution<double> normal;
    return Matrix3d::NullaryExpr([&] { return size * normal(generator); });
}

/// Deformation gradients near rest, far from it, flat and inverted.
std::vector<Matrix3d> gradients() {
    std::mt19937 generator(4);
    std::vector<Matrix3d> all;
    for (const double size : {0.05, 0.3, 1.0})
        for (int i = 0; i < 20; ++i)
            all.push_back(Matrix3d::Identity() + random_matrix(generator, size));
    return all;
}

template <class Energy>
Matrix3d rotation_for(const Energy&, StrainModel model, const Matrix3d& F) {
    return model == StrainModel::corotated ? rotation_of(F) : Matrix3d::Identity();
}

double energy(StrainModel model, const Matrix3d& F) {
    return with_energy(model, [&](auto e) {
        const Matrix3d R = rotation_for(e, model, F);
        const Matrix3d H = F - Matrix3d::Identity();
        const double theta = e.volume_strain(H, R);
        return e.shear_energy(mu, H, R) + lambda / 2 * theta * theta;
    });
}

Matrix3d stress(StrainModel model, const Matrix3d& F) {
    return with_energy(model, [&](auto e) {
        const Matrix3d R = rotation_for(e, model, F);
        const Matrix3d H = F - Matrix3d::Identity();
        return e.stress(mu, lambda * e.volume_strain(H, R), H, R);
    });
}

Matrix9 tangent(StrainModel model, const Matrix3d& F, Tangent kind) {
    return with_energy(model, [&](auto e) {
        const Matrix3d R = rotation_for(e, model, F), H = F - Matrix3d::Identity();
        const Matrix3d N = e.volume_strain_gradient(H, R);
        const Eigen::Map<const Eigen::Matrix<double, 9, 1>> n(N.data());
        return Matrix9(e.shear_tangent(mu, lambda * e.volume_strain(H, R), H, kind) +
                       lambda * n * n.transpose());
    });
}

TEST(StrainEnergy, StressIsItsDerivative) {
    for (const StrainModel model : models)
        for (const Matrix3d& F : gradients()) {
            const Matrix3d P = stress(model, F);
            for (int k = 0; k < 9; ++k) {
                const double h = 1e-6;
                Matrix3d forward = F, back = F;
                forward.data()[k] += h;
                back.data()[k] -= h;
                EXPECT_NEAR(P.data()[k], (energy(model, forward) - energy(model, back)) / (2 * h),
                            2e-7 * (1 + P.norm()))
                    << static_cast<int>(model);
            }
        }
}

TEST(StrainEnergy, TangentIsTheDerivativeOfStress) {
    for (const StrainModel model : models)
        for (const Matrix3d& F : gradients()) {
            const Vector3d sigma = signed_svd(F).sigma;
            if (model == StrainModel::corotated && sigma[1] + sigma[2] < 0.1)
                continue;  // cut there, as documented
            const Matrix9 A = tangent(model, F, Tangent::exact);
            for (int k = 0; k < 9; ++k) {
                const double h = 1e-6;
                Matrix3d forward = F, back = F;
                forward.data()[k] += h;
                back.data()[k] -= h;
                const Matrix3d dP = (stress(model, forward) - stress(model, back)) / (2 * h);
                EXPECT_LT(
                    (A.col(k) - Eigen::Map<const Eigen::Matrix<double, 9, 1>>(dP.data())).norm(),
                    1e-5 * (1 + A.norm()))
                    << static_cast<int>(model) << "\n"
                    << F;
            }
        }
}

TEST(StrainEnergy, IncrementIsTheTangentWhereThereIsNoRotationToHold) {
    std::mt19937 generator(5);
    for (const StrainModel model :
         {StrainModel::linear, StrainModel::green, StrainModel::neohookean})
        for (const Matrix3d& F : gradients()) {
            const Matrix3d dF = random_matrix(generator, 1), H = F - Matrix3d::Identity();
            with_energy(model, [&](auto e) {
                const Matrix3d dP = e.shear_stress_increment(mu, 0.7, H, Matrix3d::Identity(), dF);
                const Matrix9 A = e.shear_tangent(mu, 0.7, H, Tangent::exact);
                EXPECT_LT((A * Eigen::Map<const Eigen::Matrix<double, 9, 1>>(dF.data()) -
                           Eigen::Map<const Eigen::Matrix<double, 9, 1>>(dP.data()))
                              .norm(),
                          1e-9 * (1 + A.norm()));
            });
        }
}

TEST(StrainEnergy, PositiveTangentHasNoNegativeEigenvalueAndIsTheExactOneWhereThatHasNone) {
    for (const StrainModel model : models)
        for (const Matrix3d& F : gradients()) {
            const Matrix9 positive = tangent(model, F, Tangent::positive),
                          exact = tangent(model, F, Tangent::exact);
            const double least = Eigen::SelfAdjointEigenSolver<Matrix9>(positive).eigenvalues()[0];
            EXPECT_GT(least, -1e-9 * positive.norm()) << static_cast<int>(model);
            EXPECT_LT((positive - positive.transpose()).norm(), 1e-12 * positive.norm());
            with_energy(model, [&](auto e) {
                const Matrix3d R = rotation_for(e, model, F), H = F - Matrix3d::Identity();
                const Matrix9 shear =
                    e.shear_tangent(mu, lambda * e.volume_strain(H, R), H, Tangent::exact);
                if (Eigen::SelfAdjointEigenSolver<Matrix9>(shear).eigenvalues()[0] > 0) {
                    EXPECT_LT((positive - exact).norm(), 1e-9 * exact.norm());
                }
            });
        }
}

TEST(StrainEnergy, AgreesWithHookesLawAtRest) {
    std::mt19937 generator(6);
    const Matrix3d H = random_matrix(generator, 1e-7);
    const Matrix3d strain = 0.5 * (H + H.transpose());
    const Matrix3d expected = 2 * mu * strain + lambda * strain.trace() * Matrix3d::Identity();
    for (const StrainModel model : models)
        EXPECT_LT((stress(model, Matrix3d::Identity() + H) - expected).norm(),
                  1e-5 * expected.norm());
}

TEST(StrainEnergy, KeepsTheDigitsOfSmallStrains) {
    std::mt19937 generator(8);
    const Matrix3d H = random_matrix(generator, 1e-12);
    const Matrix3d strain = 0.5 * (H + H.transpose());
    const Matrix3d expected = 2 * mu * strain + lambda * strain.trace() * Matrix3d::Identity();
    for (const StrainModel model :
         {StrainModel::linear, StrainModel::green, StrainModel::neohookean})
        with_energy(model, [&](auto e) {
            const Matrix3d I = Matrix3d::Identity();
            EXPECT_LT((e.stress(mu, lambda * e.volume_strain(H, I), H, I) - expected).norm(),
                      1e-10 * expected.norm());
        });
}

TEST(StrainEnergy, KnowsNoDifferenceBetweenABodyAndTheSameBodyTurned) {
    const Matrix3d R = Eigen::AngleAxisd(2.5, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
    for (const StrainModel model :
         {StrainModel::corotated, StrainModel::green, StrainModel::neohookean})
        for (const Matrix3d& F : gradients()) {
            EXPECT_NEAR(energy(model, R * F), energy(model, F), 1e-10 * (1 + energy(model, F)));
            EXPECT_LT((stress(model, R * F) - R * stress(model, F)).norm(),
                      1e-9 * (1 + stress(model, F).norm()));
        }
}

TEST(StrainEnergy, CollapsedAndInvertedElementsHaveFiniteForcesThatOpenThem) {
    for (const StrainModel model : {StrainModel::corotated, StrainModel::neohookean})
        for (const double s : {0.0, -0.3, -1.0}) {
            const Matrix3d F = Vector3d(1, 1, s).asDiagonal();
            const Matrix3d P = stress(model, F);
            ASSERT_TRUE(P.allFinite());
            ASSERT_TRUE(tangent(model, F, Tangent::positive).allFinite());
            ASSERT_TRUE(tangent(model, F, Tangent::exact).allFinite());
            if (s > -1) {
                EXPECT_LT(P(2, 2), 0) << "energy falls as the element opens";
            }
        }
}

}  // namespace
}  // namespace livetet
