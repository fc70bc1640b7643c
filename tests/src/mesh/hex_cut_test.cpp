// Cuts of grids of hexahedra: which links break, which nodes double, what hangs together.

#include "mesh/hex_cut.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <deque>
#include <map>
#include <random>
#include <set>

#include "base/error.hpp"
#include "mesh/mesh_pieces.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

std::vector<std::uint8_t> crossed_in(const TetMesh& mesh, const CutSurface& surface) {
    const HexLevel level = hex_level_of(mesh, "grid");
    return crossed_links(level, grid_frame(mesh, level), surface, "cut");
}

TetMesh cut_by(const TetMesh& mesh, const CutSurface& surface) {
    return without_links(mesh, hex_level_of(mesh, "grid"), crossed_in(mesh, surface));
}

/// The cells that hang together by links that are not cut: a flood fill of its own.
std::vector<std::set<std::int32_t>> flooded(const HexLevel& level,
                                            const std::vector<std::uint8_t>& cut) {
    std::vector<std::vector<std::int32_t>> next(level.places.size());
    for (std::size_t l = 0; l < level.links.size(); ++l) {
        if (cut[l]) continue;
        next[level.links[l].lower].push_back(level.links[l].upper);
        next[level.links[l].upper].push_back(level.links[l].lower);
    }
    std::vector<std::set<std::int32_t>> pieces;
    std::vector<bool> seen(next.size(), false);
    for (std::size_t start = 0; start < next.size(); ++start) {
        if (seen[start]) continue;
        std::set<std::int32_t>& piece = pieces.emplace_back();
        std::deque<std::int32_t> front{static_cast<std::int32_t>(start)};
        seen[start] = true;
        while (!front.empty()) {
            const std::int32_t e = front.front();
            front.pop_front();
            piece.insert(e);
            for (const std::int32_t other : next[e])
                if (!seen[other]) seen[other] = true, front.push_back(other);
        }
    }
    return pieces;
}

/// z = h(x, y) over [-1, 9]^2 as triangles, corners at multiples of `step`, each wound at random.
TriangleMesh height_field(double step, const std::function<double(double, double)>& h,
                          std::mt19937& random) {
    TriangleMesh surface;
    const int n = static_cast<int>(std::lround(10 / step));
    for (int j = 0; j <= n; ++j)
        for (int i = 0; i <= n; ++i) {
            const double x = -1 + i * step, y = -1 + j * step;
            surface.nodes.emplace_back(x, y, h(x, y));
        }
    const auto at = [&](int i, int j) { return j * (n + 1) + i; };
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
            for (Triangle t : {Triangle{at(i, j), at(i + 1, j), at(i + 1, j + 1)},
                               Triangle{at(i, j), at(i + 1, j + 1), at(i, j + 1)}}) {
                if (random() & 1) std::swap(t[1], t[2]);
                surface.triangles.push_back(t);
            }
    return surface;
}

TEST(HexCut, APlaneBetweenCellsPartsTheGridThere) {
    const TetMesh mesh = test::hex_grid({6, 4, 3}, {6, 4, 3});
    const TetMesh cut = cut_by(mesh, PlanePatch{{2, 0, 0}, {-3, 0, 0}});
    EXPECT_EQ(cut.nodes.size(), mesh.nodes.size() + 5 * 4);
    EXPECT_EQ(cut.hexahedra.size(), mesh.hexahedra.size());
    const auto pieces = mesh_pieces(cut);
    ASSERT_EQ(pieces.size(), 2U);
    EXPECT_NEAR(pieces[0].volume, 48, 1e-12);
    EXPECT_NEAR(pieces[1].volume, 24, 1e-12);
    EXPECT_LT((pieces[0].centroid - Vector3(4, 2, 1.5)).norm(), 1e-12);
    check_tet_mesh(cut, "cut");
    // The surface has the cut's two sides: what meets a tet mesh's other users sees the gap.
    EXPECT_EQ(boundary_triangles(cut.tets).size(),
              boundary_triangles(mesh.tets).size() + 2U * 2 * 4 * 3);
}

/// Through the centres of cells, along the axes and across: two pieces, no cell between them, for
/// a plane and for triangles, however they are wound.
TEST(HexCut, ASurfaceThroughCentresLeavesNoCellAlone) {
    const TetMesh mesh = test::hex_grid({8, 8, 8}, {8, 8, 8});
    for (const Vector3& normal :
         {Vector3(1, 0, 0), Vector3(0, -1, 0), Vector3(0, 0, 1), Vector3(1, 1, 0),
          Vector3(1, 0, -1), Vector3(1, 1, 1), Vector3(1, -2, 0), Vector3(-1, 2, 3)})
        EXPECT_EQ(mesh_pieces(cut_by(mesh, PlanePatch{{4.5, 4.5, 4.5}, normal})).size(), 2U)
            << normal.transpose();
    std::mt19937 random(1);
    for (const double step : {0.5, 1.0, 2.5, 10.0})
        for (const auto& [a, b] : {std::pair{0, 0}, {1, 0}, {0, -1}, {1, 1}, {-1, 1}, {2, 1}}) {
            const TriangleMesh surface = height_field(
                step, [&](double x, double y) { return 4.5 + a * (x - 4.5) + b * (y - 4.5); },
                random);
            const auto pieces = mesh_pieces(cut_by(mesh, surface));
            EXPECT_EQ(pieces.size(), 2U) << step << ", " << a << ", " << b;
            // Where no centre is on it, triangles cut as their plane does, no link more.
            const TriangleMesh beside = height_field(
                step, [&](double x, double y) { return 4.8 + a * (x - 4.5) + b * (y - 4.5); },
                random);
            EXPECT_EQ(crossed_in(mesh, beside),
                      crossed_in(mesh, PlanePatch{{4.5, 4.5, 4.8}, Vector3(-a, -b, 1)}))
                << step << ", " << a << ", " << b;
        }
}

/// Through the middles of cells, too, where the cut lies on one side of them.
TEST(HexCut, AReversedPlaneCutsTheSame) {
    const TetMesh mesh = test::hex_grid({5, 5, 5}, {5, 5, 5});
    for (const Vector3& normal : {Vector3(1, 0, 0), Vector3(0, 0, 1), Vector3(1, 1, 0),
                                  Vector3(0, -1, 1), Vector3(1, -2, 1)})
        for (const double at : {2.5, 2.2})
            EXPECT_EQ(crossed_in(mesh, PlanePatch{Vector3::Constant(at), normal}),
                      crossed_in(mesh, PlanePatch{Vector3::Constant(at), -normal}))
                << normal.transpose() << " at " << at;
}

/// Corners and edges of triangles on the very lines between centres: each vertical line is crossed
/// once, and no link between what is above and what is below is missed.
TEST(HexCut, ASurfaceOfTrianglesLeavesNoHole) {
    const TetMesh mesh = test::hex_grid({8, 8, 8}, {8, 8, 8});
    const HexLevel level = hex_level_of(mesh, "grid");
    std::mt19937 random(7);
    for (int trial = 0; trial < 200; ++trial) {
        const double step = std::array{0.5, 1.0, 2.0}[trial % 3];
        std::map<std::pair<double, double>, double> heights;
        const auto height = [&](double x, double y) {
            const auto [found, fresh] = heights.try_emplace({x, y}, 0);
            if (fresh) found->second = 1 + 0.5 * static_cast<double>(random() % 13);
            return found->second;
        };
        const TriangleMesh surface = height_field(step, height, random);
        const auto cut = crossed_links(level, grid_frame(mesh, level), surface, "cut");
        // Moved by an infinitely small vector, a centre is above the surface or below: by the
        // parity of the crossings of a vertical line, link by link from the bottom.
        std::map<HexPlace, bool> above;
        std::map<std::pair<HexPlace, int>, bool> is_cut;
        for (std::size_t l = 0; l < level.links.size(); ++l)
            is_cut[{level.places[level.links[l].lower], level.links[l].axis}] = cut[l];
        for (int i = 0; i < 8; ++i)
            for (int j = 0; j < 8; ++j) {
                int crossings = 0;
                for (int k = 0; k < 8; ++k) {
                    above[{i, j, k}] = crossings > 0;
                    if (k < 7) crossings += is_cut[{{i, j, k}, 2}];
                }
                ASSERT_EQ(crossings, 1) << "trial " << trial << ", column " << i << ", " << j;
            }
        for (std::size_t l = 0; l < level.links.size(); ++l) {
            const bool parts = above[level.places[level.links[l].lower]] !=
                               above[level.places[level.links[l].upper]];
            ASSERT_TRUE(cut[l] || !parts) << "trial " << trial << ", link " << l;
        }
    }
}

TEST(HexCut, APatchCutsWithinItsBorder) {
    const TetMesh mesh = test::hex_grid({6, 6, 6}, {6, 6, 6});
    const auto count = [&](const PlanePatch& patch) {
        const auto cut = crossed_in(mesh, patch);
        return std::count(cut.begin(), cut.end(), 1);
    };
    const Vector3 middle(3, 3, 3), up(0, 0, 2);
    EXPECT_EQ(count({middle, up}), 36);
    // Lines between centres are at (+-0.5, +-0.5) from the middle: 0.707 away.
    EXPECT_EQ(count({middle, up, 0.7}), 0);
    EXPECT_EQ(count({middle, up, 0.71}), 4);
    EXPECT_EQ(count({middle, up, 1.6}), 12);
    const auto span = [&](double x, double y) {
        return PlanePatch{middle, up, {}, {{Vector3(x, 0, 0), Vector3(0, y, 0)}}};
    };
    EXPECT_EQ(count(span(2.02, 4.02)), 2 * 4);
    EXPECT_EQ(count(span(0.98, 4.02)), 0);
    // Sheared: from x = y - 0.51 to y + 0.51.
    EXPECT_EQ(count({middle, up, {}, {{Vector3(1.02, 0, 0), Vector3(2.02, 2.02, 0)}}}), 2);
}

/// One broken link does not open anything: its nodes hang together round about.
TEST(HexCut, OneBrokenLinkInsideDoublesNoNode) {
    const TetMesh mesh = test::hex_grid({4, 4, 4}, {4, 4, 4});
    const PlanePatch small{{1.5, 1.5, 2}, {0, 0, 1}, 0.2};
    const auto cut = crossed_in(mesh, small);
    EXPECT_EQ(std::count(cut.begin(), cut.end(), 1), 1);
    const TetMesh same = cut_by(mesh, small);
    EXPECT_EQ(same.nodes.size(), mesh.nodes.size());
    EXPECT_EQ(same.hexahedra, mesh.hexahedra);
    // Four around an edge open that edge's middle node alone.
    EXPECT_EQ(cut_by(mesh, PlanePatch{{2, 2, 2}, {0, 0, 1}, 0.8}).nodes.size(),
              mesh.nodes.size() + 1);
}

TEST(HexCut, NodesKeepTheirNumbersAndSetsTakeTheCopies) {
    TetMesh mesh = test::hex_grid({4, 2, 2}, {4, 2, 2});
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n)
        if (mesh.nodes[n].x() == 2) mesh.node_sets["middle"].push_back(static_cast<int>(n));
    // The faces of the two cells beside the cut, at y = 0.
    for (const Triangle& t : boundary_triangles(mesh.tets))
        if (mesh.nodes[t[0]].y() == 0 && mesh.nodes[t[1]].y() == 0 && mesh.nodes[t[2]].y() == 0)
            mesh.triangle_sets["front"].push_back(t);
    const TetMesh cut = cut_by(mesh, PlanePatch{{2, 0, 0}, {1, 0, 0}});
    for (std::size_t n = 0; n < mesh.nodes.size(); ++n) EXPECT_EQ(cut.nodes[n], mesh.nodes[n]);
    ASSERT_EQ(cut.nodes.size(), mesh.nodes.size() + 9);
    EXPECT_EQ(cut.node_sets.at("middle").size(), 18U);
    for (const std::int32_t n : cut.node_sets.at("middle")) EXPECT_EQ(cut.nodes[n].x(), 2);
    // Each triangle still bounds one tet, of its own side.
    std::set<std::set<std::int32_t>> surface;
    for (const Triangle& t : boundary_triangles(cut.tets)) surface.insert({t.begin(), t.end()});
    ASSERT_EQ(cut.triangle_sets.at("front").size(), mesh.triangle_sets.at("front").size());
    for (const Triangle& t : cut.triangle_sets.at("front"))
        EXPECT_TRUE(surface.contains({t.begin(), t.end()}));
}

TEST(HexCut, LeavesOutCellsWithWhatOnlyTheyHave) {
    TetMesh mesh = test::hex_grid({4, 2, 2}, {4, 2, 2});
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e)
        mesh.regions.insert(mesh.regions.end(), tets_per_hexahedron, static_cast<int>(e));
    mesh.shares[5] = 0.25;
    mesh.node_sets["ends"] = {mesh.hexahedra.front()[0], mesh.hexahedra.back()[7]};
    const TetMesh cut = cut_by(mesh, PlanePatch{{1, 0, 0}, {1, 0, 0}});
    std::vector<std::uint8_t> left_out(cut.hexahedra.size(), 0);
    const auto pieces = mesh_pieces(cut);
    for (const std::int32_t e : pieces.back().cells) left_out[e] = 1;
    const TetMesh rest = without_cells(cut, left_out);
    check_tet_mesh(rest, "rest");
    EXPECT_EQ(rest.nodes.size(), 4U * 3 * 3);
    EXPECT_EQ(rest.hexahedra.size(), 12U);
    EXPECT_NEAR(volume(rest), 12, 1e-12);
    EXPECT_EQ(rest.shares[3], 0.25);
    EXPECT_EQ(rest.regions.front(), 1);
    EXPECT_EQ(rest.regions[3 * tets_per_hexahedron], 5);
    ASSERT_EQ(rest.node_sets.at("ends").size(), 1U);
    EXPECT_EQ(rest.nodes[rest.node_sets.at("ends")[0]], Vector3(4, 2, 2));
}

TEST(HexCut, RefusesSurfacesThatAreNotInItsCoordinates) {
    const TetMesh mesh = test::hex_grid({2, 2, 2}, {2, 2, 2});
    for (const double far : {1e7, -3e6, std::nan("")}) {
        const TriangleMesh surface{{{0, 0, 0}, {1, 0, far}, {0, 1, 0}}, {{0, 1, 2}}};
        EXPECT_THROW((void)crossed_in(mesh, surface), Error) << far;
    }
}

/// A ball without a bite, in whose gap parts are close but apart.
TetMesh bitten_ball(int n) {
    return test::hex_grid({n, n, n}, {1, 1, 1}, [](const Vector3& x) {
        const Vector3 c = 2 * (x - Vector3::Constant(0.5));
        return c.norm() < 1 && !(std::abs(c.x() - 0.05) < 0.13 && c.y() > 0);
    });
}

Vector3 somewhere(std::mt19937& random) {
    std::uniform_real_distribution<double> at(0, 1);
    const double x = at(random), y = at(random), z = at(random);
    return {x, y, z};
}

/// One to three surfaces: planes, discs, rectangles, crumpled triangles.
std::vector<CutSurface> random_cuts(std::mt19937& random) {
    std::vector<CutSurface> cuts;
    for (std::uint32_t i = 0, count = 1 + random() % 3; i < count; ++i) {
        const Vector3 point = somewhere(random),
                      normal = somewhere(random) - Vector3::Constant(0.5);
        switch (random() % 4) {
            case 0:
                cuts.emplace_back(PlanePatch{point, normal});
                break;
            case 1:
                cuts.emplace_back(PlanePatch{point, normal, 0.5 * somewhere(random).x()});
                break;
            case 2: {
                const Vector3 edge = normal.unitOrthogonal();
                cuts.emplace_back(
                    PlanePatch{point, normal, {}, {{edge, normal.cross(edge).normalized()}}});
                break;
            }
            default: {
                TriangleMesh crumpled;
                for (int n = 0; n < 9; ++n) crumpled.nodes.push_back(somewhere(random));
                for (int t = 0; t < 7; ++t) crumpled.triangles.push_back({t, t + 1, t + 2});
                cuts.emplace_back(crumpled);
            }
        }
    }
    return cuts;
}

/// Each cell and its volume stay; the pieces are those of a flood fill over the links left; no
/// level of multigrid's joins two of them, or gives a node two rows of the transfer.
TEST(HexCut, RandomCutsLoseNothingAndJoinNothing) {
    const TetMesh mesh = bitten_ball(10);
    const HexLevel level = hex_level_of(mesh, "grid");
    std::size_t opened = 0, parted = 0;
    for (std::uint32_t seed = 0; seed < 300; ++seed) {
        SCOPED_TRACE(testing::Message() << "seed " << seed);
        std::mt19937 random(seed);
        std::vector<std::uint8_t> cut(level.links.size(), 0);
        for (const CutSurface& surface : random_cuts(random)) {
            const auto crossed = crossed_links(level, grid_frame(mesh, level), surface, "cut");
            for (std::size_t l = 0; l < cut.size(); ++l) cut[l] |= crossed[l];
        }
        const TetMesh made = without_links(mesh, level, cut);
        opened += made.nodes.size() > mesh.nodes.size();
        check_tet_mesh(made, "cut");
        ASSERT_EQ(made.hexahedra.size(), mesh.hexahedra.size());
        EXPECT_NEAR(volume(made), volume(mesh), 1e-12);
        const auto flood = flooded(level, cut);
        const auto pieces = mesh_pieces(made);
        ASSERT_EQ(pieces.size(), flood.size());
        parted += pieces.size() > 1;
        std::set<std::set<std::int32_t>> expected(flood.begin(), flood.end()), found;
        for (const MeshPiece& piece : pieces)
            found.insert({piece.cells.begin(), piece.cells.end()});
        EXPECT_EQ(found, expected);
        std::vector<std::int32_t> piece_of(mesh.hexahedra.size());
        for (std::size_t p = 0; p < pieces.size(); ++p)
            for (const std::int32_t e : pieces[p].cells) piece_of[e] = static_cast<int>(p);
        std::vector<HexLevel> levels = hex_levels(made, 20);
        for (std::size_t l = 0; l + 1 < levels.size(); ++l) {
            std::vector<std::int32_t> coarse(levels[l + 1].places.size(), -1);
            std::map<std::int32_t, std::int32_t> owner;
            for (std::size_t e = 0; e < levels[l].places.size(); ++e) {
                std::int32_t& piece = coarse[levels[l].parents[e]];
                ASSERT_TRUE(piece < 0 || piece == piece_of[e]) << "level " << l + 1;
                piece = piece_of[e];
                for (const std::int32_t n : levels[l + 1].cells[levels[l].parents[e]])
                    ASSERT_EQ(owner.try_emplace(n, piece).first->second, piece);
            }
            piece_of = coarse;
        }
    }
    EXPECT_GT(opened, 150U);
    EXPECT_GT(parted, 50U);
}

/// Lips of a cut that ends inside are apart on each coarser level, too, where a coarse cell does
/// not reach the cut's end.
TEST(HexCut, CoarseLevelsKeepTheLipsOfACutApart) {
    const TetMesh mesh = test::hex_grid({16, 16, 4}, {16, 16, 4});
    // Open from y = 4 to the border, between x = 7 and 8, inside of cells of the next level.
    const TetMesh cut = cut_by(
        mesh, PlanePatch{{7, 10, 2}, {1, 0, 0}, {}, {{Vector3(0, 12, 0), Vector3(0, 0, 5)}}});
    const std::vector<HexLevel> levels = hex_levels(cut, 10);
    ASSERT_GE(levels.size(), 3U);
    for (std::size_t l = 1; l < 3; ++l) {
        std::set<std::int32_t> left, right;
        for (std::size_t e = 0; e < levels[0].places.size(); ++e) {
            if (levels[0].places[e][1] < 8) continue;
            std::int32_t cell = static_cast<std::int32_t>(e);
            for (std::size_t k = 0; k < l; ++k) cell = levels[k].parents[cell];
            auto& side = levels[0].places[e][0] < 7 ? left : right;
            side.insert(levels[l].cells[cell].begin(), levels[l].cells[cell].end());
        }
        for (const std::int32_t n : left) EXPECT_FALSE(right.contains(n)) << "level " << l;
    }
}

/// Cut by cut, with the links of the whole grid: numbers stay, copies are appended, and in the end
/// the same corners are one node as in one cut.
TEST(HexCut, AGridOpenedStepByStepEndsAsOneOpenedAtOnce) {
    const TetMesh whole = test::hex_grid({6, 6, 4}, {6, 6, 4});
    const HexLevel level = hex_level_of(whole, "grid");
    const GridFrame frame = grid_frame(whole, level);
    std::mt19937 random(11);
    std::vector<std::uint8_t> cut(level.links.size(), 0);
    OpenedGrid now{whole};
    for (int step = 0; step < 6; ++step) {
        const TriangleMesh surface = height_field(
            2.5,
            [&](double x, double y) {
                return x + y < 3.0 * step ? 1 + 2 * std::sin(x) + 0.1 * y : -9.0;
            },
            random);
        const auto crossed = crossed_links(level, frame, surface, "cut");
        for (std::size_t l = 0; l < cut.size(); ++l) cut[l] |= crossed[l];
        const TetMesh before = now.mesh;
        now = open_links(before, level, cut);
        check_tet_mesh(now.mesh, "opened");
        ASSERT_EQ(now.mesh.nodes.size(), before.nodes.size() + now.originals.size());
        for (std::size_t k = 0; k < now.originals.size(); ++k) {
            ASSERT_LT(now.originals[k], static_cast<std::int32_t>(before.nodes.size()));
            EXPECT_EQ(now.mesh.nodes[before.nodes.size() + k], before.nodes[now.originals[k]]);
        }
        for (std::size_t e = 0; e < before.hexahedra.size(); ++e)
            for (int c = 0; c < 8; ++c) {
                const std::int32_t n = now.mesh.hexahedra[e][c],
                                   old = static_cast<std::int32_t>(before.nodes.size());
                EXPECT_EQ(n < old ? n : now.originals[n - old], before.hexahedra[e][c]);
            }
    }
    const TetMesh at_once = without_links(whole, level, cut);
    ASSERT_GT(at_once.nodes.size(), whole.nodes.size() + 10);
    ASSERT_EQ(now.mesh.nodes.size(), at_once.nodes.size());
    std::map<std::int32_t, std::int32_t> same;
    for (std::size_t e = 0; e < whole.hexahedra.size(); ++e)
        for (int c = 0; c < 8; ++c)
            EXPECT_EQ(
                same.try_emplace(now.mesh.hexahedra[e][c], at_once.hexahedra[e][c]).first->second,
                at_once.hexahedra[e][c]);
    EXPECT_EQ(same.size(), at_once.nodes.size());
}

}  // namespace
}  // namespace livetet
