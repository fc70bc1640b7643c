#pragma once

#include <functional>

#include "apps/live/error_statement.hpp"
#include "mesh/hierarchy.hpp"
#include "support/shapes.hpp"
#include "tracking/poses.hpp"

namespace livetet::test {

/// A block of 80 x 80 x 60 mm on a table, two targets in it, and a patch in the middle of its top.
struct StatedBlock {
    MeshHierarchy hierarchy =
        make_hierarchy({block({8, 8, 6}, {0.08, 0.08, 0.06}), block({4, 4, 3}, {0.08, 0.08, 0.06}),
                        block({2, 2, 2}, {0.08, 0.08, 0.06})},
                       "a block");
    std::vector<Vector3> places{{0.041, 0.038, 0.045}, {0.055, 0.04, 0.03}};
    Scene scene;

    StatedBlock() {
        FixOptions& table = scene.fix.emplace_back();
        table.half_space_mm = {0, 0, 0.1, 0, 0, 1};
        scene.time.scheme = TimeScheme::newmark;
        scene.solver.threads = 1;
        scene.materials = {{.young_Pa = 3000, .poisson = {0.45, 0.02}}};
        scene.track.emplace();
        for (std::size_t i = 0; i < places.size(); ++i) {
            TargetOptions& target = scene.track->targets.emplace_back();
            target.name = i == 0 ? "Near" : "Far";
            target.point_mm = 1e3 * places[i];
        }
    }
    const TetMesh& mesh() const { return hierarchy.levels.front(); }

    static Vector3 sensor_place() { return {0.041, 0.039, 0.06}; }
    /// Follows poses of a sensor at rest, relative to a reference; places the patch.
    void place(SensorPatch& patch, const std::function<void(double time_s)>& follow) const {
        for (double time_s = 0; !patch.awaits_placement() && time_s < 5; time_s += 0.025)
            follow(time_s);
        const std::vector<Vector3> still(mesh().nodes.size(), Vector3::Zero());
        patch.place(mesh(), surface_nodes(mesh()), still, 0.02);
    }
};

}  // namespace livetet::test
