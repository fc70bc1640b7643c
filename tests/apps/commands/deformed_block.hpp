#pragma once

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <string>
#include <vector>

#include "io/hierarchy_file.hpp"
#include "io/points_csv.hpp"
#include "io/result_file.hpp"
#include "mesh/quadratic.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet::test {

inline void write_points(const std::filesystem::path& path, const std::vector<Vector3>& points) {
    std::vector<NamedPoint> named;
    for (const Vector3& c : points) named.push_back({fmt::format("P{}", named.size() + 1), c});
    write_points_csv(path, named);
}

/// A block of 80 x 80 x 40 mm that is held below. The truth is neo-Hookean on a finer mesh, and
/// pulled about the middle of its top; the scene's material is corotated with another Poisson's
/// ratio.
struct DeformedBlock {
    Folder folder;
    TetMesh fine = block({14, 14, 7}, {0.08, 0.08, 0.04});
    std::vector<Vector3> truth;  ///< displacement of the fine mesh

    explicit DeformedBlock(const Vector3& pull_N = {0.3, 0.2, 1.2}) {
        write_hierarchy(folder / "fine.h5", make_hierarchy({fine}, "finer"));
        write_hierarchy(folder / "block.h5",
                        make_hierarchy({block({9, 9, 5}, {0.08, 0.08, 0.04})}, "the model"));
        write_text(folder / "truth.yaml",
                   fmt::format("mesh: {{file: fine.h5}}\nstrain: neohookean\n"
                               "materials: [{{young_Pa: 3000, poisson: 0.45}}]\n"
                               "fix: [{{half_space_mm: [0, 0, 1, 0, 0, 1]}}]\n"
                               "loads: [{{sphere_mm: [40, 40, 40, 20], where: surface, force_N: "
                               "[{}, {}, {}]}}]\noutput: {{file: truth.h5}}\n",
                               pull_N.x(), pull_N.y(), pull_N.z()));
        const auto solved = livetet(folder, "solve truth.yaml");
        EXPECT_EQ(solved.status, 0) << solved.err;
        truth = ResultReader(folder / "truth.h5").displacement(0);
        write_scene("");
    }
    void write_scene(const std::string& deform) const {
        write_text(folder / "scene.yaml",
                   "mesh: {file: block.h5}\nmaterials: [{young_Pa: 3000, poisson: 0.4}]\n"
                   "fix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}]\n"
                   "deform:\n  forces: [{sphere_mm: [40, 40, 40, 22], pattern: uniform}]\n"
                   "  point_error_mm: 0.5\n"
                   "  targets: [{name: Middle, point_mm: [40, 40, 20]}]\n" +
                       deform);
    }
    /// Points in the middle of every triangle of the deformed top and sides.
    std::vector<Vector3> points() const {
        std::vector<Vector3> found;
        for (const Triangle& t : boundary_triangles(fine.tets)) {
            Vector3 rest = Vector3::Zero(), moved = Vector3::Zero();
            for (const std::int32_t n : t) {
                rest += fine.nodes[n] / 3;
                moved += (fine.nodes[n] + truth[n]) / 3;
            }
            if (rest.z() > 1e-3) found.push_back(moved);
        }
        return found;
    }
    Vector3 true_place(const Vector3& rest) const {
        return rest + PointSampler(fine, std::vector{rest}).sample(0, truth);
    }
    Vector3 found_place(const Vector3& rest) const {
        const ResultReader result(folder / "result.h5");
        return rest +
               PointSampler(result.mesh(), std::vector{rest}).sample(0, result.displacement(0));
    }
    Outcome run(const std::string& options = "") const {
        return livetet(folder,
                       "register --deform scene.yaml --surface-points points.csv " + options);
    }
};

inline const Vector3 middle(0.04, 0.04, 0.02);  // of the block

}  // namespace livetet::test
