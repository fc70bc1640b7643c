// The motion of a body whose cut opens.

#include "mesh/body_motion.hpp"

#include <gtest/gtest.h>

#include "mesh/hex_cut.hpp"
#include "support/hex_grids.hpp"

namespace livetet {
namespace {

/// A rind lies around the body, at rest and deformed, but not between the two sides of a cut.
TEST(BodyMotion, HasNoRindInTheGapOfACut) {
    const TetMesh whole = test::hex_grid({4, 2, 2}, {4, 2, 2});
    const HexLevel level = hex_level_of(whole, "grid");
    const TetMesh mesh = without_links(
        whole, level,
        crossed_links(level, grid_frame(whole, level), PlanePatch{{2, 0, 0}, {1, 0, 0}}, "cut"));
    std::vector<Vector3> apart(mesh.nodes.size(), Vector3::Zero());
    for (std::size_t e = 0; e < mesh.hexahedra.size(); ++e)
        for (const std::int32_t n : mesh.hexahedra[e])
            if (level.places[e][0] >= 2) apart[n].x() = 1;
    const BodyMotion motion = body_motion(mesh, apart, 0.25);
    // Three tets for each triangle of the outer surface: as many as of the body without a cut.
    EXPECT_EQ(motion.tets.size() - motion.own, 3 * boundary_triangles(whole.tets).size());
    for (std::size_t t = motion.own; t < motion.tets.size(); ++t) {
        Vector3 middle = Vector3::Zero();
        for (const std::int32_t n : motion.tets[t]) middle += motion.deformed[n] / 4;
        const bool in_gap = middle.x() > 2 && middle.x() < 3 && middle.y() > 0 && middle.y() < 2 &&
                            middle.z() > 0 && middle.z() < 2;
        EXPECT_FALSE(in_gap) << middle.transpose();
    }
}

}  // namespace
}  // namespace livetet
