#include "mechanics/materials/constitutive_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>
#include <functional>
#include <random>

#include "mechanics/materials/corotated.hpp"
#include "mechanics/materials/holzapfel_gasser_ogden.hpp"
#include "mechanics/materials/mooney_rivlin.hpp"
#include "mechanics/materials/registry.hpp"
#include "mechanics/rotation.hpp"

// Every registered model, with its default parameters and, where it has some, with others.

namespace livetet {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Vector9 = Eigen::Matrix<double, 9, 1>;
using Model = const ConstitutiveModel&;

constexpr double mu = 1.3, lambda = 2.1;

std::vector<std::unique_ptr<const ConstitutiveModel>> models() {
    std::vector<std::unique_ptr<const ConstitutiveModel>> all;
    for (const ConstitutiveModel* model : registered_materials()) all.push_back(model->clone());
    for (const double share : {0.0, 0.5, 1.0}) {
        MooneyRivlin rubber;
        rubber.c01_share = share;
        all.push_back(rubber.clone());
    }
    HolzapfelGasserOgden tissue;
    tissue.k1_Pa = 0.8;
    tissue.fibre_1 = Vector3d(2, 1, -0.5);
    all.push_back(tissue.clone());
    tissue.dispersion = 0.15;
    tissue.fibre_2 = Vector3d(0.3, -1, 0.4);
    all.push_back(tissue.clone());
    return all;
}

void for_each_model(const std::function<void(Model)>& test) {
    for (const auto& model : models()) {
        SCOPED_TRACE(std::string(model->name()));
        test(*model);
    }
}

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

Matrix3d displacement_gradient(const Matrix3d& F) { return F - Matrix3d::Identity(); }

Matrix3d rotation_for(Model model, const Matrix3d& F) {
    return model.kinematics() == Kinematics::corotated ? rotation_of(F) : Matrix3d::Identity();
}

double energy(Model model, const Matrix3d& F) {
    const Matrix3d R = rotation_for(model, F), H = displacement_gradient(F);
    const double theta = model.volume_strain(H, R);
    return model.shear_energy(mu, H, R) + lambda / 2 * theta * theta;
}

Matrix3d stress(Model model, const Matrix3d& F) {
    const Matrix3d R = rotation_for(model, F), H = displacement_gradient(F);
    return model.stress(mu, lambda * model.volume_strain(H, R), H, R);
}

/// With what p theta adds for the pressure of `F`, as in the displacement form.
Matrix9 tangent(Model model, const Matrix3d& F, Tangent kind) {
    const Matrix3d R = rotation_for(model, F), H = displacement_gradient(F);
    const Matrix3d N = model.volume_strain_gradient(H, R);
    const Eigen::Map<const Vector9> n(N.data());
    return model.shear_tangent(mu, lambda * model.volume_strain(H, R), H, kind) +
           lambda * n * n.transpose();
}

Matrix3d hooke(const Matrix3d& H) {
    const Matrix3d strain = 0.5 * (H + H.transpose());
    return 2 * mu * strain + lambda * strain.trace() * Matrix3d::Identity();
}

/// Central differences at each component of F: visit(component, F + h, F - h, 2 h).
template <class Visit>
void visit_differences(const Matrix3d& F, Visit&& visit) {
    constexpr double h = 1e-6;
    for (int k = 0; k < 9; ++k) {
        Matrix3d forward = F, back = F;
        forward.data()[k] += h;
        back.data()[k] -= h;
        visit(k, forward, back, 2 * h);
    }
}

TEST(ConstitutiveModel, StressIsTheDerivativeOfEnergy) {
    for_each_model([](Model model) {
        for (const Matrix3d& F : gradients()) {
            const Matrix3d P = stress(model, F);
            const double scale = 1 + P.norm() + 1e-3 * tangent(model, F, Tangent::exact).norm();
            visit_differences(
                F, [&](int k, const Matrix3d& forward, const Matrix3d& back, double step) {
                    EXPECT_NEAR(P.data()[k], (energy(model, forward) - energy(model, back)) / step,
                                2e-7 * scale)
                        << F;
                });
        }
    });
}

TEST(ConstitutiveModel, TangentIsTheDerivativeOfStress) {
    for_each_model([](Model model) {
        for (const Matrix3d& F : gradients()) {
            const Vector3d sigma = signed_svd(F).sigma;
            if (model.kinematics() == Kinematics::corotated && sigma[1] + sigma[2] < 0.1)
                continue;  // cut there, as documented
            const Matrix9 A = tangent(model, F, Tangent::exact);
            visit_differences(
                F, [&](int k, const Matrix3d& forward, const Matrix3d& back, double step) {
                    const Matrix3d dP = (stress(model, forward) - stress(model, back)) / step;
                    EXPECT_LT((A.col(k) - Eigen::Map<const Vector9>(dP.data())).norm(),
                              1e-5 * (1 + A.norm()))
                        << F;
                });
        }
    });
}

TEST(ConstitutiveModel, VolumeStrainGradientIsItsDerivative) {
    for_each_model([](Model model) {
        for (const Matrix3d& F : gradients()) {
            const Matrix3d N =
                model.volume_strain_gradient(displacement_gradient(F), rotation_for(model, F));
            const auto theta = [&](const Matrix3d& at) {
                return model.volume_strain(displacement_gradient(at), rotation_for(model, at));
            };
            visit_differences(
                F, [&](int k, const Matrix3d& forward, const Matrix3d& back, double step) {
                    EXPECT_NEAR(N.data()[k], (theta(forward) - theta(back)) / step,
                                2e-7 * (1 + N.norm()));
                });
        }
    });
}

TEST(ConstitutiveModel, IncrementIsTheTangentWhereNoRotationIsHeld) {
    std::mt19937 generator(5);
    for_each_model([&](Model model) {
        if (model.kinematics() == Kinematics::corotated) return;
        for (const Matrix3d& F : gradients()) {
            const Matrix3d dF = random_matrix(generator, 1), H = displacement_gradient(F);
            const Matrix3d dP = model.shear_stress_increment(mu, 0.7, H, Matrix3d::Identity(), dF);
            const Matrix9 A = model.shear_tangent(mu, 0.7, H, Tangent::exact);
            EXPECT_LT(
                (A * Eigen::Map<const Vector9>(dF.data()) - Eigen::Map<const Vector9>(dP.data()))
                    .norm(),
                1e-9 * (1 + A.norm()));
        }
    });
}

TEST(ConstitutiveModel, TangentOfAModelIsTheOneByIncrements) {
    for_each_model([](Model model) {
        if (model.kinematics() == Kinematics::corotated) return;
        for (const Matrix3d& F : gradients()) {
            const Matrix3d H = displacement_gradient(F);
            const Matrix9 exact = model.shear_tangent(mu, -0.9, H, Tangent::exact);
            EXPECT_LT((exact - model.ConstitutiveModel::shear_tangent(mu, -0.9, H, Tangent::exact))
                          .norm(),
                      1e-9 * (1 + exact.norm()));
            if (!model.is_isotropic()) continue;  // whose parts are made positive one by one
            const Matrix9 positive = model.shear_tangent(mu, -0.9, H, Tangent::positive);
            EXPECT_LT(
                (positive - model.ConstitutiveModel::shear_tangent(mu, -0.9, H, Tangent::positive))
                    .norm(),
                1e-9 * (1 + exact.norm()));
        }
    });
}

TEST(ConstitutiveModel, PositiveTangentHasNoNegativeEigenvalueAndIsTheExactOneWhereThatHasNone) {
    for_each_model([](Model model) {
        for (const Matrix3d& F : gradients()) {
            const Matrix9 positive = tangent(model, F, Tangent::positive),
                          exact = tangent(model, F, Tangent::exact);
            const double least = Eigen::SelfAdjointEigenSolver<Matrix9>(positive).eigenvalues()[0];
            EXPECT_GT(least, -1e-9 * positive.norm());
            EXPECT_LT((positive - positive.transpose()).norm(), 1e-12 * positive.norm());
            if (!model.is_isotropic()) continue;  // whose parts are made positive one by one
            const Matrix3d R = rotation_for(model, F), H = displacement_gradient(F);
            const Matrix9 shear =
                model.shear_tangent(mu, lambda * model.volume_strain(H, R), H, Tangent::exact);
            if (Eigen::SelfAdjointEigenSolver<Matrix9>(shear).eigenvalues()[0] > 0) {
                EXPECT_LT((positive - exact).norm(), 1e-9 * exact.norm());
            }
        }
    });
}

TEST(ConstitutiveModel, RestHasNeitherEnergyNorStress) {
    for_each_model([](Model model) {
        const Matrix3d zero = Matrix3d::Zero(), I = Matrix3d::Identity();
        EXPECT_EQ(model.shear_energy(mu, zero, I), 0);
        EXPECT_EQ(model.shear_stress(mu, zero, I).norm(), 0);
        EXPECT_EQ(model.volume_strain(zero, I), 0);
        for (const Matrix3d& F : gradients()) EXPECT_GE(energy(model, F), 0) << F;
    });
}

TEST(ConstitutiveModel, IsotropicOnesAgreeWithHookesLawAtRestToTheLastDigits) {
    std::mt19937 generator(6);
    const Matrix3d direction = random_matrix(generator, 1);
    for_each_model([&](Model model) {
        if (!model.is_isotropic()) return;
        const Matrix3d small = 1e-7 * direction, tiny = 1e-12 * direction;
        EXPECT_LT((stress(model, Matrix3d::Identity() + small) - hooke(small)).norm(),
                  1e-5 * hooke(small).norm());
        if (model.kinematics() == Kinematics::corotated) return;  // R is not taken from H
        const Matrix3d I = Matrix3d::Identity();
        EXPECT_LT(
            (model.stress(mu, lambda * model.volume_strain(tiny, I), tiny, I) - hooke(tiny)).norm(),
            1e-10 * hooke(tiny).norm());
    });
}

TEST(ConstitutiveModel, AllButSmallStrainAreIndifferentToRotation) {
    const Matrix3d R = Eigen::AngleAxisd(2.5, Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
    for_each_model([&](Model model) {
        const bool small_strain = model.kinematics() == Kinematics::small_strain;
        if (small_strain) {
            EXPECT_GT(energy(model, R), 1);
        }
        for (const Matrix3d& F : gradients()) {
            if (small_strain) break;
            EXPECT_NEAR(energy(model, R * F), energy(model, F), 1e-10 * (1 + energy(model, F)));
            EXPECT_LT((stress(model, R * F) - R * stress(model, F)).norm(),
                      1e-9 * (1 + stress(model, F).norm()));
        }
    });
}

TEST(ConstitutiveModel, IsotropicOnesAreIndifferentToTheDirectionOfTheMaterial) {
    const Matrix3d R =
        Eigen::AngleAxisd(1.1, Vector3d(0.2, 1, 0.6).normalized()).toRotationMatrix();
    for_each_model([&](Model model) {
        double largest = 0;
        for (const Matrix3d& F : gradients())
            largest = std::max(largest,
                               std::abs(energy(model, R * F * R.transpose()) - energy(model, F)) /
                                   (1 + energy(model, F)));
        if (model.is_isotropic()) {
            EXPECT_LT(largest, 1e-10);
        } else {
            EXPECT_GT(largest, 1e-2);
        }
    });
}

TEST(ConstitutiveModel, CollapsedAndInvertedElementsHaveFiniteForcesThatOpenThem) {
    for_each_model([](Model model) {
        for (const double s : {0.0, -0.3, -1.0, -30.0})
            for (const int axis : {0, 2}) {
                Vector3d stretches = Vector3d::Ones();
                stretches[axis] = s;
                const Matrix3d F = stretches.asDiagonal(), P = stress(model, F);
                ASSERT_TRUE(std::isfinite(energy(model, F)));
                ASSERT_TRUE(P.allFinite());
                ASSERT_TRUE(tangent(model, F, Tangent::positive).allFinite());
                ASSERT_TRUE(tangent(model, F, Tangent::exact).allFinite());
                if (s > -1 && model.resists_collapse()) {
                    EXPECT_LT(P(axis, axis), 0) << "energy falls as the element opens";
                }
            }
    });
}

TEST(ConstitutiveModel, AnElementDrawnOutAThousandTimesHasFiniteForces) {
    for_each_model([](Model model) {
        const Matrix3d F = Vector3d(1000, 1000, 1000).asDiagonal();
        EXPECT_TRUE(std::isfinite(energy(model, F)));
        EXPECT_TRUE(stress(model, F).allFinite());
        EXPECT_TRUE(tangent(model, F, Tangent::positive).allFinite());
    });
}

}  // namespace
}  // namespace livetet
