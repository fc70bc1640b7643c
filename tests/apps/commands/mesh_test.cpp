#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>

#include "base/file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/result_file.hpp"
#include "io/surface_file.hpp"
#include "mesh/shapes.hpp"
#include "support/program.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::text_of;

/// Two labels, side by side, in a ball of 18 mm.
LabelImage two_halves() {
    LabelImage image;
    image.size = {24, 24, 24};
    image.ras_from_voxel.diagonal() << 2e-3, 2e-3, 2e-3, 1;
    for (int k = 0; k < 24; ++k)
        for (int j = 0; j < 24; ++j)
            for (int i = 0; i < 24; ++i)
                image.values.push_back(
                    (Vector3(i, j, k) - Vector3::Constant(11.5)).norm() < 9 ? 1 + (i > 11) : 0);
    return image;
}

TEST(Mesh, ReportsDistancesAnglesAndMaterials) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    ASSERT_EQ(livetet(folder, "mesh labels.nii.gz --tets 4000 -o m.h5 --json m.json").status, 0);
    const auto json = nlohmann::json::parse(text_of(folder / "m.json"));
    const auto& finest = json["levels"][0];
    EXPECT_GE(finest["min_dihedral_deg"].get<double>(), 5);
    EXPECT_GE(finest["worst"][0]["min_dihedral_deg"].get<double>(), 5);
    EXPECT_LT(finest["to_surface"]["max_mm"].get<double>(), 2);  // a voxel
    EXPECT_GT(finest["from_surface"]["mean_mm"].get<double>(), 0);
    EXPECT_LT(json["image"]["moved"]["mean_mm"].get<double>(), 1);  // voxels of 2 mm
    ASSERT_EQ(json["regions"].size(), 2u);
    for (const auto& region : json["regions"])
        EXPECT_NEAR(region["tets_ml"].get<double>(), region["voxels_ml"].get<double>(), 1.2);
    EXPECT_EQ(nlohmann::json::parse(read_hierarchy(folder / "m.h5").provenance)["levels"],
              json["levels"]);
}

TEST(Mesh, KeepsWhatNothingHasChanged) {
    const Folder folder;
    LabelImage image = two_halves();
    write_image(folder / "labels.nii.gz", image);
    write_image(folder / "mask.nii.gz", image);
    const std::string command =
        "mesh labels.nii.gz --tets 1000 --fix mask.nii.gz -o m.h5 --json m.json ";
    const auto remade = [&](const std::string& more) {
        std::filesystem::remove(folder / "m.json");
        const auto before = std::filesystem::exists(folder / "m.h5")
                                ? std::filesystem::last_write_time(folder / "m.h5")
                                : std::filesystem::file_time_type{};
        EXPECT_EQ(livetet(folder, command + more).status, 0);
        EXPECT_TRUE(std::filesystem::exists(folder / "m.json"));
        return std::filesystem::last_write_time(folder / "m.h5") != before;
    };
    const std::filesystem::path left = folder / ".m.part4194305.h5";  // of a run that was killed
    test::write_text(left, "");
    EXPECT_TRUE(remade(""));
    EXPECT_FALSE(std::filesystem::exists(left));
    EXPECT_FALSE(remade(""));
    EXPECT_TRUE(remade("--again"));
    EXPECT_TRUE(remade("--min-dihedral-deg 6"));
    EXPECT_TRUE(remade(""));
    image.at(11, 11, 11) = 2;
    write_image(folder / "mask.nii.gz", image);
    EXPECT_TRUE(remade(""));
    write_image(folder / "labels.nii.gz", image);
    EXPECT_TRUE(remade(""));
    EXPECT_FALSE(remade(""));
}

/// The file that `mesh` made says by which mask; once another mask has been through it, it is not
/// what that was.
TEST(Mesh, MakesAnewWhatWasChangedMeanwhile) {
    const Folder folder;
    LabelImage image = two_halves();
    write_image(folder / "labels.nii.gz", image);
    write_image(folder / "a.nii.gz", image);
    for (std::size_t v = 0; v < image.values.size() / 2; ++v) image.values[v] = 0;
    write_image(folder / "b.nii.gz", image);
    const auto fixed_by = [&](const std::string& command) {
        EXPECT_EQ(livetet(folder, "mesh " + command + " -o m.h5").status, 0) << command;
        return read_hierarchy(folder / "m.h5").levels.front().node_sets.at("fixed").size();
    };
    const std::string first = "labels.nii.gz --tets 1000 --fix a.nii.gz";
    const std::size_t by_a = fixed_by(first);
    EXPECT_LT(fixed_by("m.h5 --fix b.nii.gz"), by_a);
    const auto told = nlohmann::json::parse(read_hierarchy(folder / "m.h5").provenance);
    EXPECT_EQ(told["fixed"]["mask"], "b.nii.gz");
    EXPECT_NE(told["made_by"].get<std::string>().find("labels.nii.gz"), std::string::npos)
        << told["made_by"];
    EXPECT_EQ(fixed_by(first), by_a);
}

TEST(Mesh, WritesNothingOverWhatItReads) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    const std::string bytes = text_of(folder / "labels.nii.gz");
    expect_refused(livetet(folder, "mesh labels.nii.gz --tets 1000 -o labels.nii.gz"),
                   {"labels.nii.gz", ".h5"});
    expect_refused(livetet(folder, "mesh labels.nii.gz --tets 1000 -o m.h5 --json ./labels.nii.gz"),
                   {"--json", "labels.nii.gz"});
    expect_refused(livetet(folder, "mesh labels.nii.gz --tets 1000 -o m.h5 --json m.h5"),
                   {"--json", "m.h5"});
    EXPECT_EQ(text_of(folder / "labels.nii.gz"), bytes);
    EXPECT_FALSE(std::filesystem::exists(folder / "m.h5"));
}

TEST(Mesh, RefinesWhateverASceneNames) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    write_text_file(folder / "image.yaml",
                    "mesh: {file: labels.nii.gz, tets: 1000, levels: 2, refine: 1}\n");
    ASSERT_EQ(livetet(folder, "mesh image.yaml -o image.h5 --json image.json").status, 0);
    const MeshHierarchy refined = read_hierarchy(folder / "image.h5");
    ASSERT_EQ(refined.levels.size(), 3u);
    EXPECT_EQ(refined.levels[0].tets.size(), 8 * refined.levels[1].tets.size());
    EXPECT_EQ(nlohmann::json::parse(text_of(folder / "image.json"))["levels"][0]["tets"],
              refined.levels[0].tets.size());
    write_text_file(folder / "hierarchy.yaml", "mesh: {file: image.h5, refine: 1}\n");
    ASSERT_EQ(livetet(folder, "mesh hierarchy.yaml -o again.h5").status, 0);
    EXPECT_EQ(read_hierarchy(folder / "again.h5").levels.size(), 4u);
}

TEST(Mesh, RefusesOptionsThatChangeNothing) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    const std::string stl =
        "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
        "0\nendloop\nendfacet\nendsolid s\n";
    write_text_file(folder / "s.stl", stl);
    ASSERT_EQ(livetet(folder, "mesh labels.nii.gz --tets 1000 -o m.h5").status, 0);
    const auto refused = [&](const std::string& input, const std::string& option,
                             const std::string& value = "") {
        expect_refused(
            livetet(folder, "mesh " + input + " " + option + " " + value + " -o other.h5"),
            {input, option});
    };
    refused("labels.nii.gz", "--space", "lps");
    refused("labels.nii.gz", "--metres");
    refused("s.stl", "--labels", "1");
    refused("s.stl", "--threshold", "1:");
    for (const auto& [option, value] : {std::pair{"--tets", "1000"},
                                        {"--levels", "2"},
                                        {"--edge-lengths-mm", "5"},
                                        {"--budget-ms", "3"},
                                        {"--labels", "1"},
                                        {"--inside-growth", "2"},
                                        {"--min-dihedral-deg", "5"},
                                        {"--refine-sphere", "0,0,0,1,1"},
                                        {"--time-limit-s", "9"},
                                        {"--metres", ""},
                                        {"--space", "lps"}})
        refused("m.h5", option, value);
    for (const std::string key : {"labels: [1]", "tets: 500", "levels: 3", "edge_lengths_mm: [3]",
                                  "space: lps", "unit: m"}) {
        write_text_file(folder / "scene.yaml", "mesh: {file: m.h5, " + key + "}\n");
        expect_refused(livetet(folder, "solve scene.yaml"),
                       {"m.h5", "mesh." + key.substr(0, key.find(':'))});
    }
    EXPECT_FALSE(std::filesystem::exists(folder / "other.h5"));
}

TEST(Mesh, TakesASurfaceInMetres) {
    const Folder folder;
    const TetMesh block = shapes::box({0.1, 0.08, 0.06}, {4, 4, 4});
    TriangleMesh surface{block.nodes, boundary_triangles(block.tets)};
    for (Vector3& x : surface.nodes) x *= 1e-3;  // as if a metre were a millimetre
    write_surface(folder / "s.stl", surface, Space::ras);
    ASSERT_EQ(livetet(folder, "mesh s.stl --metres --tets 1000 -o m.h5").status, 0);
    EXPECT_NEAR(volume(read_hierarchy(folder / "m.h5").levels.front()), 4.8e-4, 5e-6);
}

/// A surface of two bodies: which one is meshed, and that the other is not.
TEST(Mesh, NotesPartsOfASurfaceThatAreLeftOut) {
    const Folder folder;
    TriangleMesh both = shapes::sphere(0.05, 4);
    const TriangleMesh other = shapes::sphere(0.02, 3, {0.1, 0, 0});
    const auto first = static_cast<std::int32_t>(both.nodes.size());
    both.nodes.insert(both.nodes.end(), other.nodes.begin(), other.nodes.end());
    for (const auto& [a, b, c] : other.triangles)
        both.triangles.push_back({first + a, first + b, first + c});
    write_surface(folder / "both.stl", both, Space::ras);
    const auto outcome = livetet(folder, "mesh both.stl --tets 1000 -o m.h5 --json m.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("note         surface: of 2 parts the largest is meshed"),
              std::string::npos)
        << outcome.out;
    EXPECT_EQ(nlohmann::json::parse(text_of(folder / "m.json"))["notes"].size(), 1u);
}

/// A speck of another label that the body does not reach is no material of it.
TEST(Mesh, MeshesABodyOfOneLabelAsOne) {
    const Folder folder;
    LabelImage image = two_halves();
    for (auto& label : image.values) label = label > 0;
    image.at(1, 1, 1) = 7;
    write_image(folder / "labels.nii.gz", image);
    ASSERT_EQ(livetet(folder, "mesh labels.nii.gz --tets 1000 -o m.h5 --json m.json").status, 0);
    const auto json = nlohmann::json::parse(text_of(folder / "m.json"));
    EXPECT_EQ(json["levels"][0]["filled_by"].get<std::string>().find("CGAL"), std::string::npos);
    ASSERT_EQ(json["notes"].size(), 1u) << json["notes"];
    EXPECT_EQ(json["notes"][0].get<std::string>().find("image: 1 speck of 0.008 ml in all"), 0u)
        << json["notes"];
    const auto regions = read_hierarchy(folder / "m.h5").levels.front().regions;
    EXPECT_EQ(std::count(regions.begin(), regions.end(), 1), std::ssize(regions));
}

/// A hollow ball, from radius a to b, in voxels of 1.5 mm.
LabelImage hollow_ball(double a_mm, double b_mm) {
    LabelImage image;
    image.size = {44, 44, 44};
    image.ras_from_voxel.diagonal() << 1.5e-3, 1.5e-3, 1.5e-3, 1;
    for (int k = 0; k < 44; ++k)
        for (int j = 0; j < 44; ++j)
            for (int i = 0; i < 44; ++i) {
                const double r = 1.5 * (Vector3(i, j, k) - Vector3::Constant(21.5)).norm();
                image.values.push_back(r > a_mm && r < b_mm);
            }
    return image;
}

/// G. Lamé's hollow sphere under inner pressure, from an image:
/// u(r) = p a^3 / (E (b^3 - a^3)) ((1 - 2 nu) r + (1 + nu) b^3 / (2 r^2)).
TEST(Mesh, KeepsACavityThatAPressureActsIn) {
    const Folder folder;
    constexpr double a = 18e-3, b = 30e-3, pressure = 20, young = 3000, poisson = 0.3;
    write_image(folder / "labels.nii.gz", hollow_ball(1e3 * a, 1e3 * b));
    const auto made = livetet(folder, "mesh labels.nii.gz --tets 20000 -o m.h5 --json m.json");
    ASSERT_EQ(made.status, 0) << made.err;
    const auto json = nlohmann::json::parse(text_of(folder / "m.json"));
    const double ball_ml = 4e6 * std::numbers::pi / 3;
    EXPECT_NEAR(json["image"]["cavities_ml"][0].get<double>(), ball_ml * a * a * a, 0.3);
    EXPECT_NEAR(json["levels"][0]["volume_ml"].get<double>(), ball_ml * (b * b * b - a * a * a), 1);
    write_text_file(folder / "scene.yaml", fmt::format(R"(
mesh: {{file: m.h5}}
materials: [{{young_Pa: {}, poisson: {}}}]
strain: linear
elements: P2
fix: [{{group: outer, stiffness_N_per_m: 1}}]
loads: [{{group: cavity, pressure_Pa: {}}}]
)",
                                                       young, poisson, pressure));
    const auto solved = livetet(folder, "solve scene.yaml");
    ASSERT_EQ(solved.status, 0) << solved.err;
    const MeshHierarchy hierarchy = read_hierarchy(folder / "m.h5");
    const TetMesh& mesh = hierarchy.levels.front();
    const ResultReader result(folder / "result.h5");
    const std::vector<Vector3> u = result.displacement(result.times_s().size() - 1);
    const Vector3 centre = Vector3::Constant(21.5 * 1.5e-3);
    for (const auto& [group, r] : {std::pair{"cavity", a}, {"outer", b}}) {
        const double factor = pressure * a * a * a / (young * (b * b * b - a * a * a));
        const double exact =
            factor * ((1 - 2 * poisson) * r + (1 + poisson) * b * b * b / (2 * r * r));
        double sum = 0;
        const std::vector<std::int32_t>& nodes = node_set(mesh, group);
        for (const std::int32_t n : nodes) sum += u[n].dot((mesh.nodes[n] - centre).normalized());
        EXPECT_NEAR(sum / static_cast<double>(nodes.size()), exact, 0.02 * exact) << group;
    }
    const auto filled = livetet(folder, "mesh labels.nii.gz --tets 1000 --fill-cavities -o f.h5");
    EXPECT_NE(filled.out.find("1 cavity filled, by 24.33 ml"), std::string::npos) << filled.out;
    EXPECT_NEAR(1e6 * volume(read_hierarchy(folder / "f.h5").levels.front()), ball_ml * b * b * b,
                2);
}

/// Two halves with a gap between them: each can be held, and a scene that holds one is told.
TEST(Mesh, MeshesAllPartsAndEachCanBeHeld) {
    const Folder folder;
    LabelImage image = two_halves();
    for (int k = 0; k < 24; ++k)
        for (int j = 0; j < 24; ++j) image.at(11, j, k) = image.at(12, j, k) = 0;
    write_image(folder / "labels.nii.gz", image);
    const auto one = livetet(folder, "mesh labels.nii.gz --tets 2000 -o one.h5");
    EXPECT_NE(one.out.find("--all-parts"), std::string::npos) << one.out;
    const auto made = livetet(folder, "mesh labels.nii.gz --tets 2000 --all-parts -o m.h5");
    ASSERT_EQ(made.status, 0) << made.err;
    const TetMesh mesh = read_hierarchy(folder / "m.h5").levels.front();
    EXPECT_NEAR(volume(mesh), 2 * volume(read_hierarchy(folder / "one.h5").levels.front()),
                0.03 * volume(mesh));
    EXPECT_EQ(node_set(mesh, "part_1").size() + node_set(mesh, "part_2").size(), mesh.nodes.size());
    const std::string scene = "mesh: {file: m.h5}\ngravity_m_per_s2: [0, 0, -1]\nfix: ";
    write_text_file(folder / "one.yaml", scene + "[{group: part_1}]\n");
    expect_refused(livetet(folder, "solve one.yaml"), {"6 rigid motions are free", "of the piece"});
    write_text_file(folder / "both.yaml", scene +
                                              "[{group: part_1, where: surface}, {group: part_2, "
                                              "where: surface}]\n");
    EXPECT_EQ(livetet(folder, "solve both.yaml").status, 0);
}

TEST(Mesh, KeepsNothingWhoseVoxelsLieInOtherFiles) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    write_text_file(folder / "mask.mhd",
                    "ObjectType = Image\nNDims = 3\nDimSize = 24 24 24\nElementSpacing = 2 2 "
                    "2\nElementType = MET_UCHAR\n"
                    "TransformMatrix = -1 0 0 0 -1 0 0 0 1\nElementDataFile = mask.raw\n");
    std::size_t fixed[2];
    for (const int thickness : {8, 12}) {
        std::string voxels(24 * 24 * 24, 0);
        std::fill_n(voxels.begin(), thickness * 24 * 24, 1);
        write_text_file(folder / "mask.raw", voxels);
        ASSERT_EQ(livetet(folder, "mesh labels.nii.gz --tets 1000 --fix mask.mhd -o m.h5").status,
                  0);
        fixed[thickness == 12] =
            read_hierarchy(folder / "m.h5").levels.front().node_sets.at("fixed").size();
    }
    EXPECT_GT(fixed[1], fixed[0]);
    const auto kept = livetet(folder, "mesh labels.nii.gz --tets 1000 --fix mask.mhd -o m.h5");
    EXPECT_NE(kept.out.find("unchanged"), std::string::npos) << "the same voxels: " << kept.out;

    const std::string voxels = text_of(folder / "mask.raw");
    expect_refused(
        livetet(folder, "mesh labels.nii.gz --tets 1000 --fix mask.mhd -o m.h5 --json mask.raw"),
        {"--json", "mask.raw", "is read"});
    EXPECT_EQ(text_of(folder / "mask.raw"), voxels);
}

TEST(Mesh, LeavesTheSurfaceThatItFailedOnForALook) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    const auto result =
        livetet(folder, "mesh labels.nii.gz --tets 4000 --time-limit-s 1e-9 -o m.h5");
    EXPECT_EQ(result.status, 2);
    EXPECT_NE(result.err.find("m.failed.stl"), std::string::npos) << result.err;
    EXPECT_FALSE(read_surface(folder / "m.failed.stl", Space::ras).triangles.empty());
    EXPECT_FALSE(std::filesystem::exists(folder / "m.h5"));
    ASSERT_EQ(livetet(folder, "mesh labels.nii.gz --tets 1000 -o m.h5").status, 0);
    EXPECT_FALSE(std::filesystem::exists(folder / "m.failed.stl")) << "of an earlier failure";
}

/// The image's frame, the labels and the options are in the file: it says by itself what it is of.
TEST(Mesh, WritesWhereTheImageLiesAndHowItWasMade) {
    const Folder folder;
    LabelImage image = two_halves();
    image.ras_from_voxel.col(0) << 1.2e-3, 1.6e-3, 0, 0;
    image.ras_from_voxel.col(1) << 1.6e-3, -1.2e-3, 0, 0;
    image.ras_from_voxel.col(3) << 0.03, -0.02, 0.1, 1;
    write_image(folder / "labels.nii.gz", image);
    write_image(folder / "mask.nii.gz", image);
    ASSERT_EQ(livetet(folder,
                      "mesh labels.nii.gz --labels 2 --tets 1000 --smoothing-mm 1.25 "
                      "--refine-sphere 0,0,0,5,2 "
                      "--fix mask.nii.gz --fix-edge-ratio 0.8 -o m.h5 --json m.json")
                  .status,
              0);
    const auto frame = read_image_grid(folder / "m.h5");
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->size, image.size);
    EXPECT_LT((frame->ras_from_voxel - image.ras_from_voxel).cwiseAbs().maxCoeff(), 1e-8);
    const auto told = nlohmann::json::parse(read_hierarchy(folder / "m.h5").provenance);
    EXPECT_EQ(told["image"]["size"], (std::vector{24, 24, 24}));
    EXPECT_NEAR(told["image"]["spacing_mm"][0].get<double>(), 2, 1e-5);
    EXPECT_NEAR(told["image"]["ras_from_voxel_mm"][1][3].get<double>(), -20, 1e-5);
    EXPECT_EQ(told["image"]["smoothing_mm"], 1.25);
    const std::string made_by = told["made_by"], asked = told["asked"]["mesh"];
    for (const char* words : {"labels.nii.gz", "labels 2,", "smoothed by 1.25 mm",
                              "edges of 2.000 mm within 5.000 mm", "times 0.8"})
        EXPECT_NE(made_by.find(words), std::string::npos) << words << " in " << made_by;
    EXPECT_NE(asked.find("labels: [2]"), std::string::npos) << asked;
    EXPECT_EQ(told["asked"]["refine_spheres_mm"].size(), 5u);
    EXPECT_EQ(told["fixed"]["mask"], "mask.nii.gz");
    EXPECT_EQ(told["fixed"]["edge_ratio"], 0.8);
    ASSERT_EQ(livetet(folder, "mesh m.h5 -o other.h5").status, 0);
    EXPECT_EQ(read_image_grid(folder / "other.h5")->ras_from_voxel, frame->ras_from_voxel);
}

TEST(Mesh, SmoothsAsTheSceneSays) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    const auto mean_shift = [&](const std::string& keys) {
        write_text_file(folder / "scene.yaml",
                        "mesh: {file: labels.nii.gz, tets: 1000" + keys + "}\n");
        EXPECT_EQ(livetet(folder, "mesh scene.yaml -o m.h5 --json m.json").status, 0);
        return nlohmann::json::parse(text_of(folder / "m.json"))["image"]["moved"]["mean_mm"]
            .get<double>();
    };
    EXPECT_GT(mean_shift(", smoothing_mm: 4, voxel_mm: 1"), 1.05 * mean_shift(""));
    write_text_file(folder / "scene.yaml", "mesh: {file: labels.nii.gz, voxel_mm: 0}\n");
    expect_refused(livetet(folder, "mesh scene.yaml -o m.h5"),
                   {"mesh.voxel_mm", "greater than 0", "scene.yaml:1"});
}

/// What `mesh` says, whoever meshes on the spot says too.
TEST(Mesh, OnTheSpotHasTheSameNotesAndSurfaceForALook) {
    const Folder folder;
    LabelImage image = two_halves();
    for (auto& label : image.values) label = label > 0;
    image.at(1, 1, 1) = 7;
    write_image(folder / "labels.nii.gz", image);
    const std::string rest =
        "fix: [{half_space_mm: [0, 0, 15, 0, 0, 1]}]\ngravity_m_per_s2: [0, 0, -1]\n";
    write_text_file(folder / "scene.yaml", "mesh: {file: labels.nii.gz, tets: 1000}\n" + rest);
    const auto solved = livetet(folder, "solve scene.yaml");
    EXPECT_EQ(solved.status, 0) << solved.err;
    EXPECT_NE(solved.err.find("label 7"), std::string::npos) << solved.err;
    write_surface(folder / "ball.stl", shapes::sphere(0.02, 4), Space::ras);
    write_text_file(folder / "scene.yaml",
                    "mesh: {file: ball.stl, edge_lengths_mm: [5000]}\n" + rest);
    expect_refused(livetet(folder, "solve scene.yaml"), {"ball.stl", "ball.failed.stl"});
    EXPECT_FALSE(read_surface(folder / "ball.failed.stl", Space::ras).triangles.empty());
}

TEST(Mesh, SaysAtOnceWhatItCannotDo) {
    const Folder folder;
    write_text_file(folder / "scene.yaml", "mesh: {file: labels.nii.gz}\n");
    const auto mixed = livetet(folder, "mesh scene.yaml --tets 4000 -o m.h5");
    EXPECT_EQ(mixed.status, 2);
    EXPECT_NE(mixed.err.find("--tets"), std::string::npos) << mixed.err;
    write_image(folder / "labels.nii.gz", two_halves());
    const auto nowhere = livetet(folder, "mesh labels.nii.gz -o none/m.h5");
    EXPECT_EQ(nowhere.status, 2);
    EXPECT_NE(nowhere.err.find("none"), std::string::npos) << nowhere.err;
    EXPECT_EQ(nowhere.err.find("level 0"), std::string::npos) << nowhere.err;
}

TEST(Mesh, TakesAFrameBudget) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", two_halves());
    ASSERT_EQ(livetet(folder, "mesh labels.nii.gz --budget-ms 0.3 -o m.h5").status, 0);
    EXPECT_NEAR(static_cast<double>(read_hierarchy(folder / "m.h5").levels.front().tets.size()),
                3000, 300);
    for (const std::string budget : {"300000", "500000", "1e-9"})
        expect_refused(livetet(folder, "mesh labels.nii.gz --budget-ms " + budget + " -o m.h5"),
                       {"--budget-ms", budget, "2000"});
}

}  // namespace
}  // namespace livetet
