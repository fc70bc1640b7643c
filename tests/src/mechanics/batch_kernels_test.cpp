#include "mechanics/batch_kernels.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>
#include <utility>

#include "mechanics/materials/corotated.hpp"
#include "mechanics/rotation.hpp"
#include "support/element_of.hpp"
#include "support/p1_kernels.hpp"

namespace livetet {
namespace {

using namespace test;

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Nodal = Eigen::Matrix<double, 3, 4>;

Eigen::Map<Vector3d> at(std::vector<double>& values, std::int32_t node) {
    return Eigen::Map<Vector3d>(values.data() + std::ptrdiff_t{3} * node);
}

/// Tets of random corners on shared nodes, each of its own material, with a displacement of each
/// kind asked for.
struct Soup {
    std::vector<std::array<std::int32_t, 4>> tets;
    std::vector<TetElement> elements;
    std::vector<double> u;
    std::mt19937 generator{7};
    std::normal_distribution<double> normal;

    Vector3d random_vector() {
        return Vector3d::NullaryExpr([&] { return normal(generator); });
    }

    /// Moves the corners x of a new tet with nodes of its own to F x + shift.
    void add(const Matrix3d& F) {
        std::array<Vector3d, 4> x;
        do
            for (Vector3d& corner : x) corner = random_vector();
        while ((x[1] - x[0]).dot((x[2] - x[0]).cross(x[3] - x[0])) < 1);
        const Vector3d shift = random_vector();
        const auto first = static_cast<std::int32_t>(u.size() / 3);
        // The nodes in another order than the corners, so that a mix-up shows.
        tets.push_back({first + 2, first, first + 3, first + 1});
        elements.push_back(
            make_element(x, 1 + std::abs(normal(generator)), 1 + std::abs(normal(generator))));
        u.resize(u.size() + 12);
        for (int i = 0; i < 4; ++i) at(u, tets.back()[i]) = F * x[i] + shift - x[i];
    }
    Matrix3d turn() {
        return Eigen::AngleAxisd(3 * normal(generator), random_vector().normalized())
            .toRotationMatrix();
    }
    void add_stretched(const Vector3d& stretches) {
        add(turn() * (turn() * stretches.asDiagonal() * turn()));
    }
    /// Joins the nodes of the second half to those of the first, so that tets share nodes; F is
    /// then anything.
    void share_nodes() {
        const auto nodes = static_cast<std::int32_t>(u.size() / 3);
        for (auto& t : tets)
            for (int i = 0; i < 4; ++i) t[i] = t[i] / 4 * 4 % (nodes / 2) + t[i] % 4;
        u.resize(static_cast<std::size_t>(3) * nodes);
    }
    Nodal nodal(std::size_t e, const std::vector<double>& values) const {
        Nodal n;
        for (int i = 0; i < 4; ++i) n.col(i) = Eigen::Map<const Vector3d>(&values[3 * tets[e][i]]);
        return n;
    }
    Matrix3d F(std::size_t e) const {
        return Matrix3d::Identity() + gradient_of(elements[e], nodal(e, u));
    }
};

Soup shared_soup(int tets) {
    Soup s;
    for (int e = 0; e < tets; ++e) s.add_stretched(Vector3d(1, 1, 1) + 0.2 * s.random_vector());
    s.share_nodes();
    return s;
}

template <class Real>
class BatchKernels : public testing::Test {
  public:
    static constexpr double eps = std::is_same_v<Real, float> ? 1e-6 : 1e-12;

    /// With one number behind the last, as kernels of floats read.
    static std::vector<Real> cast(const std::vector<double>& v) {
        std::vector<Real> values(v.begin(), v.end());
        values.push_back(0);
        return values;
    }
    static Matrix3d rotation(const TetBatches<Real>& batches,
                             const std::vector<RotationBatch<Real>>& r, std::size_t e) {
        std::size_t k = 0;
        while (batches.tet_at(k / batch_width<Real>, k % batch_width<Real>) !=
               static_cast<std::int32_t>(e))
            ++k;
        return rotation_at<Real>(r, k);
    }
    static std::vector<RotationBatch<Real>> rotations(const Soup& s,
                                                      const TetBatches<Real>& batches) {
        auto r = batches.make_rotations();
        update_rotations<Real>(batches, batches.all(), cast(s.u), r);
        return r;
    }
    static double largest(const std::vector<double>& v) {
        return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()))
            .lpNorm<Eigen::Infinity>();
    }
    /// Sums of a few terms of mixed sign, so against the largest number.
    static void expect_equal(const std::vector<Real>& got, const std::vector<double>& expected) {
        ASSERT_EQ(got.size(), expected.size());
        const double tolerance = 3 * eps * largest(expected);
        for (std::size_t k = 0; k < got.size(); ++k)
            ASSERT_NEAR(got[k], expected[k], tolerance) << k;
    }
};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(BatchKernels, Reals);

constexpr int counts[] = {0, 1, 3, 8, 37, 64, 149, 150};

/// One part or three, so that empty lanes stand between tets too.
template <class Real>
TetBatches<Real> in_parts(const Soup& s) {
    return {test::element_of(s.elements), s.tets,
            part_batches(s.tets, s.tets.size() % 2 ? 3 : 1, batch_width<Real>)};
}

TYPED_TEST(BatchKernels, RotationsAreThoseOfRotationOf) {
    for (const int count : counts) {
        Soup s;
        for (int e = 0; e < count; ++e)
            s.add_stretched(Vector3d(1, 1, 1) + 0.2 * s.random_vector());
        const TetBatches<TypeParam> batches(test::element_of(s.elements), s.tets);
        const auto r = this->rotations(s, batches);
        for (int e = 0; e < count; ++e)
            EXPECT_LT((this->rotation(batches, r, e) - rotation_of(s.F(e))).norm(), 4 * this->eps)
                << e << '\n'
                << s.F(e);
    }
}

/// From thin to flat to everted, among ordinary tets: what F loses by rounding is amplified by 1 /
/// (s2 + s3), the two least singular values, the lesser with its sign.
TYPED_TEST(BatchKernels, RotationsOfFlatAndEvertedTetsAreThoseOfRotationOf) {
    Soup s;
    std::vector<double> gap;
    for (double least = 0.6; least > -0.65; least -= 0.02)
        for (const double middle : {1.0, 0.9, 0.7}) {
            s.add_stretched({1.1, middle, least});
            s.add_stretched({1, 1, 1});
            gap.insert(gap.end(), {middle + least, 2.0});
        }
    const TetBatches<TypeParam> batches(test::element_of(s.elements), s.tets);
    const auto r = this->rotations(s, batches);
    for (std::size_t e = 0; e < s.tets.size(); ++e)
        EXPECT_LT((this->rotation(batches, r, e) - rotation_of(s.F(e))).norm(),
                  8 * this->eps / gap[e])
            << e << '\n'
            << s.F(e);
}

/// Noise for F, where the rotation may not be unique: it must be one, and fit as well as
/// rotation_of's.
TYPED_TEST(BatchKernels, RotationsOfAnyTetsAreRotationsAndFitAsWell) {
    Soup s;
    for (int e = 0; e < 3000; ++e) {
        Matrix3d F;
        F << s.random_vector(), s.random_vector(), s.random_vector();
        s.add(F * std::pow(10.0, e % 7 - 3));
    }
    for (const Vector3d& sigma :
         {Vector3d(1, 1, 0), Vector3d(1, 0, 0), Vector3d(0, 0, 0), Vector3d(1, 1, -1),
          Vector3d(1, 1e-7, 1e-7), Vector3d(1e-12, 1e-12, 1e-12), Vector3d(1e12, 1, 1)})
        s.add(sigma.asDiagonal());
    const TetBatches<TypeParam> batches(test::element_of(s.elements), s.tets);
    const auto r = this->rotations(s, batches);
    for (std::size_t e = 0; e < s.tets.size(); ++e) {
        const Matrix3d R = this->rotation(batches, r, e), F = s.F(e);
        ASSERT_LT((R * R.transpose() - Matrix3d::Identity()).norm(), 4 * this->eps) << F;
        ASSERT_GT(R.determinant(), 0) << F;
        const double size =
            F.norm() + Matrix3d::Identity().norm();  // u = F x - x was rounded, not F x
        ASSERT_GT((R.transpose() * F).trace(),
                  (rotation_of(F).transpose() * F).trace() - 20 * this->eps * size)
            << F;
    }
}

TYPED_TEST(BatchKernels, RotationsOfNonFiniteTetsAreTheIdentityAndHarmNoOther) {
    Soup s;
    for (int e = 0; e < 5; ++e) s.add_stretched({1, 0.9, 1.2});
    s.u[3 * s.tets[1][2]] = std::numeric_limits<double>::infinity();
    s.u[3 * s.tets[3][0] + 1] = std::numeric_limits<double>::quiet_NaN();
    const TetBatches<TypeParam> batches(test::element_of(s.elements), s.tets);
    const auto r = this->rotations(s, batches);
    for (const int e : {0, 2, 4})
        EXPECT_LT((this->rotation(batches, r, e) - rotation_of(s.F(e))).norm(), 4 * this->eps);
    for (const int e : {1, 3}) EXPECT_EQ(this->rotation(batches, r, e), Matrix3d::Identity());
}

TYPED_TEST(BatchKernels, ForcesAreThoseOfFirstPiola) {
    for (const int count : counts) {
        const Soup s = shared_soup(count);
        const TetBatches<TypeParam> batches = in_parts<TypeParam>(s);
        const auto r = this->rotations(s, batches);
        std::vector<double> expected(s.u.size(), 0.5);
        for (int e = 0; e < count; ++e) {
            const Nodal f = nodal_forces(
                s.elements[e], first_piola(s.elements[e], this->rotation(batches, r, e), s.F(e)));
            for (int i = 0; i < 4; ++i) at(expected, s.tets[e][i]) += f.col(i);
        }
        std::vector<TypeParam> f(s.u.size(), TypeParam(0.5));  // what stands there stays
        add_forces<TypeParam>(batches, batches.all(), r, this->cast(s.u), f);
        this->expect_equal(f, expected);
    }
}

TYPED_TEST(BatchKernels, ARigidMotionMakesNoForce) {
    Soup s;
    for (int e = 0; e < 21; ++e) s.add(s.turn());
    const TetBatches<TypeParam> batches(test::element_of(s.elements), s.tets);
    std::vector<TypeParam> f(s.u.size());
    add_forces<TypeParam>(batches, batches.all(), this->rotations(s, batches), this->cast(s.u), f);
    for (const TypeParam x : f) EXPECT_NEAR(x, 0, 30 * this->eps);
}

TYPED_TEST(BatchKernels, StiffnessTimesIsThatOfStressIncrement) {
    for (const int count : counts) {
        Soup s = shared_soup(count);
        const TetBatches<TypeParam> batches = in_parts<TypeParam>(s);
        const auto r = this->rotations(s, batches);
        std::vector<double> v(s.u.size()), expected(s.u.size(), -0.5);
        for (double& x : v) x = s.normal(s.generator);
        for (int e = 0; e < count; ++e) {
            const Matrix3d H = gradient_of(s.elements[e], s.nodal(e, v));
            const Nodal f = nodal_forces(
                s.elements[e],
                -0.3 * stress_increment(s.elements[e], this->rotation(batches, r, e), H));
            for (int i = 0; i < 4; ++i) at(expected, s.tets[e][i]) += f.col(i);
        }
        std::vector<TypeParam> f(s.u.size(), TypeParam(-0.5));
        add_stiffness_times<TypeParam>(TypeParam(-0.3), batches, batches.all(), r, this->cast(v),
                                       f);
        this->expect_equal(f, expected);
    }
}

/// Four of five nodes own a row, as on one of several ranks.
BlockPattern pattern_of(const Soup& s) {
    const std::size_t nodes = s.u.size() / 3;
    return {s.tets.size(), 4, nodes, static_cast<std::int32_t>(4 * nodes / 5),
            [&](std::size_t e, int i) { return s.tets[e][i]; }};
}

TYPED_TEST(BatchKernels, AssembledBlocksAreThoseOfStiffnessBlock) {
    for (const int count : counts) {
        const Soup s = shared_soup(count);
        const TetBatches<TypeParam> batches = in_parts<TypeParam>(s);
        const auto r = this->rotations(s, batches);
        const BlockPattern pattern = pattern_of(s);
        std::vector<double> expected[2];
        for (int part = 0; part < 2; ++part) expected[part].assign(9 * pattern.size(part), 2.0);
        for (int e = 0; e < count; ++e) {
            const Nodal h = this->rotation(batches, r, e) * s.elements[e].gradients;
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j) {
                    const std::int32_t row = s.tets[e][i], column = s.tets[e][j];
                    if (row < pattern.owned())
                        Eigen::Map<Matrix3d>(&expected[pattern.part_of(
                            column)][9 * static_cast<std::size_t>(pattern.place(row, column))]) +=
                            0.7 * stiffness_block(s.elements[e], h.col(i), h.col(j));
                }
        }
        for (int part = 0; part < 2; ++part) {
            std::vector<TypeParam> values(expected[part].size(), TypeParam(2));
            assemble<TypeParam>(batches, batches.all(), r, TypeParam(0.7), pattern, values, part);
            this->expect_equal(values, expected[part]);
        }
    }
}

/// Ordinary tets, and some that are flat, inverted or pressed together.
Soup turned_soup(int count) {
    Soup s;
    for (int e = 0; e < count; ++e) s.add_stretched(Vector3d(0.9, 1, 1) + 0.2 * s.random_vector());
    if (count > 8) {
        s.add_stretched({1, 1, 0});
        s.add_stretched({1, 0.9, -0.8});
        s.add_stretched({0.02, 1, 0.02});
    }
    if (count % 2) s.share_nodes();
    return s;
}

/// visit(e, i, j, 0.7 K_ij) of each tet, as Corotated has it.
template <class Visit>
void visit_blocks(const Soup& s, const TetBatches<double>& batches,
                  const std::vector<RotationBatch<double>>& r, Tangent tangent, Visit&& visit) {
    const Corotated corotated;
    for (std::size_t e = 0; e < s.tets.size(); ++e) {
        const Matrix3d H = gradient_of(s.elements[e], s.nodal(e, s.u));
        const Matrix3d R = BatchKernels<double>::rotation(batches, r, e);
        const TetElement& t = s.elements[e];
        ElementMatrix<4> K = ElementMatrix<4>::Zero();
        add_stiffness_of_point(corotated, tangent, 0.7 * t.volume, t.mu, t.lambda,
                               t.lambda * corotated.volume_strain(H, R), H, R, t.gradients, K);
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j) visit(e, i, j, Matrix3d(K.block<3, 3>(3 * i, 3 * j)));
    }
}

/// As Corotated has them. Every block in one of two arrays, as on several ranks.
TEST(BatchKernelsWithTurns, BlocksAreTheSecondDerivativeOfTheEnergy) {
    for (const int count : counts) {
        const Soup s = turned_soup(count);
        const TetBatches<double> batches = in_parts<double>(s);
        const auto r = BatchKernels<double>::rotations(s, batches);
        const BlockPattern pattern = pattern_of(s);
        for (const Tangent tangent : {Tangent::exact, Tangent::positive}) {
            std::vector<double> expected[2], values[2];
            for (int part = 0; part < 2; ++part) {
                expected[part].assign(9 * pattern.size(part), 2.0);
                values[part] = expected[part];
            }
            visit_blocks(
                s, batches, r, tangent, [&](std::size_t e, int i, int j, const Matrix3d& K) {
                    const std::int32_t row = s.tets[e][i], column = s.tets[e][j];
                    if (row >= pattern.owned()) return;
                    auto& blocks = expected[pattern.part_of(column)];
                    Eigen::Map<Matrix3d>(
                        &blocks[9 * static_cast<std::size_t>(pattern.place(row, column))]) += K;
                });
            for (int part = 0; part < 2; ++part) {
                assemble_exact_tangent(batches, batches.all(), r, s.u, tangent, 0.7, pattern,
                                       values[part], part);
                const double tolerance = 1e-11 * BatchKernels<double>::largest(expected[part]);
                for (std::size_t k = 0; k < values[part].size(); ++k)
                    ASSERT_NEAR(values[part][k], expected[part][k], tolerance) << count << ' ' << k;
            }
        }
    }
}

TEST(BatchKernelsWithTurns, ProductsAreThoseOfTheBlocks) {
    for (const int count : counts) {
        Soup s = turned_soup(count);
        const TetBatches<double> batches = in_parts<double>(s);
        const auto r = BatchKernels<double>::rotations(s, batches);
        std::vector<double> v(s.u.size());
        for (double& x : v) x = s.normal(s.generator);
        for (const Tangent tangent : {Tangent::exact, Tangent::positive}) {
            std::vector<double> expected(v.size(), 2.0), f(expected);
            visit_blocks(s, batches, r, tangent,
                         [&](std::size_t e, int i, int j, const Matrix3d& K) {
                             at(expected, s.tets[e][i]) += K * at(v, s.tets[e][j]);
                         });
            add_tangent_times<4>(0.7, batches, batches.all(), r, s.u, tangent, v, f);
            const double tolerance = 1e-11 * BatchKernels<double>::largest(expected);
            for (std::size_t k = 0; k < f.size(); ++k)
                ASSERT_NEAR(f[k], expected[k], tolerance) << count << ' ' << k;
        }
    }
}

TYPED_TEST(BatchKernels, RangesAddUpToTheWhole) {
    const Soup s = shared_soup(261);
    const TetBatches<TypeParam> batches(test::element_of(s.elements), s.tets);
    const auto u = this->cast(s.u);
    const auto [begin, end] = batches.all();
    const BatchRange parts[] = {{begin, 2}, {2, 2}, {2, end}};
    auto r = batches.make_rotations();
    std::vector<TypeParam> whole(u.size()), f(u.size());
    for (const BatchRange part : parts) update_rotations<TypeParam>(batches, part, u, r);
    add_forces<TypeParam>(batches, batches.all(), this->rotations(s, batches), u, whole);
    for (const BatchRange part : parts) add_forces<TypeParam>(batches, part, r, u, f);
    EXPECT_EQ(f, whole);
}

}  // namespace
}  // namespace livetet
