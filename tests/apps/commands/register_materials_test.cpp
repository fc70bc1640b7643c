// `livetet register --materials`: from named points of a loaded block to material values.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "io/hierarchy_file.hpp"
#include "io/points_csv.hpp"
#include "io/result_file.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using nlohmann::json;
using test::expect_refused;
using test::Folder;
using test::livetet;
using test::text_of;
using test::write_text;

/// A block whose halves have moduli of 3000 and 9000 Pa, pulled at its top: the points of its
/// surface at rest and under the load.
struct LoadedBlock {
    Folder folder;

    LoadedBlock() {
        TetMesh mesh = test::block({8, 4, 4}, {0.08, 0.04, 0.04});
        for (const Tet& t : mesh.tets) {
            double x = 0;
            for (const std::int32_t n : t) x += mesh.nodes[n].x() / 4;
            mesh.regions.push_back(x < 0.04 ? 1 : 2);
        }
        write_hierarchy(folder / "block.h5", make_hierarchy({mesh}, "two materials"));
        write_text(folder / "truth.yaml", scene("3000", "9000", "truth.h5"));
        const auto solved = livetet(folder, "solve truth.yaml");
        EXPECT_EQ(solved.status, 0) << solved.err;
        const std::vector<Vector3> u = ResultReader(folder / "truth.h5").displacement(0);
        std::vector<NamedPoint> rest, loaded;
        const std::vector<std::int32_t> surface = surface_nodes(mesh);
        for (std::size_t k = 0; k < surface.size(); k += 5) {
            const std::int32_t n = surface[k];
            rest.push_back({fmt::format("P{}", k), mesh.nodes[n]});
            loaded.push_back({fmt::format("P{}", k), mesh.nodes[n] + u[n]});
        }
        write_points_csv(folder / "rest.csv", rest);
        write_points_csv(folder / "loaded.csv", loaded);
        for (NamedPoint& p : loaded) p.position /= 1000;
        write_points_csv(folder / "metres.csv", loaded);
        write_text(folder / "scene.yaml", scene("5000 +- 4000", "5000 +- 4000", "fitted.h5"));
    }
    static std::string scene(const std::string& one, const std::string& two,
                             const std::string& output) {
        return fmt::format(
            "mesh: {{file: block.h5}}\nstrain: neohookean\nmaterials:\n"
            "  - {{region: 1, young_Pa: {}, poisson: 0.4}}\n"
            "  - {{region: 2, young_Pa: {}, poisson: 0.4}}\n"
            "fix: [{{half_space_mm: [0, 0, 0.1, 0, 0, 1]}}]\n"
            "loads: [{{half_space_mm: [0, 0, 39.9, 0, 0, -1], force_N: [1.2, 0.4, 0.8]}}]\n"
            "deform: {{landmark_error_mm: 0.2}}\noutput: {{file: {}}}\n",
            one, two, output);
    }
    test::Outcome run(const std::string& more = "") const {
        return livetet(folder, "register --materials scene.yaml " + more);
    }
};

constexpr const char* points = "--landmarks loaded.csv --image rest.csv ";

TEST(RegisterMaterials, FindsTheModuliAndWritesTheSolveWithThem) {
    const LoadedBlock block;
    const auto outcome = block.run(points + std::string("--json found.json"));
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out;
    const json found = json::parse(text_of(block.folder / "found.json"))["materials"];
    EXPECT_TRUE(found["converged"].get<bool>());
    EXPECT_LT(found["rms_mm"].get<double>(), 0.1 * found["rms_before_mm"].get<double>());
    const double truth[] = {3000, 9000};
    for (std::size_t j = 0; j < 2; ++j) {
        const json& value = found["values"][j];
        EXPECT_EQ(value["key"], fmt::format("materials[{}].young_Pa", j));
        EXPECT_NEAR(value["value"].get<double>(), truth[j], 0.02 * truth[j]);
        EXPECT_LT(value["low_95"].get<double>(), truth[j]);
        EXPECT_GT(value["high_95"].get<double>(), truth[j]);
        EXPECT_TRUE(value["determined"].get<bool>());
    }
    EXPECT_NE(outcome.out.find("materials[1].young_Pa"), std::string::npos) << outcome.out;

    // The result is that of `solve` with these values, and its scene has them.
    const ResultReader fitted(block.folder / "fitted.h5");
    write_text(block.folder / "again.yaml", fitted.scene_text());
    EXPECT_NE(fitted.scene_text().find("young_Pa"), std::string::npos);
    const auto report = livetet(block.folder, "report fitted.h5 --no-pictures -o page.html");
    EXPECT_EQ(report.status, 0) << report.err;
    const std::vector<Vector3> u = fitted.displacement(0),
                               t = ResultReader(block.folder / "truth.h5").displacement(0);
    double most = 0, largest = 0;
    for (std::size_t n = 0; n < u.size(); ++n) {
        most = std::max(most, (u[n] - t[n]).norm());
        largest = std::max(largest, t[n].norm());
    }
    EXPECT_GT(largest, 0.003);
    EXPECT_LT(most, 0.02 * largest);
}

TEST(RegisterMaterials, RefusesWhatItCannotTake) {
    const LoadedBlock block;
    expect_refused(block.run(), {"--landmarks", "--image"});
    expect_refused(block.run(points + std::string("--surface-points loaded.csv")),
                   {"--surface-points", "--materials"});
    expect_refused(block.run("--landmarks loaded.csv --image none.csv"), {"none.csv"});
    expect_refused(livetet(block.folder, "register --tracker t.csv --image rest.csv --support"),
                   {"--support", "--materials"});
    expect_refused(block.run(points + std::string("--json nowhere/found.json")),
                   {"nowhere", "cannot be written"});
    expect_refused(block.run("--landmarks metres.csv --image rest.csv"),
                   {"landmarks", "another unit"});
    EXPECT_FALSE(std::filesystem::exists(block.folder / "fitted.h5"));
    const auto refused_with = [&](const std::string& scene,
                                  std::initializer_list<std::string> parts) {
        write_text(block.folder / "scene.yaml", scene);
        expect_refused(block.run(points), parts);
        EXPECT_FALSE(std::filesystem::exists(block.folder / "fitted.h5"));
    };
    refused_with(LoadedBlock::scene("5000", "5000", "fitted.h5"), {"spread", "--support"});
    std::string mixed = LoadedBlock::scene("5000 +- 4000", "5000 +- 4000", "fitted.h5");
    mixed.replace(mixed.find("poisson: 0.4"), 12, "poisson: 0.495");
    refused_with(mixed, {"mixed form", "formulation"});
    refused_with(
        LoadedBlock::scene("5000 +- 4000", "5000", "fitted.h5") + "time: {scheme: newmark}\n",
        {"time.scheme", "static"});
}

}  // namespace
}  // namespace livetet
