// The shipped program with a blade: a cut made while it tracks is recorded, reported, warped,
// followed by probes and replayed; and what blades are refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/commands/tracked_block.hpp"
#include "base/file.hpp"
#include "io/image_file.hpp"
#include "io/tip_file.hpp"
#include "mesh/hex_grid.hpp"
#include "support/hex_grids.hpp"
#include "support/shapes.hpp"
#include "tracking/poses.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::largest;
using test::livetet;
using test::Tracked;
using test::write_text;

constexpr std::size_t loaded_nodes = 21U * 11 * 11;
constexpr const char* scalpel =
    "smoothing_Hz: 0, "
    "tools: [{tool: Scalpel, tip: tip.json, blade_mm: [0, -70, 0, 0, 70, 0]}]";

/// The tracked block as a grid of 2,000 cells of 10 mm, and an image of it. While the sensor rests,
/// a scalpel goes down through the plane x = 64 mm to 31 mm above the table.
struct CutWhileTracked : Tracked {
    CutWhileTracked() {
        write_hierarchy(folder / "block.h5",
                        make_hierarchy({test::hex_grid({20, 10, 10}, {0.2, 0.1, 0.1})}, "a grid"));
        ToolTip tip{.tool = "Scalpel", .pivot = {}, .spin = {}};
        tip.pivot.tool_from_tip.translation = {0.01, 0.02, -0.12};
        write_tip(folder / "tip.json", tip);
        write_text(folder / "probes.csv",
                   "name,x_mm,y_mm,z_mm\nbefore,59,50,99\nbehind,61,50,99\n");
        GreyImage image{{110, 60, 60}, Eigen::Matrix4d::Identity(), {}};
        image.ras_from_voxel.topLeftCorner<3, 3>() *= 2e-3;
        image.ras_from_voxel.col(3) << -9e-3, -9e-3, -9e-3, 1;
        image.values.assign(image.size[0] * image.size[1] * image.size[2], 100);
        write_image(folder / "grey.nii.gz", image);
        tracker.position_rms_mm = tracker.rotation_rms_deg = 0;
        tracker.rest_s = 4;
        set_track(scalpel);
        add("probes: {points: probes.csv, displacements: moved.csv}\nimage: grey.nii.gz\n");
        record();
        add_scalpel(tip.pivot.tool_from_tip.translation);
    }
    void add(const std::string& keys) {
        write_text(folder / "scene.yaml", read_text_file(folder / "scene.yaml") + keys);
    }

  private:
    void add_scalpel(const Vector3& tip_in_tool) {
        recording.tools.emplace_back("Scalpel");
        for (TrackerSample& sample : recording.samples) {
            const double way = (sample.time_s - 2) / 1.5;  // from 2 to 3.5 s
            const Vector3 tip(0.064, 0.05, 0.12 - std::clamp(way, 0.0, 1.0) * 0.089);
            const RigidTransform<ImageFrame, Tool> image_from_scalpel{Eigen::Matrix3d::Identity(),
                                                                      tip - tip_in_tool};
            sample.poses.push_back(
                pose_of(true_tracker_from_image(tracker, sample.time_s) * image_from_scalpel));
        }
    }
};

/// Displacements of a table of probes, mm: time_s,name,x_mm,y_mm,z_mm,ux_mm,uy_mm,uz_mm.
std::map<std::string, std::vector<Vector3>> probe_displacements(const std::string& table) {
    std::map<std::string, std::vector<Vector3>> of_probe;
    std::istringstream lines(table);
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
        std::vector<std::string> cells;
        std::istringstream stream(line);
        for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
        if (cells.size() == 8)
            of_probe[cells[1]].emplace_back(std::stod(cells[5]), std::stod(cells[6]),
                                            std::stod(cells[7]));
    }
    return of_probe;
}

/// The widest gap between a node that was added and others at its place at rest, m.
double widest_gap(const ResultReader& result, std::size_t frame) {
    const TetMesh& mesh = result.mesh();
    const std::size_t loaded_nodes = result.first_mesh().nodes.size();
    const auto u = result.displacement(frame);
    double widest = 0;
    for (std::size_t n = loaded_nodes; n < u.size(); ++n)
        for (std::size_t m = 0; m < loaded_nodes; ++m)
            if (mesh.nodes[m] == mesh.nodes[n]) widest = std::max(widest, (u[n] - u[m]).norm());
    return widest;
}

std::size_t deepest_frame(const ResultReader& result) {
    std::size_t deepest = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k)
        if (result.values("press_mm", k, 1)[0] > result.values("press_mm", deepest, 1)[0])
            deepest = k;
    return deepest;
}

/// Before the cut and at rest its sides lie on each other; pressed, they part, and a probe on
/// either side goes with its side.
void expect_parted(const CutWhileTracked& t, const ResultReader& result) {
    EXPECT_EQ(widest_gap(result, 5), 0);
    EXPECT_GT(widest_gap(result, deepest_frame(result)), 3e-4);
    EXPECT_EQ(largest(result.displacement(5)), 0);
    const auto moved = probe_displacements(read_text_file(t.folder / "moved.csv"));
    ASSERT_EQ(moved.at("before").size(), result.frame_count());
    ASSERT_EQ(moved.at("behind").size(), result.frame_count());
    double most_apart = 0;
    for (std::size_t k = 0; k < result.frame_count(); ++k)
        most_apart = std::max(most_apart, (moved.at("before")[k] - moved.at("behind")[k]).norm());
    EXPECT_GT(most_apart, 0.2) << "mm";
}

void expect_warped_and_replayed(const CutWhileTracked& t, const ResultReader& result) {
    const auto warp = livetet(t.folder, fmt::format("warp result.h5 --frame {} -o warped.nii.gz "
                                                    "--empty -1",
                                                    deepest_frame(result) + 1));
    EXPECT_EQ(warp.status, 0) << warp.err;
    EXPECT_EQ(livetet(t.folder, "report result.h5").status, 0);
    const auto replay = livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(replay.status, 0) << replay.out;
    EXPECT_NE(replay.out.find(fmt::format("{0} of {0} frames are the same", result.frame_count())),
              std::string::npos)
        << replay.out;
}

TEST(TrackCuts, ACutIsRecordedReportedWarpedAndReplayed) {
    const CutWhileTracked t;
    write_sequence(t.folder / "press.igs.mha", t.recording);
    const auto outcome = livetet(t.folder, "track scene.yaml --every-sample --json report.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const ResultReader result(t.folder / "result.h5");
    ASSERT_EQ(result.frame_count(), t.recording.samples.size());

    // The mesh: between cells whose centres are on both sides of x = 64 mm, from 40 mm on.
    ASSERT_EQ(result.first_mesh().nodes.size(), loaded_nodes);
    const TetMesh& mesh = result.mesh();
    ASSERT_EQ(mesh.nodes.size(), loaded_nodes + 11 * 7);
    for (std::size_t n = loaded_nodes; n < mesh.nodes.size(); ++n) {
        EXPECT_NEAR(mesh.nodes[n].x(), 0.06, 1e-9);
        EXPECT_GT(mesh.nodes[n].z(), 0.039);
    }
    expect_parted(t, result);
    const auto report = nlohmann::json::parse(read_text_file(t.folder / "report.json"));
    EXPECT_EQ(report["cuts"]["nodes_added"], 77);
    EXPECT_EQ(report["cuts"]["pieces"], 1);
    EXPECT_GE(report["cuts"]["openings"].get<int>(), 2);
    EXPECT_EQ(report["cuts"]["parted"], 10 * 7);
    EXPECT_NE(report["verdicts"].dump().find("77 nodes doubled"), std::string::npos);
    expect_warped_and_replayed(t, result);
}

/// Played so fast that samples are missed, which cut, too: a replay takes the same ones.
TEST(TrackCuts, ARunThatMissesSamplesIsReplayed) {
    CutWhileTracked t;
    t.set_track(std::string("speed: 60, ") + scalpel);
    write_sequence(t.folder / "press.igs.mha", t.recording);
    ASSERT_EQ(livetet(t.folder, "track scene.yaml --json report.json").status, 0);
    const auto report = nlohmann::json::parse(read_text_file(t.folder / "report.json"));
    EXPECT_GT(report["frames"]["missed"].get<int>(), 0) << report["frames"];
    EXPECT_GT(report["cuts"]["parted"].get<int>(), 0) << report["cuts"];
    const auto replay = livetet(t.folder, "track --replay result.h5");
    EXPECT_EQ(replay.status, 0) << replay.out << report["frames"];
}

/// The same of tetrahedra on two levels, whose nodes move onto the cut. `nodes`: of the mesh as it
/// was loaded.
void expect_cut_of_tets(const CutWhileTracked& t, std::array<int, 3> cells, std::size_t nodes) {
    const Vector3 size(0.2, 0.1, 0.1);
    write_hierarchy(t.folder / "block.h5",
                    make_hierarchy({test::block(cells, size),
                                    test::block({cells[0] / 2, cells[1] / 2, cells[2] / 2}, size)},
                                   "tets"));
    write_text(t.folder / "probes.csv", "name,x_mm,y_mm,z_mm\nbefore,60,50,99\nbehind,68,50,99\n");
    write_sequence(t.folder / "press.igs.mha", t.recording);
    const auto outcome = livetet(t.folder, "track scene.yaml --every-sample --json report.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const ResultReader result(t.folder / "result.h5");
    ASSERT_EQ(result.frame_count(), t.recording.samples.size());
    ASSERT_EQ(result.first_mesh().nodes.size(), nodes);
    const TetMesh& mesh = result.mesh();
    check_tet_mesh(mesh, "cut");
    ASSERT_GT(mesh.nodes.size(), nodes + 60);
    for (std::size_t n = nodes; n < mesh.nodes.size(); ++n) {
        EXPECT_NEAR(mesh.nodes[n].x(), 0.064, size.x() / cells[0]);
        EXPECT_GT(mesh.nodes[n].z(), 0.025);
    }
    expect_parted(t, result);
    const auto report = nlohmann::json::parse(read_text_file(t.folder / "report.json"));
    EXPECT_EQ(report["cuts"]["nodes_added"], mesh.nodes.size() - nodes);
    EXPECT_EQ(report["cuts"]["pieces"], 1);
    expect_warped_and_replayed(t, result);
}

TEST(TrackCuts, ACutOfTetrahedraIsRecordedReportedWarpedAndReplayed) {
    const CutWhileTracked t;
    expect_cut_of_tets(t, {20, 10, 10}, loaded_nodes);
}

/// Corners and midpoints are copied; the viewer's program reads them, too.
TEST(TrackCuts, ACutOfTenNodeTetrahedraIsRecordedReportedWarpedAndReplayed) {
    CutWhileTracked t;
    t.add("elements: P2\n");
    expect_cut_of_tets(t, {10, 6, 6}, 21U * 13 * 13);
}

/// Bad blades, one line each; nothing is written.
TEST(TrackCuts, BladesThatCannotCutAreRefused) {
    CutWhileTracked t;
    write_sequence(t.folder / "press.igs.mha", t.recording);
    const auto refused = [&](const std::string& track, std::initializer_list<std::string> parts,
                             const std::string& more = "") {
        t.set_track(track);
        if (!more.empty()) t.add(more);
        expect_refused(livetet(t.folder, "track scene.yaml --every-sample"), parts);
        EXPECT_FALSE(std::filesystem::exists(t.folder / "result.h5")) << track;
    };
    refused("tools: [{tool: Scalpel, blade_mm: [1, 2, 3, 1, 2, 3]}]",
            {"track.tools[0].blade_mm = [1, 2, 3, 1, 2, 3]", "Scalpel", "0 mm long", "1 to 1000 mm",
             "scene.yaml:"});
    refused("tools: [{tool: Scalpel, blade_mm: [1, 2, 3]}]",
            {"track.tools[0].blade_mm has 3 numbers, expected 6"});
    refused("tools: [{tool: Scalpel, blade_mm: [0, 0, 0, .nan, 0, 0]}]", {"blade_mm", "finite"});
    refused("tools: [{tool: Scalpel, blade_mm: [0, 0, 5000, 0, 10, 5000]}]",
            {"track.tools[0].blade_mm: an end", "5000"});
    refused("tools: [{tool: Knife, blade_mm: [0, -70, 0, 0, 70, 0]}]", {"Knife", "Scalpel"});
    refused("cut_interval_s: -1", {"track.cut_interval_s = -1", "from 0 to 60"});
    refused(scalpel, {"free_pieces: leave_out with blade_mm", "expected keep"},
            "free_pieces: leave_out\n");
    const Vector3 size(0.2, 0.1, 0.1);
    write_hierarchy(
        t.folder / "block.h5",
        make_hierarchy({test::block({10, 5, 5}, size), test::block({5, 3, 3}, size)}, "tets"));
    refused(scalpel, {"elements = P2", "blade_mm", "mixed form", "formulation: displacement"},
            "elements: P2\nformulation: mixed\n");
    refused(scalpel, {"elements = P2", "blade_mm", "the solver", "expected P1"},
            "elements: P2\nsolver: {kind: direct}\n");
}

}  // namespace
}  // namespace livetet
