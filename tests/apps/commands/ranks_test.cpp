#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <future>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/commands/last_displacement.hpp"
#include "io/hierarchy_file.hpp"
#include "support/mpirun.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"

namespace livetet {
namespace {

using test::Folder;
using test::livetet;
using test::mpirun;
using test::text_of;
using test::write_text;

/// A beam of 1,500 tets, which have work for seven ranks: of eight, one has none.
void write_beam(const Folder& folder) {
    write_hierarchy(folder / "beam.h5", make_hierarchy({test::block({10, 5, 5}, {0.2, 0.1, 0.1}),
                                                        test::block({5, 2, 2}, {0.2, 0.1, 0.1})},
                                                       "a beam"));
}

const std::string held_beam =
    "mesh: {file: beam.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n"
    "solver: {newton_tolerance: 1e-11, relative_tolerance: 1e-7}\n";
const std::string pressed =
    "drive: [{sphere_mm: [100, 50, 100, 25], where: surface, displacement_mm: [0, 2, -12]}]\n"
    "materials: [{young_Pa: 5000, poisson: 0.45}]\n";
const std::string swinging =
    "gravity_m_per_s2: [0, 0, -9.81]\nmaterials: [{young_Pa: 50000, poisson: 0.495}]\n";

/// The largest distance between two fields, by the largest vector of the first.
double apart(const std::vector<Vector3>& a, const std::vector<Vector3>& b) {
    EXPECT_EQ(a.size(), b.size());
    double distance = 0, largest = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
        distance = std::max(distance, (a[n] - b[n]).norm());
        largest = std::max(largest, a[n].norm());
    }
    EXPECT_GT(largest, 1e-3);
    return distance / largest;
}

TEST(Ranks, OneThreeAndEightAgreeTo1em8InEveryForm) {
    const Folder folder;
    write_beam(folder);
    const std::string dynamic = swinging + "time: {step_s: 0.01, duration_s: 0.03, scheme: ";
    const std::pair<const char*, std::string> forms[] = {
        {"P2, static", pressed + "elements: P2\n"},
        {"mixed, static", pressed + "formulation: mixed\n"},
        {"finite strain, static", pressed + "strain: neohookean\nformulation: displacement\n"},
        {"P1, dynamic", dynamic + "newmark}\nformulation: displacement\n"},
        {"P2, mixed, dynamic", dynamic + "generalized_alpha}\nelements: P2\n"},
    };
    for (const auto& [name, form] : forms) {
        write_text(folder / "scene.yaml", held_beam + form);
        std::vector<Vector3> of_one;
        for (const int ranks : {1, 3, 8}) {
            const auto outcome =
                livetet(folder, "solve scene.yaml --json told.json", mpirun(ranks));
            ASSERT_EQ(outcome.status, 0) << name << outcome.err;
            EXPECT_EQ(nlohmann::json::parse(text_of(folder / "told.json"))["ranks"], ranks);
            const std::vector<Vector3> u = test::last_displacement(folder / "result.h5");
            if (ranks == 1)
                of_one = u;
            else
                EXPECT_LT(apart(of_one, u), 1e-8) << name << " on " << ranks << " ranks";
        }
    }
}

/// What `explain --ranks` estimates against what a solve takes.
TEST(Ranks, TheirMemoryIsForetold) {
    const Folder folder;
    write_beam(folder);
    std::string scene = held_beam + pressed + "strain: linear\noutput: {file: none}\n";
    scene.replace(scene.find("beam.h5"), 7, "beam.h5, refine: 2");
    write_text(folder / "scene.yaml", scene);
    const auto told = livetet(folder, "explain scene.yaml --ranks 1,4,64");
    ASSERT_EQ(told.status, 0) << told.err;
    EXPECT_NE(told.out.find("more ranks than pay"), std::string::npos) << told.out;
    std::istringstream table(told.out.substr(told.out.find("tets each")));
    std::string line;
    std::getline(table, line);
    for (const int ranks : {1, 4}) {
        int on = 0;
        double tets = 0, megabytes = 0;
        std::getline(table, line);
        std::istringstream(line) >> on >> tets >> megabytes;
        EXPECT_EQ(on, ranks);
        EXPECT_EQ(tets, 64 * 1500 / ranks);
        ASSERT_EQ(livetet(folder, "solve scene.yaml --json told.json", mpirun(ranks)).status, 0);
        const auto run = nlohmann::json::parse(text_of(folder / "told.json"));
        const double taken = run["peak_bytes_most"].get<double>() / 1e6;
        EXPECT_NEAR(megabytes, taken, 0.25 * taken) << ranks;
    }
}

TEST(Ranks, MoreOfThemThanTetsAreNoFault) {
    const Folder folder;
    write_hierarchy(folder / "beam.h5",
                    make_hierarchy({test::block({1, 1, 1}, {0.2, 0.1, 0.1})}, "a box"));
    for (const char* form : {"", "elements: P2\n", "formulation: mixed\n"}) {
        write_text(folder / "scene.yaml",
                   held_beam + swinging + "strain: linear\noutput: {fields: [stress]}\n" + form);
        ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
        const std::vector<Vector3> of_one = test::last_displacement(folder / "result.h5");
        const auto outcome = livetet(folder, "solve scene.yaml", mpirun(8));
        ASSERT_EQ(outcome.status, 0) << outcome.err;
        EXPECT_LT(apart(of_one, test::last_displacement(folder / "result.h5")), 1e-8) << form;
    }
}

TEST(Ranks, OneThatIsKilledEndsAllAndLeavesTheOlderResult) {
    const Folder folder;
    write_beam(folder);
    const std::string scene = held_beam + swinging + "time: {step_s: 0.01, scheme: newmark, ";
    write_text(folder / "scene.yaml", scene + "duration_s: 0.01}\n");
    ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    const std::string older = text_of(folder / "result.h5");
    write_text(folder / "scene.yaml", scene + "duration_s: 1000}\n");
    auto run = std::async(std::launch::async,
                          [&] { return livetet(folder, "solve scene.yaml", mpirun(4)); });
    // Until all ranks run and the result was begun beside the older one.
    const auto is_begun = [&] {
        for (const auto& entry : std::filesystem::directory_iterator(folder.path()))
            if (entry.path().filename().string().find(".part") != std::string::npos) return true;
        return false;
    };
    const auto waits = [&] {
        return run.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready;
    };
    while (waits() && !(is_begun() && test::programs_in(folder).size() == 4)) {
    }
    const std::vector<pid_t> ranks = test::programs_in(folder);
    ASSERT_EQ(ranks.size(), 4u);
    ::kill(ranks[2], SIGKILL);
    const auto outcome = run.get();
    EXPECT_NE(outcome.status, 0);
    EXPECT_NE(outcome.status, 124) << "the others waited until `timeout` ended them";
    EXPECT_TRUE(test::programs_in(folder).empty());
    EXPECT_TRUE(text_of(folder / "result.h5") == older);
}

}  // namespace
}  // namespace livetet
