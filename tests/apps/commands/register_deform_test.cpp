// `livetet register --deform`: from points of a deformed surface to a result.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/commands/deformed_block.hpp"
#include "apps/live/statement_record.hpp"
#include "geometry/nearest_triangle.hpp"
#include "geometry/transform.hpp"
#include "io/hierarchy_file.hpp"
#include "io/points_csv.hpp"
#include "io/registration_file.hpp"
#include "io/result_file.hpp"
#include "io/text.hpp"
#include "mesh/quadratic.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using nlohmann::json;
using test::DeformedBlock;
using test::expect_refused;
using test::Folder;
using test::livetet;
using test::middle;
using test::text_of;
using test::write_points;
using test::write_text;

TEST(RegisterDeform, FindsATargetAndStatesItsError) {
    const DeformedBlock block;
    block.write_scene("  frame: fixed\n");
    write_points(block.folder / "points.csv", block.points());
    const auto outcome = block.run("--json found.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const double moved = (block.true_place(middle) - middle).norm();
    EXPECT_GT(moved, 0.002);
    EXPECT_LT((block.found_place(middle) - block.true_place(middle)).norm(), 0.15 * moved);

    const json about = json::parse(text_of(block.folder / "found.json"));
    const json& found = about["registration"];
    EXPECT_TRUE(found["converged"].get<bool>());
    EXPECT_LT(found["rms_mm"].get<double>(), 0.3 * found["rms_before_mm"].get<double>());
    EXPECT_NEAR(found["total_force_N"][2].get<double>(), 1.2, 0.25);  // another material
    EXPECT_GT(found["total_force_radius_95_N"].get<double>(), 0);
    EXPECT_EQ(found["open_directions"].get<int>(), 0);
    EXPECT_NE(outcome.out.find("young_Pa         not determined"), std::string::npos);

    const ResultReader result(block.folder / "result.h5");
    const StatementReader statements(result, "result.h5");
    ASSERT_EQ(statements.names(), std::vector<std::string>{"Middle"});
    const TargetStatement stated = statements.read(0).targets.front();
    EXPECT_GT(stated.radius_95, 0.00001);
    EXPECT_LT(stated.radius_95, moved);
    EXPECT_LT((stated.position - block.found_place(middle)).norm(), 1e-9);
    EXPECT_TRUE(statements.read(0).missing.has(ErrorSource::materials));
    const auto report = livetet(block.folder, "report result.h5 --no-pictures -o report.html");
    EXPECT_EQ(report.status, 0) << report.err;
}

/// The organ is let go on the way, then pulled again: each list starts from the state before.
TEST(RegisterDeform, FollowsLaterListsOfPoints) {
    const DeformedBlock block;
    block.write_scene("  frame: fixed\n  later_points: [between.csv, points.csv]\n");
    write_points(block.folder / "points.csv", block.points());
    std::vector<Vector3> between = block.points();
    for (Vector3& c : between) c.z() = std::min(c.z(), 0.041);  // nearly at rest
    write_points(block.folder / "between.csv", between);
    const auto outcome = block.run("--json found.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const json found = json::parse(text_of(block.folder / "found.json"))["registration"];
    const json& later = found["later"];
    ASSERT_EQ(later.size(), 2);
    EXPECT_LT(later[0]["total_force_N"][2].get<double>(),
              0.6 * found["total_force_N"][2].get<double>());
    EXPECT_NEAR(later[1]["total_force_N"][2].get<double>(), found["total_force_N"][2].get<double>(),
                0.05);
    EXPECT_EQ(later[1]["time_s"].get<double>(), 3);
    const ResultReader result(block.folder / "result.h5");
    ASSERT_EQ(result.frame_count(), 3);
    double apart = 0;
    for (std::size_t n = 0; n < result.displacement(0).size(); ++n)
        apart = std::max(apart, (result.displacement(2)[n] - result.displacement(0)[n]).norm());
    EXPECT_LT(apart, 0.0004);
    EXPECT_NE(outcome.out.find("between.csv"), std::string::npos);

    block.write_scene(
        "  frame: fixed\n  later_points: [between.csv, points.csv]\n  later_iterations: 1\n");
    const auto hurried = block.run();
    ASSERT_EQ(hurried.status, 0) << hurried.err << hurried.out;
    EXPECT_NE(hurried.out.find("between.csv (goes on)"), std::string::npos) << hurried.out;
    EXPECT_NE(hurried.out.find("points.csv (settled after"), std::string::npos) << hurried.out;
    const ResultReader frames(block.folder / "result.h5");
    const StatementReader statements(frames, "result.h5");
    EXPECT_FALSE(statements.read(0).missing.has(ErrorSource::solver));
    EXPECT_TRUE(statements.read(1).missing.has(ErrorSource::solver));
    EXPECT_FALSE(statements.read(2).missing.has(ErrorSource::solver));

    write_points(block.folder / "far.csv", std::vector<Vector3>(40, Vector3(9, 9, 9)));
    expect_refused(block.run("--later-points far.csv"), {"far.csv"});
    expect_refused(block.run("--later-points sweep.mha"), {"--later-points sweep.mha", ".csv"});
}

TEST(RegisterDeform, TakesPointsAndLandmarksThatTheSceneNames) {
    const DeformedBlock block;
    block.write_scene(
        "  frame: fixed\n  surface_points: ../points.csv\n  landmarks: ../now.csv\n"
        "  landmarks_at_rest: ../rest.csv\n");
    write_points(block.folder / "points.csv", block.points());
    write_points(block.folder / "rest.csv", {middle});
    write_points(block.folder / "now.csv", {block.true_place(middle)});
    // The scene's paths are relative to the scene.
    std::string scene = text_of(block.folder / "scene.yaml");
    scene.replace(scene.find("block.h5"), 8, "../block.h5");
    std::filesystem::create_directory(block.folder / "in");
    write_text(block.folder / "in" / "scene.yaml", scene);
    const auto outcome = livetet(block.folder, "register --deform in/scene.yaml --json found.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const json about = json::parse(text_of(block.folder / "found.json"));
    EXPECT_EQ(about["registration"]["landmarks_mm"].size(), 1);
    EXPECT_LT(about["registration"]["landmarks_mm"]["P1"].get<double>(), 1);
    expect_refused(livetet(block.folder, "register --deform in/scene.yaml --json rest.csv"),
                   {"--json", "rest.csv"});
}

TEST(RegisterDeform, ChoosesTheEnergyOfThePriorUnlessTheSceneStatesIt) {
    const DeformedBlock block;
    write_points(block.folder / "points.csv", block.points());
    const auto found_with = [&](const std::string& key) {
        block.write_scene("  frame: fixed\n" + key);
        const auto outcome = block.run("--json found.json");
        EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
        return json::parse(text_of(block.folder / "found.json"))["registration"];
    };
    const json chosen = found_with("");
    const double moved = (block.found_place(middle) - middle).norm();
    EXPECT_GT(chosen["energy_mJ"].get<double>(), 0.1);
    EXPECT_LT(chosen["energy_mJ"].get<double>(), 100);
    EXPECT_GT(chosen["points_sharing_error"].get<double>(), 2);
    const json stated = found_with("  energy_mJ: 0.3\n  shared_error_mm: 0\n");
    EXPECT_NEAR(stated["energy_mJ"].get<double>(), 0.3, 1e-12);
    EXPECT_EQ(stated["points_sharing_error"].get<double>(), 1);
    // With a share of the motion for the model, the error that is stated grows.
    const auto radius = [](const json& found) {
        return found["statement"]["targets"][0]["radius_95_mm"].get<double>();
    };
    const double with_model = radius(chosen);
    const double without = radius(found_with("  model_error_percent: 0\n"));
    EXPECT_GT(with_model, without);
    EXPECT_GT(with_model, 1e3 * 0.15 * moved * 2);
    EXPECT_LT(with_model, without + 1e3 * 0.15 * moved * 3);
}

TEST(RegisterDeform, FindsTheRigidMotionToo) {
    const DeformedBlock block;
    block.write_scene("  frame_error_mm: 5\n  frame_error_deg: 3\n");
    const RigidTransform<Base, ImageFrame> base_from_image{rotation_of_vector({0.02, -0.03, 0.02}),
                                                           {0.003, -0.002, 0.001}};
    std::vector<Vector3> points = block.points();
    for (Vector3& c : points) c = base_from_image * c;
    write_points(block.folder / "points.csv", points);
    FiducialRegistration given;  // the identity: off by that motion
    for (int i = 0; i < 3; ++i)
        given.fiducials.push_back({.name = fmt::format("F{}", i), .in_image = Vector3::Unit(i)});
    write_registration(block.folder / "given.json", given);
    const auto outcome = block.run("--registration given.json -o better.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const auto better = read_registration(block.folder / "better.json").image_from_base;
    const Vector3 truth = block.true_place(middle), seen = base_from_image * truth;
    EXPECT_GT((seen - truth).norm(), 0.003);
    EXPECT_LT((better * seen - truth).norm(), 0.0007);
    EXPECT_LT((block.found_place(middle) - better * seen).norm(), 0.0006);
}

TEST(RegisterDeform, StartsFromWhereThePointsFitRigidly) {
    const DeformedBlock block({0, 0, 0.5});
    block.write_scene("  frame: surface\n");
    std::vector<Vector3> points = block.points();
    for (Vector3& c : points) c += Vector3(0.010, 0.006, -0.004);
    write_points(block.folder / "points.csv", points);
    const auto outcome = block.run();
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    EXPECT_LT((block.found_place(middle) - block.true_place(middle)).norm(), 0.001);
}

TEST(RegisterDeform, TakesLandmarksByName) {
    const DeformedBlock block;
    block.write_scene("  frame: fixed\n  landmark_error_mm: 0.5\n");
    write_points(block.folder / "points.csv", block.points());
    const Vector3 inside(0.045, 0.04, 0.03);
    write_points_csv(block.folder / "image.csv",
                     std::vector<NamedPoint>{{"Other", {0.01, 0.01, 0.01}}, {"Vessel", inside}});
    write_points_csv(block.folder / "marks.csv",
                     std::vector<NamedPoint>{{"Vessel", block.true_place(inside)}});
    const auto outcome = block.run("--landmarks marks.csv --image image.csv --json found.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const json found = json::parse(text_of(block.folder / "found.json"))["registration"];
    EXPECT_LT(found["landmarks_mm"]["Vessel"].get<double>(), 0.7);
    write_points_csv(block.folder / "marks.csv", std::vector<NamedPoint>{{"Vesel", inside}});
    expect_refused(block.run("--landmarks marks.csv --image image.csv"),
                   {"marks.csv", "Vesel", "image.csv"});
    expect_refused(block.run("--landmarks marks.csv"), {"--image"});
}

TEST(RegisterDeform, NamesForcesThatThePointsDoNotSee) {
    const DeformedBlock block({0, 0, 0.5});
    block.write_scene("  frame: fixed\n");
    std::string scene = text_of(block.folder / "scene.yaml");
    scene.replace(scene.find("forces: ["), 9,
                  "forces: [{sphere_mm: [0, 0, 20, 12], pattern: uniform}, ");
    write_text(block.folder / "scene.yaml", scene);
    std::vector<Vector3> seen;  // the top's other half
    for (const Vector3& c : block.points())
        if (c.z() > 0.039 && c.x() > 0.03 && c.y() > 0.03) seen.push_back(c);
    write_points(block.folder / "points.csv", seen);
    const auto outcome = block.run("--json found.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const json found = json::parse(text_of(block.folder / "found.json"))["registration"];
    EXPECT_GT(found["open_directions"].get<int>(), 0);
    bool names_the_corner = false;
    for (const auto& name : found["open_forces"]) {
        names_the_corner |= name.get<std::string>().rfind("deform.forces[0]", 0) == 0;
        EXPECT_EQ(name.get<std::string>().find("deform.forces[1]"), std::string::npos);
    }
    EXPECT_TRUE(names_the_corner) << outcome.out;
}

TEST(RegisterDeform, SaysHowFarItCameWhereItDoesNotConverge) {
    const DeformedBlock block;
    block.write_scene("  frame: fixed\n  max_iterations: 1\n");
    write_points(block.folder / "points.csv", block.points());
    const auto outcome = block.run();
    EXPECT_EQ(outcome.status, 3) << outcome.err;
    EXPECT_NE(outcome.err.find("did not converge in 1 iteration"), std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.err.find("mm before"), std::string::npos) << outcome.err;
    const ResultReader result(block.folder / "result.h5");
    EXPECT_FALSE(result.has_text("targets"));
    EXPECT_GT((block.found_place(middle) - middle).norm(), 0.0005);
}

/// A column that was pressed far beyond Euler's load, pi^2 E I / (4 L^2), and leans a little:
/// forces that keep their direction do not hold it there.
TEST(RegisterDeform, SaysWhereTheForcesFoundHoldNoEquilibrium) {
    const Folder folder("column");
    const TetMesh column = test::block({2, 2, 20}, {0.01, 0.01, 0.1});
    write_hierarchy(folder / "column.h5", make_hierarchy({column}, "a column"));
    write_text(folder / "scene.yaml",
               "mesh: {file: column.h5}\nmaterials: [{young_Pa: 3000, poisson: 0.3}]\n"
               "solver: {kind: direct}\nfix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}]\n"
               "deform:\n  forces: [{half_space_mm: [0, 0, 99, 0, 0, -1], pattern: uniform}]\n"
               "  point_error_mm: 0.5\n  shared_error_mm: 0\n  energy_mJ: 100\n  frame: fixed\n");
    std::vector<Vector3> points;
    std::vector<NamedPoint> at_rest, measured;  // at the top: there the sides do not tell
    for (const Vector3& x : column.nodes) {
        points.emplace_back(x.x() + 0.2 * x.z() * x.z(), x.y(), 0.94 * x.z());
        if (x.z() < 0.0999) continue;
        at_rest.push_back({fmt::format("T{}", at_rest.size()), x});
        measured.push_back({at_rest.back().name, points.back()});
    }
    write_points(folder / "points.csv", points);
    write_points_csv(folder / "image.csv", at_rest);
    write_points_csv(folder / "marks.csv", measured);
    const auto outcome = livetet(folder,
                                 "register --deform scene.yaml --surface-points points.csv "
                                 "--landmarks marks.csv --image image.csv");
    EXPECT_EQ(outcome.status, 3) << outcome.out;
    EXPECT_NE(outcome.err.find("no equilibrium near what was fitted"), std::string::npos)
        << outcome.err << outcome.out;
    // The result holds what was fitted, not the column that fell.
    const ResultReader result(folder / "result.h5");
    const Vector3 top(0.005, 0.005, 0.1);
    const Vector3 u = PointSampler(column, std::vector{top}).sample(0, result.displacement(0));
    EXPECT_LT(u.z(), -0.001);
    EXPECT_LT(u.norm(), 0.005);
}

TEST(RegisterDeform, RefusesPointsThatCannotBeOfTheOrgan) {
    const DeformedBlock block({0, 0, 0.5});
    const std::vector<Vector3> points = block.points();
    const auto refused = [&](auto&& change, std::initializer_list<std::string> parts) {
        std::vector<Vector3> changed;
        for (const Vector3& c : points) changed.push_back(change(c));
        write_points(block.folder / "points.csv", changed);
        expect_refused(block.run(), parts);
        EXPECT_FALSE(std::filesystem::exists(block.folder / "result.h5"));
    };
    refused([](const Vector3& c) -> Vector3 { return c / 1000; },
            {"points.csv", "another unit", "120 mm", "expected points in mm"});
    refused([](const Vector3& c) -> Vector3 { return 1000 * c; }, {"another unit"});
    refused(
        [](const Vector3& c) -> Vector3 {
            return {-c.x(), -c.y(), c.z()};
        },
        {"points.csv", "LPS", "expected RAS"});
    refused([](const Vector3& c) -> Vector3 { return c + Vector3(0.3, 0, 0); },
            {"points.csv", "no points near the organ", "mm (median)"});
    refused([](const Vector3& c) -> Vector3 { return Vector3(0.03, 0.04, 0.04) + 0.03 * c; },
            {"points.csv", "on one spot", "mm RMS"});
    refused([](const Vector3&) { return Vector3(0.03, 0.04, 0.04); },
            {"points.csv", "on one spot"});
    // A ball of the block's size.
    refused(
        [](const Vector3& c) -> Vector3 {
            return Vector3(0.04, 0.04, 0.02) + 0.035 * (c - Vector3(0.04, 0.04, 0.02)).normalized();
        },
        {"points.csv", "not of this surface", "point_error_mm"});

    write_points(block.folder / "points.csv", {points.begin(), points.begin() + 9});
    expect_refused(block.run(), {"points.csv", "9 surface points", "at least 10"});
    block.write_scene("  frame: fixed\n");
    std::string scene = text_of(block.folder / "scene.yaml");
    scene.replace(scene.find("uniform"), 7, "smooth, centres: 20");
    write_text(block.folder / "scene.yaml", scene);
    std::vector<Vector3> few;
    for (std::size_t i = 0; i < points.size(); i += points.size() / 30) few.push_back(points[i]);
    write_points(block.folder / "points.csv", few);
    expect_refused(block.run(), {"points.csv", "at least 48", "centres"});
}

TEST(RegisterDeform, RefusesLandmarksThatCannotBeOfTheOrgan) {
    const DeformedBlock block({0, 0, 0.5});
    block.write_scene("  frame: fixed\n");
    write_points(block.folder / "points.csv", block.points());
    const std::vector<Vector3> rest{{0.01, 0.01, 0.03}, {0.07, 0.02, 0.03}, {0.06, 0.07, 0.03}};
    write_points(block.folder / "image.csv", rest);
    const auto refused = [&](auto&& change, std::initializer_list<std::string> parts) {
        std::vector<Vector3> changed;
        for (const Vector3& c : rest) changed.push_back(change(c));
        write_points(block.folder / "marks.csv", changed);
        expect_refused(block.run("--landmarks marks.csv --image image.csv"), parts);
        EXPECT_FALSE(std::filesystem::exists(block.folder / "result.h5"));
    };
    refused([](const Vector3& c) -> Vector3 { return c / 1000; }, {"landmarks", "another unit"});
    refused(
        [](const Vector3& c) -> Vector3 {
            return {-c.x(), -c.y(), c.z()};
        },
        {"landmarks", "LPS", "expected RAS"});
    refused([](const Vector3& c) -> Vector3 { return c + Vector3(0.1, 0, 0); },
            {"landmarks", "100 mm RMS", "60 mm"});
}

TEST(RegisterDeform, RefusesOutputsThatItCannotWriteBeforeItFits) {
    const DeformedBlock block({0, 0, 0.5});
    write_points(block.folder / "points.csv", block.points());
    expect_refused(block.run("--json nowhere/found.json"), {"nowhere", "cannot be written"});
    EXPECT_FALSE(std::filesystem::exists(block.folder / "result.h5"));
}

TEST(RegisterDeform, RefusesScenesAndOptionsThatItCannotTake) {
    const DeformedBlock block({0, 0, 0.5});
    write_points(block.folder / "points.csv", block.points());
    const std::string scene = text_of(block.folder / "scene.yaml");
    const auto refused_with = [&](const std::string& more,
                                  std::initializer_list<std::string> parts) {
        write_text(block.folder / "scene.yaml", scene + more);
        expect_refused(block.run(), parts);
    };
    refused_with("loads: [{sphere_mm: [40, 40, 40, 20], force_N: [0, 0, 1]}]\n", {"loads"});
    refused_with("gravity_m_per_s2: [0, 0, -9.81]\n", {"gravity_m_per_s2"});
    refused_with("time: {scheme: newmark}\n", {"time.scheme", "static"});
    write_text(block.folder / "scene.yaml", scene);
    expect_refused(livetet(block.folder, "register --deform scene.yaml"), {"--surface-points"});
    expect_refused(block.run("-o better.json"), {"better.json", "--registration"});
    expect_refused(block.run("--scale"), {"--scale", "--deform"});
    for (const char* idle :
         {"--surface-left-out 0.2", "--space lps", "--support", "--for 3", "--dwells 1:2"})
        expect_refused(block.run(idle), {"has no effect here"});
    expect_refused(livetet(block.folder, "register --tracker points.csv"), {"--image is missing"});
    std::string held = scene;
    held.replace(held.find("sphere_mm: [40, 40, 40, 22]"), 27, "sphere_mm: [40, 40, 0, 12]");
    write_text(block.folder / "scene.yaml", held);
    expect_refused(block.run(), {"deform.forces[0]", "free to move"});
    std::string loose = scene;
    loose.replace(loose.find("fix:"), 43, "");
    write_text(block.folder / "scene.yaml", loose);
    expect_refused(block.run(), {"not held"});
    EXPECT_FALSE(std::filesystem::exists(block.folder / "result.h5"));
}

/// Reads an MSH 2.2 file of tets in metres, in the order of its own nodes: Gmsh numbers them anew.
TetMesh read_in_order(const std::filesystem::path& path) {
    std::istringstream in(text_of(path));
    TetMesh mesh;
    std::string word;
    std::size_t count = 0;
    while (in >> word && word != "$Nodes") {
    }
    in >> count;
    for (std::size_t n = 0; n < count; ++n) {
        std::size_t number = 0;
        Vector3 x;
        in >> number >> x.x() >> x.y() >> x.z();
        mesh.nodes.push_back(x);
    }
    while (in >> word && word != "$Elements") {
    }
    in >> count;
    for (std::size_t e = 0; e < count; ++e) {
        int number = 0, kind = 0, tags = 0, tag = 0;
        in >> number >> kind >> tags;
        for (int t = 0; t < tags; ++t) in >> tag;
        Tet tet{};
        for (int k = 0; k < (kind == 4 ? 4 : 3); ++k) {
            in >> tet[k];
            --tet[k];
        }
        if (kind == 4) mesh.tets.push_back(tet);
    }
    EXPECT_TRUE(in) << path;
    return mesh;
}

/// A liver by others (Mestdagh and Cotin 2022): its frames, in mm, and its scene.
class RegisterDeformData : public testing::Test {
  protected:
    void SetUp() override {
        const char* folder_of_data = std::getenv("LIVETET_DATA");
        if (!folder_of_data) GTEST_SKIP() << "LIVETET_DATA does not name the folder of real inputs";
        data = std::filesystem::path(folder_of_data) / "partial_surface";
    }
    std::vector<Vector3> rows(const std::string& name) const {
        std::vector<Vector3> found;
        const std::string text = text_of(data / name);
        bool is_headed = false;
        for (const std::string_view line : split_lines(text)) {
            const auto cells = split_csv(line);
            if (is_headed && cells && cells->size() >= 3)
                found.emplace_back(*parse_number((*cells)[0]), *parse_number((*cells)[1]),
                                   *parse_number((*cells)[2]));
            is_headed = true;
        }
        return found;
    }
    std::string list_of(const std::string& name) const {
        std::string list;
        for (char c : text_of(data / name)) list += c == '\n' || c == ' ' ? ',' : c;
        while (!list.empty() && list.back() == ',') list.pop_back();
        return list;
    }
    void write_inputs(const std::string& sequence, const std::string& frame,
                      const std::string& zone) const {
        write_points(folder / "points.csv", rows(sequence + "/cloud_" + frame + ".csv"));
        write_hierarchy(folder / "liver.h5",
                        make_hierarchy({read_in_order(data / "liver.msh")}, "by others"));
        write_text(folder / "scene.yaml",
                   fmt::format("mesh: {{file: liver.h5}}\nstrain: neohookean\n"
                               "formulation: displacement\n"
                               "materials: [{{young_Pa: 4500, poisson: 0.49}}]\n"
                               "fix: [{{nodes: [{}]}}]\n"
                               "deform:\n  forces: [{}]\n  point_error_mm: 0.5\n  frame: fixed\n",
                               list_of("fixed_nodes.txt"), zone));
    }
    /// RMS, m, of all nodes, and of those of no triangle of the surface that a point lies on.
    struct Errors {
        double all = 0, unseen = 0;
    };
    /// Of frame `k` of the result.
    Errors errors_of(const std::string& sequence, const std::string& frame,
                     std::size_t k = 0) const {
        const ResultReader result(folder / "result.h5");
        const std::vector<Vector3> truth = rows(sequence + "/positions_" + frame + ".csv");
        const std::vector<Vector3> u = result.displacement(k);
        EXPECT_EQ(u.size(), truth.size());
        std::vector<std::uint8_t> is_seen(u.size(), 0);
        const TriangleMesh surface{truth, boundary_triangles(result.mesh().tets)};
        const NearestTriangle nearest(surface.nodes, surface.triangles);
        for (const Vector3& x : rows(sequence + "/cloud_" + frame + ".csv"))
            for (const std::int32_t n : surface.triangles[nearest.find(x).triangle]) is_seen[n] = 1;
        Errors errors;
        for (std::size_t n = 0; n < u.size(); ++n) {
            const double square = (result.mesh().nodes[n] + u[n] - truth[n]).squaredNorm();
            errors.all += square;
            if (!is_seen[n]) errors.unseen += square;
        }
        const auto unseen = std::ranges::count(is_seen, 0);
        EXPECT_GT(unseen, std::ssize(is_seen) / 2);
        errors.all = std::sqrt(errors.all / static_cast<double>(u.size()));
        errors.unseen = std::sqrt(errors.unseen / static_cast<double>(unseen));
        return errors;
    }
    Folder folder;
    std::filesystem::path data;
};

TEST_F(RegisterDeformData, FindsALiverFromAPartOfItsSurface) {
    // First one pull, each frame from the one before; then the other, from rest.
    const std::vector<std::string> frames{"00", "07", "14", "21", "28", "35", "42", "49"};
    const auto expect_found = [&](const std::string& sequence, const std::string& frame,
                                  std::size_t k, const json& found) {
        const Errors errors = errors_of(sequence, frame, k);
        EXPECT_LT(errors.all, 0.0015) << sequence << frame;
        EXPECT_LT(errors.unseen, 0.003) << sequence << frame;
        const json& f = found["total_force_N"];
        const Vector3 truth = rows(sequence + "/total_force_N.csv")[std::stoul(frame)];
        EXPECT_LT((Vector3(f[0], f[1], f[2]) - truth).norm(), 0.15 * truth.norm())
            << sequence << frame;
    };
    const auto found_with = [&](const std::string& sequence, const std::string& options) {
        write_inputs(sequence, frames.front(),
                     fmt::format("{{nodes: [{}]}}", list_of(sequence + "/loaded_nodes.txt")));
        std::string later;
        for (std::size_t k = 1; k < frames.size(); ++k) {
            later += fmt::format(" {}.csv", frames[k]);
            write_points(folder / (frames[k] + ".csv"),
                         rows(fmt::format("{}/cloud_{}.csv", sequence, frames[k])));
        }
        const auto outcome = livetet(
            folder, "register --deform scene.yaml --surface-points points.csv --json found.json " +
                        options + (options.empty() ? "" : later));
        EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
        return json::parse(text_of(folder / "found.json"))["registration"];
    };
    const json first = found_with("neohookean_s1", "--later-points");
    expect_found("neohookean_s1", "00", 0, first);
    for (std::size_t k = 1; k < frames.size(); ++k)
        expect_found("neohookean_s1", frames[k], k, first["later"][k - 1]);
    expect_found("neohookean_s2", "00", 0, found_with("neohookean_s2", ""));
}

TEST_F(RegisterDeformData, FindsALiverWhereThePlaceOfTheForcesIsNotKnown) {
    write_inputs("neohookean_s2", "21",
                 fmt::format("{{nodes: [{}], pattern: smooth, centres: 20}}",
                             list_of("visible_triangles.txt")));
    const auto outcome =
        livetet(folder, "register --deform scene.yaml --surface-points points.csv");
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const Errors errors = errors_of("neohookean_s2", "21");
    EXPECT_LT(errors.all, 0.003);
    EXPECT_LT(errors.unseen, 0.003);
}

}  // namespace
}  // namespace livetet
