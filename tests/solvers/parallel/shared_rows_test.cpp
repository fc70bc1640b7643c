#include "solvers/parallel/shared_rows.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>

#include <optional>

#include "support/ranks.hpp"

namespace livetet {
namespace {

/// Rank r owns r + 1 rows, numbered rank by rank, and uses every row of even number, the last one
/// first.
class SharedRowsTest : public testing::Test {
  protected:
    SharedRowsTest() {
        int rank = 0;
        MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
        owned = static_cast<std::size_t>(rank) + 1;
        first = rank * (rank + 1) / 2;
        const int ranks = test::rank_count();
        for (PetscInt n = ranks * (ranks + 1) / 2 - 1; n >= 0; --n)
            if (n % 2 == 0) used.push_back(n);
        shared.emplace(PETSC_COMM_WORLD, owned, used);
    }
    std::size_t owned = 0;
    PetscInt first = 0;
    std::vector<PetscInt> used;
    std::optional<SharedRows> shared;
};

TEST_F(SharedRowsTest, UsersGetTheOwnersValuesOfAnyType) {
    std::vector<std::uint8_t> bytes;
    std::vector<std::int32_t> numbers;
    std::vector<PetscInt> large;
    std::vector<Eigen::Vector3d> vectors;
    std::vector<double> pairs;
    for (std::size_t i = 0; i < owned; ++i) {
        const auto n = first + static_cast<PetscInt>(i);
        bytes.push_back(static_cast<std::uint8_t>(7 * n));
        numbers.push_back(static_cast<std::int32_t>(-n));
        large.push_back(100000 * n);
        vectors.emplace_back(n, 2.0 * n, 3.0 * n);
        pairs.insert(pairs.end(), {1.0 * n, 0.5 * n});
    }
    const auto b = shared->from_owners<std::uint8_t>(bytes);
    const auto i = shared->from_owners<std::int32_t>(numbers);
    const auto l = shared->from_owners<PetscInt>(large);
    const auto v = shared->from_owners<Eigen::Vector3d>(vectors);
    const auto p = shared->from_owners<double>(pairs, 2);
    for (std::size_t k = 0; k < used.size(); ++k) {
        EXPECT_EQ(b[k], static_cast<std::uint8_t>(7 * used[k]));
        EXPECT_EQ(i[k], -used[k]);
        EXPECT_EQ(l[k], 100000 * used[k]);
        EXPECT_EQ(v[k], Eigen::Vector3d(1, 2, 3) * static_cast<double>(used[k]));
        EXPECT_EQ(p[2 * k + 1], 0.5 * static_cast<double>(used[k]));
    }
}

TEST_F(SharedRowsTest, OwnersGetTheSumOfWhatAllUsersHave) {
    for (const int components : {1, 3}) {
        std::vector<double> of_used;
        for (const PetscInt n : used)
            for (int c = 0; c < components; ++c) of_used.push_back(static_cast<double>(n) + c);
        const std::vector<double> sums = shared->sum_to_owners(of_used, components);
        ASSERT_EQ(sums.size(), owned * static_cast<std::size_t>(components));
        for (std::size_t i = 0; i < owned; ++i)
            for (int c = 0; c < components; ++c) {
                const PetscInt n = first + static_cast<PetscInt>(i);
                EXPECT_EQ(sums[i * static_cast<std::size_t>(components) + c],
                          n % 2 == 0 ? test::rank_count() * static_cast<double>(n + c) : 0)
                    << n;
            }
    }
}

}  // namespace
}  // namespace livetet
