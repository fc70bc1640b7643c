#include "apps/verification/reference_models.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>

// Tables marked (T) are rows of reference/closed_forms.txt, made by an independent script.
namespace livetet::verification {
namespace {

constexpr ReferenceModel all[] = {ReferenceModel::linear, ReferenceModel::corotated,
                                  ReferenceModel::green, ReferenceModel::neohookean};

const Matrix3d bent{{1.2, 0.3, -0.1}, {-0.4, 0.8, 0.2}, {0.1, 0.25, 1.1}};
const Matrix3d inverted{{-0.6, 0.3, -0.1}, {-0.4, 0.9, 0.2}, {0.1, 0.25, 1.1}};

TEST(ReferenceModels, PIsTheDerivativeOfPsi) {
    const Isotropic m{2, 0.4};
    for (const ReferenceModel model : all)
        for (const Matrix3d& F : {bent, inverted})
            for (int i = 0; i < 9; ++i) {
                Matrix3d d = Matrix3d::Zero();
                d.data()[i] = 1e-5;
                const double slope =
                    (energy_density(model, m, F + d) - energy_density(model, m, F - d)) / 2e-5;
                EXPECT_NEAR(first_piola(model, m, F).data()[i], slope, 1e-8)
                    << static_cast<int>(model);
            }
}

TEST(ReferenceModels, AllAreHookesLawNearRest) {
    const Isotropic m{2, 0.4};
    const Matrix3d H = 1e-6 * bent;
    const Matrix3d hooke = first_piola(ReferenceModel::linear, m, Matrix3d::Identity() + H);
    for (const ReferenceModel model : all)
        EXPECT_LT((first_piola(model, m, Matrix3d::Identity() + H) - hooke).norm(),
                  1e-4 * hooke.norm());
}

TEST(ReferenceModels, AllButLinearTurnWithTheBody) {
    const Isotropic m{2, 0.4};
    const Matrix3d R = Eigen::AngleAxisd(2.1, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
    for (const ReferenceModel model :
         {ReferenceModel::corotated, ReferenceModel::green, ReferenceModel::neohookean})
        EXPECT_LT((first_piola(model, m, R * bent) - R * first_piola(model, m, bent)).norm(),
                  1e-12);
    EXPECT_GT(first_piola(ReferenceModel::linear, m, R).norm(), 1);
}

TEST(ReferenceModels, UniaxialIsTheTable) {
    struct Row {
        ReferenceModel model;
        double nu, stretch, P11, lateral;
    };
    for (const Row& row : {Row{ReferenceModel::green, 0, 0.5, -0.187500, 1},
                           {ReferenceModel::green, 0.3, 1.5, 0.937500, 0.790569},
                           {ReferenceModel::green, 0.45, 0.6, -0.192000, 1.134901},
                           {ReferenceModel::corotated, 0.3, 2, 1, 0.7},
                           {ReferenceModel::corotated, 0.45, 0.5, -0.5, 1.225}}) {  // (T)
        const auto state = uniaxial(row.model, {1, row.nu}, row.stretch);
        ASSERT_TRUE(state);
        EXPECT_NEAR(state->P11, row.P11, 1e-6);
        EXPECT_NEAR(state->lateral, row.lateral, 1e-6);
    }
    EXPECT_FALSE(uniaxial(ReferenceModel::green, {1, 0.45}, 2));  // (T) none
    EXPECT_FALSE(uniaxial(ReferenceModel::neohookean, {1, 0.3}, 0.28));
}

TEST(ReferenceModels, UniaxialLeavesTheSidesFree) {
    for (const ReferenceModel model : all)
        for (const double nu : {0.0, 0.3, 0.45})
            for (const double l : {0.6, 0.9, 1.2, 1.5}) {
                const auto state = uniaxial(model, {1, nu}, l);
                ASSERT_TRUE(state);
                const Vector3 stretches(l, state->lateral, state->lateral);
                const Matrix3d P = first_piola(model, {1, nu}, stretches.asDiagonal());
                EXPECT_LT((P - Matrix3d(Vector3(state->P11, 0, 0).asDiagonal())).norm(), 1e-12);
            }
}

TEST(ReferenceModels, SimpleShearIsTheTable) {
    const Isotropic m{1, 0.3};
    const Matrix3d green = simple_shear(ReferenceModel::green, m, 0.5),
                   corotated = simple_shear(ReferenceModel::corotated, m, 2);
    EXPECT_NEAR(green(0, 1), 0.276442, 1e-6);  // (T)
    EXPECT_NEAR(green(1, 0), 0.192308, 1e-6);
    EXPECT_NEAR(green(0, 0), 0.168269, 1e-6);
    EXPECT_NEAR(green(2, 2), 0.072115, 1e-6);
    EXPECT_NEAR(corotated(0, 1), 1.332487, 1e-6);
    EXPECT_NEAR(corotated(1, 0), 0.205975, 1e-6);
    EXPECT_NEAR(corotated(1, 1), 0.563256, 1e-6);
    EXPECT_NEAR(corotated(2, 2), 0.477939, 1e-6);
    EXPECT_NEAR(simple_shear(ReferenceModel::neohookean, m, 1)(0, 1), 0.384615, 1e-6);
}

TEST(ReferenceModels, SimpleShearIsPOfItsF) {
    for (const ReferenceModel model : all)
        for (const double g : {-0.5, 0.1, 1.0, 2.0}) {
            Matrix3d F = Matrix3d::Identity();
            F(0, 1) = g;
            const Isotropic m{1, 0.3};
            EXPECT_LT((simple_shear(model, m, g) - first_piola(model, m, F)).norm(), 1e-12) << g;
        }
}

/// St Venant-Kirchhoff in uniaxial model: P11 = (lambda + 2 mu) (l^3 - l) / 2 (T).
TEST(ReferenceModels, ConfinedGreenSoftens) {
    const Isotropic m{1, 0.3};
    for (const double l : {0.4, 0.7, 1.3})
        EXPECT_NEAR(first_piola(ReferenceModel::green, m, Vector3(l, 1, 1).asDiagonal())(0, 0),
                    (m.lambda() + 2 * m.mu()) * (l * l * l - l) / 2, 1e-12);
}

TEST(ManufacturedField, GradientIsItsDerivative) {
    const ManufacturedField field;
    const Vector3 x(0.2, 0.9, 0.4);
    for (int j = 0; j < 3; ++j) {
        const Vector3 d = 1e-5 * Vector3::Unit(j);
        const Vector3 slope = (field.displacement(x + d) - field.displacement(x - d)) / 2e-5;
        EXPECT_LT((field.gradient(x).col(j) - slope).norm(), 1e-10);
    }
    EXPECT_LT(field.gradient(x).norm(), 0.15);
}

TEST(ManufacturedField, BodyForceOfHookesLawIsTheClosedForm) {
    const ManufacturedField field;
    const Isotropic m{3, 0.45};
    for (const Vector3& x : {Vector3(0.2, 0.9, 0.4), Vector3(1, 0, 0.5), Vector3(0.6, 0.1, 1)}) {
        const auto P = [&](const Matrix3d& F) { return first_piola(ReferenceModel::linear, m, F); };
        EXPECT_LT((field.body_force(P, x) - field.linear_body_force(m, x)).norm(), 1e-11);
        EXPECT_GT(field.linear_body_force(m, x).norm(), 0.1);
    }
}

/// Balance of a part: the body force over a cube and the tractions P N on its sides add up to
/// nothing.
TEST(ManufacturedField, BodyForceBalancesTheTractions) {
    const ManufacturedField field;
    const Isotropic m{3, 0.3};
    constexpr double points[] = {-0.7745966692414834, 0, 0.7745966692414834},
                     weights[] = {5.0 / 18, 8.0 / 18, 5.0 / 18};
    for (const ReferenceModel model :
         {ReferenceModel::corotated, ReferenceModel::green, ReferenceModel::neohookean}) {
        const auto P = [&](const Matrix3d& F) { return first_piola(model, m, F); };
        const double h = 0.2;
        const Vector3 centre(0.4, 0.6, 0.5);
        Vector3 sum = Vector3::Zero(), size = Vector3::Zero();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                for (int k = 0; k < 3; ++k) {
                    const Vector3 x = centre + h / 2 * Vector3(points[i], points[j], points[k]);
                    const Vector3 force =
                        h * h * h * weights[i] * weights[j] * weights[k] * field.body_force(P, x);
                    sum += force;
                    size += force.cwiseAbs();
                }
                for (int axis = 0; axis < 3; ++axis)
                    for (const double side : {-1.0, 1.0}) {
                        Vector3 way;
                        way[axis] = side, way[(axis + 1) % 3] = points[i],
                        way[(axis + 2) % 3] = points[j];
                        const Matrix3d H = field.gradient(centre + h / 2 * way);
                        sum += h * h * weights[i] * weights[j] * side *
                               P(Matrix3d::Identity() + H).col(axis);
                    }
            }
        EXPECT_LT(sum.norm(), 1e-6 * size.norm());
    }
}

}  // namespace
}  // namespace livetet::verification
