#include "mechanics/scaled_stiffness.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "support/element_of.hpp"
#include "support/p1_kernels.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

/// A bent block of two materials, 1e4 apart, in so many parts.
struct Setting {
    TetMesh mesh = test::block({5, 4, 7}, {0.1, 0.08, 0.14});
    std::vector<TetElement> elements;
    BatchParts parts;
    std::vector<float> u;

    explicit Setting(int count) {
        for (const Tet& t : mesh.tets) {
            const double stiff = mesh.nodes[t[0]].z() > 0.09 ? 1e4 : 1;
            elements.push_back(make_element(
                {mesh.nodes[t[0]], mesh.nodes[t[1]], mesh.nodes[t[2]], mesh.nodes[t[3]]},
                9000 * stiff, 1000 * stiff));
        }
        parts = part_batches(mesh.tets, count, batch_width<float>);
        for (const Vector3& x : mesh.nodes)
            for (const double c : {3 * x.y() * x.z(), -x.y() * x.x(), 5 * x.x() * x.x()})
                u.push_back(static_cast<float>(c));
        u.push_back(0);
    }
};

class ScaledStiffnessOf : public testing::TestWithParam<int> {};

TEST_P(ScaledStiffnessOf, PartsIsTheAssembledStiffness) {
    const Setting s(GetParam());
    const TetBatches<float> batches(test::element_of(s.elements), s.mesh.tets, s.parts);
    auto rotations = batches.make_rotations();
    update_rotations<float>(batches, batches.all(), s.u, rotations);
    const std::size_t nodes = s.mesh.nodes.size();
    ScaledStiffness Q(s.elements, s.mesh.tets, s.parts, nodes);
    for (int turn = 0; turn < 2; ++turn) {  // a second time over what stands
        for (int part = GetParam() - 1; part >= 0; --part) {
            if (part == GetParam() - 1) Q.rotate_later(s.parts.later(), batches, rotations);
            Q.write_part(part, Renewal::whole, batches, rotations);
        }
        const auto rows = Q.rows_of(Renewal::whole);
        ASSERT_EQ(rows.size(), nodes);
        Q.write_rows(rows.first(nodes / 3));
        Q.write_rows(rows.subspan(nodes / 3));
    }

    // The plain assembly
    const BlockPattern pattern(s.mesh.tets, nodes);
    std::vector<float> values(9 * pattern.size(0));
    assemble<float>(batches, batches.all(), rotations, 1, pattern, values);
    const auto expected = [&](std::size_t i, std::size_t j) -> Eigen::Matrix3f {
        const auto place = static_cast<std::size_t>(
            pattern.place(static_cast<std::int32_t>(i), static_cast<std::int32_t>(j)));
        return Eigen::Map<const Eigen::Matrix3f>(&values[9 * place]) /
               (Q.scale()[i] * Q.scale()[j]);
    };

    // Each number within half a step (and float's digits), the sum of a row's blocks zero
    std::vector<float> x(3 * nodes + 1), y(3 * nodes + 1);
    std::mt19937 generator(5);
    for (std::size_t i = 0; i < 3 * nodes; ++i) x[i] = std::normal_distribution<float>()(generator);
    for (std::size_t i = 0; i < nodes; ++i) {
        std::size_t blocks = 0;
        const Eigen::Matrix3f own = Eigen::Map<const Eigen::Matrix3f>(Q.diagonal(i).data());
        Eigen::Vector3f product = own * Eigen::Map<const Eigen::Vector3f>(&x[3 * i]);
        Eigen::Matrix3f sum = own * Q.scale()[i];
        float largest = 0;
        Q.visit_row(i, [&](std::int32_t j, const std::array<std::int16_t, 9>& numbers) {
            const Eigen::Matrix3f block =
                Eigen::Map<const Eigen::Matrix<std::int16_t, 3, 3>>(numbers.data()).cast<float>();
            ASSERT_LE((block - expected(i, j)).cwiseAbs().maxCoeff(), 0.51F) << i << " " << j;
            sum += block * Q.scale()[j];
            product += block * Eigen::Map<const Eigen::Vector3f>(&x[3 * j]);
            largest = std::max(largest, Q.scale()[j]);
            ++blocks;
        });
        EXPECT_GE(blocks, 3U);
        EXPECT_LT(sum.cwiseAbs().maxCoeff(), 0.1F * largest);
        // A soft node beside stiff ones is off by half a step of theirs for each.
        EXPECT_LT((own - expected(i, i)).norm(),
                  (largest > 2 * Q.scale()[i] ? 2e-2F : 5e-4F) * expected(i, i).norm());
        for (int c = 0; c < 3; ++c) y[3 * i + c] = product[c];
    }
    Q.multiply(0, nodes, x.data(), [&](std::size_t i, const auto& Qx) {
        for (int c = 0; c < 3; ++c) EXPECT_NEAR(Qx[c], y[3 * i + c], 1e-6F * 32000 * 14) << i;
    });
}

/// Everything that Q holds.
std::vector<float> numbers_of(ScaledStiffness& Q) {
    std::vector<float> numbers;
    for (std::size_t i = 0; i < Q.nodes(); ++i) {
        for (const float d : Q.diagonal(i)) numbers.push_back(d);
        Q.visit_row(i, [&](std::int32_t, const auto& block) {
            numbers.insert(numbers.end(), block.begin(), block.end());
        });
    }
    return numbers;
}

TEST_P(ScaledStiffnessOf, PartsIsRenewedByHalves) {
    Setting s(GetParam());
    const TetBatches<float> batches(test::element_of(s.elements), s.mesh.tets, s.parts);
    auto rotations = batches.make_rotations();
    ScaledStiffness Q(s.elements, s.mesh.tets, s.parts, s.mesh.nodes.size());
    const auto renew = [&](Renewal renewal) {
        Q.rotate_later(s.parts.later(), batches, rotations);
        for (int part = 0; part < GetParam(); ++part)
            Q.write_part(part, renewal, batches, rotations);
        Q.write_rows(Q.rows_of(renewal));
        return numbers_of(Q);
    };
    const auto at_rest = renew(Renewal::whole);
    update_rotations<float>(batches, batches.all(), s.u, rotations);
    const auto first = renew(Renewal::first_half), both = renew(Renewal::second_half);
    EXPECT_EQ(both, renew(Renewal::whole));
    std::size_t old = 0, renewed = 0;
    for (std::size_t i = 0; i < both.size(); ++i) {
        if (both[i] == at_rest[i]) continue;
        old += first[i] == at_rest[i];
        renewed += first[i] == both[i];
    }
    EXPECT_GT(old, both.size() / 4);
    EXPECT_GT(renewed, both.size() / 4);
}

INSTANTIATE_TEST_SUITE_P(Any, ScaledStiffnessOf, testing::Values(1, 2, 3));

}  // namespace
}  // namespace livetet
