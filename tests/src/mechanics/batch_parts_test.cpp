#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>

#include "base/thread_team.hpp"
#include "mechanics/batch_kernels.hpp"
#include "support/element_of.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

std::vector<std::int32_t> tets_in(const BatchParts& parts, BatchRange range, int width) {
    std::vector<std::int32_t> tets(
        parts.tet_of_lane.begin() + static_cast<std::ptrdiff_t>(range.begin * width),
        parts.tet_of_lane.begin() + static_cast<std::ptrdiff_t>(range.end * width));
    std::erase(tets, -1);
    return tets;
}

/// What threads rely on: every tet in one lane, and no node in two parts of a round.
void expect_sound(const std::vector<Tet>& tets, int parts, int width, const BatchParts& cut) {
    ASSERT_EQ(cut.tet_of_lane.size() % width, 0);
    ASSERT_EQ(cut.rounds.front().size(), parts);
    std::size_t end = 0;
    for (const auto& round : cut.rounds)
        for (const BatchRange range : round) {
            ASSERT_EQ(range.begin, end);
            end = range.end;
            ASSERT_LE(end * width, cut.tet_of_lane.size());
            EXPECT_GT(tets_in(cut, range, width).size() + width, (range.end - range.begin) * width)
                << "an empty batch";
        }
    ASSERT_EQ(end * width, cut.tet_of_lane.size());
    EXPECT_EQ(cut.later().begin, cut.rounds.front().back().end);
    EXPECT_EQ(cut.later().end, end);

    std::vector<int> lanes(tets.size());
    for (const std::int32_t e : cut.tet_of_lane)
        if (e != -1) ++lanes.at(e);
    EXPECT_EQ(lanes, std::vector<int>(tets.size(), 1));

    for (const auto& round : cut.rounds) {
        std::map<std::int32_t, std::size_t> part_of_node;
        for (std::size_t p = 0; p < round.size(); ++p)
            for (const std::int32_t e : tets_in(cut, round[p], width))
                for (const std::int32_t n : tets[e])
                    ASSERT_EQ(part_of_node.try_emplace(n, p).first->second, p) << n;
    }
}

TEST(PartBatches, PutEachTetInOneLaneAndNoNodeInTwoPartsOfARound) {
    TetMesh mesh = test::block({5, 4, 13}, {1, 1, 1});
    std::mt19937 generator(3);
    for (const bool ordered : {true, false}) {  // what is sound does not hang on the order
        if (!ordered) std::shuffle(mesh.tets.begin(), mesh.tets.end(), generator);
        for (const int parts : {1, 2, 3, 5})
            for (const int width : {4, 8}) {
                SCOPED_TRACE(testing::Message()
                             << parts << " parts, width " << width << ", ordered " << ordered);
                expect_sound(mesh.tets, parts, width, part_batches(mesh.tets, parts, width));
            }
    }
}

/// Cuts through a cube cost so much (a sixth of it for two parts, half for four) that the parts are
/// even only where the cuts allow for it.
TEST(PartBatches, AreOfEvenSizeAndFewTetsWait) {
    const TetMesh mesh = test::block({10, 10, 12}, {1, 1, 1});
    const std::size_t slice = mesh.tets.size() / 12;
    for (const int parts : {2, 3, 4})
        for (const int width : {4, 8}) {
            const BatchParts cut = part_batches(mesh.tets, parts, width);
            std::vector<std::size_t> sizes;
            for (const BatchRange part : cut.rounds.front())
                sizes.push_back(tets_in(cut, part, width).size());
            const auto [least, most] = std::minmax_element(sizes.begin(), sizes.end());
            EXPECT_LT(static_cast<double>(*most), 1.15 * static_cast<double>(*least)) << parts;
            // A cut inside of a slice touches the rest of it and the row after it.
            EXPECT_LT(static_cast<double>(tets_in(cut, cut.later(), width).size()),
                      1.2 * (parts - 1) * static_cast<double>(slice))
                << parts;
        }
}

TEST(PartBatches, OnePartIsAllTetsInTheirOrder) {
    const TetMesh mesh = test::block({3, 3, 3}, {1, 1, 1});
    const BatchParts cut = part_batches(mesh.tets, 1, 8);
    std::vector<std::int32_t> expected(mesh.tets.size());
    std::iota(expected.begin(), expected.end(), 0);
    expected.resize(168, -1);  // 162 tets
    EXPECT_EQ(cut.tet_of_lane, expected);
    ASSERT_EQ(cut.rounds.size(), 1);
    ASSERT_EQ(cut.rounds[0].size(), 1);
    EXPECT_EQ(cut.rounds[0][0].begin, 0);
    EXPECT_EQ(cut.rounds[0][0].end, 21);
}

TEST(PartBatches, NoTetsMakeEmptyParts) {
    for (const int parts : {1, 3}) {
        expect_sound({}, parts, 8, part_batches(std::vector<Tet>{}, parts, 8));
        EXPECT_EQ(TetBatches<float>({}, {}, part_batches(std::vector<Tet>{}, parts, 8)).all().end,
                  0);
    }
}

TEST(PartBatches, MayBeMoreThanThereAreTets) {
    const std::vector<Tet> one{{5, 2, 3, 1}}, joined{{0, 1, 2, 3}, {1, 2, 3, 4}, {2, 3, 4, 5}},
        apart{{0, 1, 2, 3}, {4, 5, 6, 7}, {8, 9, 10, 11}};
    for (const auto& tets : {one, joined, apart})
        for (const int parts : {4, 5, 8})
            expect_sound(tets, parts, 4, part_batches(tets, parts, 4));
    const BatchParts cut = part_batches(apart, 5, 4);
    EXPECT_EQ(cut.rounds.size(), 1) << "no node is in two tets, so none need wait";
}

TEST(PartBatches, TetsAreFoundInTheirLanes) {
    const TetMesh mesh = test::block({5, 4, 13}, {1, 1, 1});
    const BatchParts cut = part_batches(mesh.tets, 3, batch_width<float>);
    std::vector<TetElement> elements;
    for (const Tet& t : mesh.tets)
        elements.push_back(make_element(
            {mesh.nodes[t[0]], mesh.nodes[t[1]], mesh.nodes[t[2]], mesh.nodes[t[3]]}, 2, 3));
    const TetBatches<float> batches(test::element_of(elements), mesh.tets, cut);
    int empty = 0;
    for (std::size_t k = 0; k < cut.tet_of_lane.size(); ++k) {
        const std::size_t batch = k / batch_width<float>, lane = k % batch_width<float>;
        const std::int32_t e = batches.tet_at(batch, lane);
        ASSERT_EQ(e, cut.tet_of_lane[k]);
        empty += e == -1;
        ASSERT_EQ(batches[batch].mu[lane] > 0, e >= 0);
        if (e < 0) continue;
        for (int i = 0; i < 4; ++i) ASSERT_EQ(batches[batch].offset[i][lane], 3 * mesh.tets[e][i]);
    }
    EXPECT_GT(empty, 0);
}

/// A bent block whose tets differ in material, so that sums in another order round to other
/// numbers.
struct Block {
    TetMesh mesh = test::block({7, 7, 8}, {0.1, 0.1, 0.1});
    std::vector<TetElement> elements;
    std::vector<double> u;
    BlockPattern pattern{mesh.tets, mesh.nodes.size()};

    Block() {
        std::mt19937 generator(5);
        std::uniform_real_distribution<double> about_one(0.5, 1.5);
        for (const Vector3& x : mesh.nodes)
            for (const double a : {x.y() * x.z(), -x.y() * x.x(), 5 * x.x() * x.x()})
                u.push_back(a * about_one(generator));
        for (const Tet& t : mesh.tets)
            elements.push_back(make_element(
                {mesh.nodes[t[0]], mesh.nodes[t[1]], mesh.nodes[t[2]], mesh.nodes[t[3]]},
                9000 * about_one(generator), 1000 * about_one(generator)));
    }
};

template <class Real>
class PartsOnThreads : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(PartsOnThreads, Reals);

/// To the last bit: each number's terms are added in the same order, whichever thread is first.
TYPED_TEST(PartsOnThreads, WorkedOnByThreadsAtOnceGiveWhatOneThreadGives) {
    using Real = TypeParam;
    const Block block;
    std::vector<Real> u(block.u.begin(), block.u.end());
    u.push_back(0);  // kernels of floats read one number behind the last
    const BatchParts cut = part_batches(block.mesh.tets, 6, batch_width<Real>);
    ASSERT_GT(cut.rounds.size(), 2);
    const TetBatches<Real> batches(test::element_of(block.elements), block.mesh.tets, cut);
    for (const int threads : {2, 3}) {
        ThreadTeam team(threads);
        auto rotations = batches.make_rotations();
        update_rotations<Real>(batches, batches.all(), u, rotations);
        const auto forces = [&](BatchRange range, std::vector<Real>& f) {
            add_forces<Real>(batches, range, rotations, u, f);
            add_stiffness_times<Real>(Real(0.3), batches, range, rotations, u, f);
        };
        const auto matrix = [&](BatchRange range, std::vector<Real>& values) {
            assemble<Real>(batches, range, rotations, Real(0.7), block.pattern, values);
        };
        const auto in_parts = [&](auto& kernel, std::size_t size) {
            std::vector<Real> result(size);
            for (const auto& round : cut.rounds)
                team.run_tasks(round.size(), [&](std::size_t p) { kernel(round[p], result); });
            return result;
        };
        std::vector<Real> f(u.size()), values(9 * block.pattern.size(0));
        for (const auto& round : cut.rounds)
            for (const BatchRange part : round) forces(part, f);
        matrix(batches.all(), values);
        for (int k = 0; k < 200; ++k) {
            ASSERT_EQ(in_parts(forces, f.size()), f) << threads << " threads, time " << k;
            ASSERT_EQ(in_parts(matrix, values.size()), values) << threads << " threads, time " << k;
        }
    }
}

}  // namespace
}  // namespace livetet
