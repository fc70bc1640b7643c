#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "io/hierarchy_file.hpp"
#include "support/program.hpp"

namespace livetet::test {

/// The box of a hierarchy file's finest mesh, mm.
inline Eigen::AlignedBox3d span_of_mesh(const std::filesystem::path& path) {
    const MeshHierarchy hierarchy = read_hierarchy(path);
    Eigen::AlignedBox3d box;
    for (const Vector3& x : hierarchy.levels.front().nodes) box.extend(1e3 * x);
    return box;
}

/// Multigrid with a matrix on its finest level: what meshes are judged by.
inline constexpr const char* as_assembled = "coarse: rediscretised, finest: assembled";

/// Multigrid's iterations to 1e-8 at a Poisson's ratio of 0.45: a hierarchy under its own weight,
/// held at a tenth of its length in x only. `solver`: what else the solver is told, as in a scene.
inline int own_weight_iterations(const Folder& folder, const std::string& mesh,
                                 const std::string& solver) {
    const Eigen::AlignedBox3d box = span_of_mesh(folder / mesh);
    write_text(
        folder / "weight.yaml",
        fmt::format(
            "mesh: {{file: {}}}\nstrain: linear\nmaterials: [{{young_Pa: 3000, poisson: 0.45}}]\n"
            "gravity_m_per_s2: [0, 0, -9.81]\nfix: [{{half_space_mm: [{}, 0, 0, 1, 0, 0]}}]\n"
            "solver: {{kind: multigrid, relative_tolerance: 1e-8, {}}}\noutput: {{file: none}}\n",
            mesh, box.min().x() + 0.1 * box.sizes().x(), solver));
    const auto solved = livetet(folder, "solve weight.yaml --json weight.json");
    EXPECT_EQ(solved.status, 0) << solved.err << solved.out;
    return nlohmann::json::parse(text_of(folder / "weight.json"))["iterations"].get<int>();
}

}  // namespace livetet::test
