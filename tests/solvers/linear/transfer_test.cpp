#include "solvers/linear/transfer.hpp"

#include <gtest/gtest.h>

#include <numeric>
#include <optional>

#include "mechanics/rigid_motions.hpp"
#include "mesh/refine.hpp"
#include "solvers/linear/coarse_body.hpp"
#include "solvers/parallel/partition.hpp"
#include "support/shapes.hpp"
#include "support/whole_mesh.hpp"

namespace livetet {
namespace {

/// The rows of the nodes that this rank owns.
BarycentricMap own_rows_of(const BarycentricMap& whole, const PartitionedMesh& share) {
    BarycentricMap own;
    for (std::int32_t i = 0; i < share.owned; ++i) {
        own.nodes.push_back(whole.nodes[share.nodes[i]]);
        own.weights.push_back(whole.weights[share.nodes[i]]);
    }
    return own;
}

/// Two levels on all ranks, and what of the coarse one is constrained.
struct TwoLevels {
    explicit TwoLevels(std::vector<TetMesh> meshes)
        : hierarchy(make_hierarchy(std::move(meshes), "")) {
        const auto parts = partition_levels(PETSC_COMM_WORLD, hierarchy, Partitioner::metis);
        for (std::size_t l = 0; l < 2; ++l)
            shares.push_back(distribute_mesh(PETSC_COMM_WORLD, hierarchy.levels[l], parts[l]));
        transfer = own_rows_of(hierarchy.transfers[0], shares[0]);
        rows.emplace(shares[1], transfer);
        const LevelPieces pieces = level_pieces(shares[1]);
        body.emplace(pieces,
                     pieces_joined_by(PETSC_COMM_WORLD, level_pieces(shares[0]), pieces, *rows),
                     shares[1]);
    }
    const TetMesh& fine() const { return hierarchy.levels[0]; }
    const TetMesh& coarse() const { return hierarchy.levels[1]; }
    /// Of the whole coarse mesh, for those of the whole fine mesh.
    std::vector<std::uint8_t> constrained(const std::vector<std::uint8_t>& held) const {
        const auto own = body->constrained(*rows, local_part<std::uint8_t>(shares[0], held));
        std::vector<std::uint8_t> whole(coarse().nodes.size(), 0);
        for (std::size_t i = 0; i < own.size(); ++i) whole[shares[1].nodes[i]] = own[i];
        MPI_Allreduce(MPI_IN_PLACE, whole.data(), static_cast<int>(whole.size()), MPI_UINT8_T,
                      MPI_MAX, PETSC_COMM_WORLD);
        return whole;
    }
    MeshHierarchy hierarchy;
    std::vector<PartitionedMesh> shares;
    BarycentricMap transfer;
    std::optional<TransferRows> rows;
    std::optional<CoarseBody> body;
};

double total(const std::vector<double>& volumes) {
    return std::accumulate(volumes.begin(), volumes.end(), 0.0);
}

std::vector<double> tet_volumes(const TetMesh& mesh) {
    std::vector<double> volumes;
    for (const Tet& t : mesh.tets) volumes.push_back(signed_volume(mesh, t));
    return volumes;
}

/// Of the coarse tets, on one rank.
std::vector<double> carried_volumes(const MeshHierarchy& h) {
    const PartitionedMesh fine = distribute_mesh(PETSC_COMM_SELF, h.levels[0], {}),
                          coarse = distribute_mesh(PETSC_COMM_SELF, h.levels[1], {});
    return livetet::carried_volumes(nodal_volumes(fine), TransferRows(coarse, h.transfers[0]),
                                    coarse);
}

TEST(CarriedVolumes, OfNestedLevelsTheTotalAndInsideEveryTetsOwn) {
    const MeshHierarchy h = make_hierarchy(
        {test::block({16, 8, 8}, test::beam_size), test::block({8, 4, 4}, test::beam_size)}, "");
    const auto carried = carried_volumes(h);
    const auto own = tet_volumes(h.levels[1]);
    EXPECT_NEAR(total(carried), total(own), 0.02 * total(own));
    for (std::size_t e = 0; e < own.size(); ++e) EXPECT_NEAR(carried[e], own[e], 0.5 * own[e]) << e;
}

/// A coarse mesh that covers four fifths of the body in each direction: its outer tets carry what
/// lies outside.
TEST(CarriedVolumes, OfABodyThatTheCoarseMeshDoesNotCover) {
    TetMesh coarse = test::block({8, 4, 4}, 0.8 * test::beam_size);
    for (Vector3& x : coarse.nodes) x += 0.1 * test::beam_size;
    const MeshHierarchy h = make_hierarchy({test::block({16, 8, 8}, test::beam_size), coarse}, "");
    const auto own = tet_volumes(coarse), carried = carried_volumes(h);
    EXPECT_LT(total(own), 0.52 * test::beam_size.prod());
    EXPECT_NEAR(total(carried), test::beam_size.prod(), 0.15 * test::beam_size.prod());
    double inside = 0, outside = 0;  // ratios, of the tet in the middle and of one at a corner
    for (std::size_t e = 0; e < own.size(); ++e) {
        Vector3 x = Vector3::Zero();
        for (const std::int32_t n : coarse.tets[e]) x += coarse.nodes[n] / 4;
        const double from_middle = (x - test::beam_size / 2)
                                       .cwiseQuotient(0.4 * test::beam_size)
                                       .lpNorm<Eigen::Infinity>();
        if (from_middle < 0.3) inside = std::max(inside, carried[e] / own[e]);
        if (from_middle > 0.7) outside = std::max(outside, carried[e] / own[e]);
    }
    EXPECT_LT(inside, 1.3);
    EXPECT_GT(outside, 2);
}

/// On every number of ranks, between levels that were meshed each on its own and between one and
/// what it was cut from.
TEST(Transfer, LinearFieldsGoDownAndConstantsUp) {
    const MeshHierarchy h = with_refined_levels(
        make_hierarchy(
            {test::block({8, 4, 4}, test::beam_size), test::block({5, 3, 3}, test::beam_size)}, ""),
        1);
    const auto parts = partition_levels(PETSC_COMM_WORLD, h, Partitioner::metis);
    std::vector<PartitionedMesh> shares;
    for (std::size_t l = 0; l < h.levels.size(); ++l)
        shares.push_back(distribute_mesh(PETSC_COMM_WORLD, h.levels[l], parts[l]));
    const auto linear = [](const Vector3& x) {
        return Vector3(0.1 + x.y() - 2 * x.z(), 3 * x.x(), x.sum());
    };
    for (std::size_t l = 0; l + 1 < h.levels.size(); ++l) {
        const BarycentricMap own = own_rows_of(h.transfers[l], shares[l]);
        const TransferRows rows(shares[l + 1], own);
        Transfer transfer(shares[l], shares[l + 1], rows);
        transfer.set_constrained(shares[l], std::vector<std::uint8_t>(shares[l].owned, 0),
                                 std::vector<std::uint8_t>(shares[l + 1].owned, 0));
        const PetscHandle<Vec> fine = make_vector(shares[l]), coarse = make_vector(shares[l + 1]);
        std::vector<Vector3> values;
        for (const Vector3& x : h.levels[l + 1].nodes) values.push_back(linear(x));
        test::fill(shares[l + 1], values, coarse.get());
        LIVETET_PETSC(MatMult(transfer.interpolation(), coarse.get(), fine.get()));
        const std::vector<Vector3> found = test::gather(shares[l], fine.get());
        for (std::size_t n = 0; n < found.size(); ++n)
            EXPECT_LT((found[n] - linear(h.levels[l].nodes[n])).norm(), 1e-12) << n;
        test::fill(shares[l], std::vector<Vector3>(h.levels[l].nodes.size(), Vector3(1, -2, 3)),
                   fine.get());
        transfer.restrict_displacement(fine.get(), coarse.get());
        for (const Vector3& u : test::gather(shares[l + 1], coarse.get()))
            EXPECT_LT((u - Vector3(1, -2, 3)).norm(), 1e-12);
    }
}

/// Two blocks apart from each other, one held at a face, the other by a patch that is small on the
/// coarse mesh.
TEST(CoarseBody, EachPieceThatTheFineNodesHoldIsHeld) {
    const auto two_blocks = [](std::array<int, 3> cells) {
        TetMesh mesh = test::block(cells, test::beam_size);
        const TetMesh other = mesh;
        const auto count = static_cast<std::int32_t>(mesh.nodes.size());
        for (const Vector3& x : other.nodes) mesh.nodes.push_back(x + Vector3(0.5, 0, 0));
        for (Tet t : other.tets) {
            for (std::int32_t& n : t) n += count;
            mesh.tets.push_back(t);
        }
        return mesh;
    };
    const TwoLevels levels({two_blocks({16, 8, 8}), two_blocks({2, 1, 1})});
    const auto held_by = [&](double radius_m) {
        std::vector<std::uint8_t> held;
        for (const Vector3& x : levels.fine().nodes)
            held.push_back(x.x() < 1e-9 || (x - Vector3(0.56, 0.04, 0)).norm() < radius_m ? 7 : 0);
        return held;
    };
    for (const double radius_m : {0.014, 0.02, 0.04}) {
        ASSERT_TRUE(free_rigid_motions(levels.fine(), held_by(radius_m)).empty()) << radius_m;
        EXPECT_TRUE(
            free_rigid_motions(levels.coarse(), levels.constrained(held_by(radius_m))).empty())
            << radius_m;
    }
    // What is free in the fine mesh is free in the coarse one.
    const auto none = levels.constrained(held_by(0)), face = levels.constrained(held_by(0.04));
    const std::size_t half = none.size() / 2;
    for (std::size_t n = 0; n < none.size(); ++n) {
        if (n >= half) {
            EXPECT_EQ(none[n], 0) << n;
        } else {
            EXPECT_EQ(none[n], face[n]) << n;
            EXPECT_EQ(none[n], levels.coarse().nodes[n].x() < 1e-9 ? 7 : 0) << n;
        }
    }
}

/// A block whose middle the coarse mesh lacks: two pieces of it, the far one without a held node.
TEST(CoarseBody, APieceThatOnlyTheFineMeshJoinsToWhatIsHeldIsHeld) {
    TetMesh coarse = test::block({6, 2, 2}, {0.3, 0.1, 0.1});
    std::erase_if(coarse.tets, [&](const Tet& t) {
        return std::any_of(t.begin(), t.end(), [&](std::int32_t n) {
            return std::abs(coarse.nodes[n].x() - 0.15) < 0.01;
        });
    });
    drop_unused_nodes(coarse);
    const TwoLevels levels({test::block({12, 4, 4}, {0.3, 0.1, 0.1}), coarse});
    ASSERT_EQ(levels.body->wholes().size(), 2u);
    std::vector<std::uint8_t> end, none(levels.fine().nodes.size(), 0);
    for (const Vector3& x : levels.fine().nodes) end.push_back(x.x() < 1e-9 ? 7 : 0);
    const auto held = levels.constrained(end), free = levels.constrained(none);
    EXPECT_TRUE(free_rigid_motions(levels.coarse(), held).empty());
    std::size_t pinned = 0;
    for (std::size_t n = 0; n < held.size(); ++n) {
        pinned += levels.coarse().nodes[n].x() > 0.15 && held[n] != 0;
        EXPECT_EQ(free[n], 0) << n;
    }
    EXPECT_EQ(pinned, 4u);
}

}  // namespace
}  // namespace livetet
