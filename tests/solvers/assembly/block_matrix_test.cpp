#include "solvers/assembly/block_matrix.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "solvers/parallel/partition.hpp"
#include "support/ranks.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// A block that depends on its nodes alone, K_ji = K_ij^T.
Eigen::Matrix3d block_of(std::int32_t i, std::int32_t j) {
    Eigen::Matrix3d K;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) K(a, b) = std::sin(1.0 + 3 * i + a) * std::sin(1.0 + 3 * j + b);
    return K;
}

class BlockMatrixTest : public testing::TestWithParam<MatrixLayout> {
  protected:
    BlockMatrixTest() {
        const int ranks = test::rank_count();
        mesh = distribute_mesh(PETSC_COMM_WORLD, whole, partition_tets(whole.tets, ranks));
    }
    void fill_matrix(BlockMatrix& matrix) {
        BlockMatrix::Filling filling(matrix);
        for (std::size_t e = 0; e < mesh.tets.size(); ++e)
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j) {
                    const std::int32_t row = mesh.node(e, i), column = mesh.node(e, j);
                    if (row < mesh.owned)
                        filling.add(row, column, matrix.pattern().place(e, i, j, row, column),
                                    block_of(mesh.nodes[row], mesh.nodes[column]));
                }
        for (std::int32_t i = 0; i < mesh.owned; ++i) filling.add_diagonal(i, 5);
        filling.finish();
    }
    /// y = A x for the same matrix, from the whole mesh's tets, without constraints.
    std::vector<Vector3> expected(const std::vector<Vector3>& x) const {
        std::vector<Vector3> y;
        for (const Vector3& v : x) y.push_back(5 * v);
        for (const Tet& t : whole.tets)
            for (const std::int32_t i : t)
                for (const std::int32_t j : t) y[i] += block_of(i, j) * x[j];
        return y;
    }
    std::vector<Vector3> multiply(const BlockMatrix& matrix, const std::vector<Vector3>& x) const {
        const PetscHandle<Vec> in = make_vector(mesh), out = make_vector(mesh);
        test::fill(mesh, x, in.get());
        LIVETET_PETSC(MatMult(matrix.get(), in.get(), out.get()));
        return test::gather(mesh, out.get());
    }
    std::vector<Vector3> wave() const {
        std::vector<Vector3> x;
        for (std::size_t n = 0; n < whole.nodes.size(); ++n)
            x.push_back({std::cos(1.0 * n), std::cos(2.0 * n), std::cos(3.0 * n)});
        return x;
    }

    const TetMesh whole = test::block({4, 3, 2}, test::beam_size);
    PartitionedMesh mesh;
};

TEST_P(BlockMatrixTest, HoldsWhatIsAddedAndIsFilledAnew) {
    BlockMatrix matrix(mesh, GetParam());
    const std::vector<Vector3> x = wave(), y = expected(x);
    for (int time = 0; time < 2; ++time) {
        fill_matrix(matrix);
        const std::vector<Vector3> got = multiply(matrix, x);
        for (std::size_t n = 0; n < y.size(); ++n) EXPECT_LT((got[n] - y[n]).norm(), 1e-12) << n;
    }
}

TEST_P(BlockMatrixTest, ConstrainedRowsAndColumnsAreThoseOfAMultipleOfTheIdentity) {
    BlockMatrix matrix(mesh, GetParam());
    std::vector<std::uint8_t> components(mesh.nodes.size(), 0);
    const auto held = [](std::int32_t n) -> std::uint8_t {
        return n % 5 == 0 ? 7 : n % 5 == 1 ? 2 : 0;
    };
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) components[i] = held(mesh.nodes[i]);
    matrix.set_constrained(components);
    fill_matrix(matrix);
    const std::vector<Vector3> x = wave();
    std::vector<Vector3> free = x, fixed = x;
    const auto is_held = [&](std::size_t n, int c) {
        return held(static_cast<std::int32_t>(n)) >> c & 1;
    };
    for (std::size_t n = 0; n < x.size(); ++n)
        for (int c = 0; c < 3; ++c) (is_held(n, c) ? free : fixed)[n][c] = 0;
    const std::vector<Vector3> got = multiply(matrix, x), y = expected(free),
                               alone = multiply(matrix, fixed);
    for (std::size_t n = 0; n < x.size(); ++n)
        for (int c = 0; c < 3; ++c) {
            if (is_held(n, c)) {  // a multiple of x there, whatever stands elsewhere
                EXPECT_DOUBLE_EQ(got[n][c], alone[n][c]);
                EXPECT_GT(got[n][c] / x[n][c], 1);
            } else {
                EXPECT_NEAR(got[n][c], y[n][c], 1e-12);
                EXPECT_EQ(alone[n][c], 0);
            }
        }
}

INSTANTIATE_TEST_SUITE_P(, BlockMatrixTest,
                         testing::Values(MatrixLayout::blocks, MatrixLayout::scalars),
                         [](const auto& info) {
                             return info.param == MatrixLayout::blocks ? "blocks" : "scalars";
                         });

}  // namespace
}  // namespace livetet
