#include <gtest/gtest.h>

#include "io/fiducial_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/image_file.hpp"
#include "io/registration_file.hpp"
#include "io/sequence_file.hpp"
#include "mesh/hierarchy.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::text_of;
using test::write_text;

LabelImage ball() {
    LabelImage image;
    image.size = {24, 24, 24};
    image.ras_from_voxel.diagonal() << 2e-3, 2e-3, 2e-3, 1;
    image.values.assign(24 * 24 * 24, 0);
    for (int k = 0; k < 24; ++k)
        for (int j = 0; j < 24; ++j)
            for (int i = 0; i < 24; ++i)
                image.at(i, j, k) = (Vector3(i, j, k) - Vector3::Constant(11.5)).norm() < 9 ? 3 : 0;
    return image;
}

void write_block(const std::filesystem::path& path) {
    write_hierarchy(path, make_hierarchy({test::block({4, 3, 3}, {0.1, 0.08, 0.06})}, "a block"));
}

const std::string held_scene =
    "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n";

TEST(BadInput, AMissingOrTruncatedImageLeavesTheGoodOutputAlone) {
    const Folder folder;
    write_text(folder / "good.h5", "something good");
    expect_refused(livetet(folder, "mesh none.nii.gz -o good.h5"), {"none.nii.gz", "no such file"});
    write_image(folder / "labels.nii.gz", ball());
    const std::string whole = text_of(folder / "labels.nii.gz");
    write_text(folder / "cut.nii.gz", whole.substr(0, whole.size() * 2 / 3));
    expect_refused(livetet(folder, "mesh cut.nii.gz -o good.h5"), {"cut.nii.gz"});
    EXPECT_EQ(text_of(folder / "good.h5"), "something good");
}

TEST(BadInput, AnAbsentLabelNamesThoseThatAreThere) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", ball());
    expect_refused(livetet(folder, "mesh labels.nii.gz --labels 7 -o out.h5"),
                   {"labels.nii.gz", "7", "3"});
    EXPECT_FALSE(std::filesystem::exists(folder / "out.h5"));
}

TEST(BadInput, AnEmptyTextOfAnUnsetVariableIsNoValue) {
    const Folder folder;
    write_image(folder / "labels.nii.gz", ball());
    for (const char* option : {"--fix", "--labels", "--grade-scene", "--threshold"})
        expect_refused(livetet(folder, fmt::format("mesh labels.nii.gz -o out.h5 {} ''", option)),
                       {option, "empty text", "expected a value"});
    for (const char* command : {"solve", "explain", "report", "track"})
        expect_refused(livetet(folder, fmt::format("{} ''", command)), {"empty text"});
    EXPECT_FALSE(std::filesystem::exists(folder / "out.h5"));
}

TEST(BadInput, AMeshWithoutTetsOrWithInvertedOnes) {
    const Folder folder;
    const std::string head =
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 "
        "1\n$EndNodes\n$Elements\n1\n";
    write_text(folder / "flat.msh", head + "1 2 2 1 1 1 2 3\n$EndElements\n");
    write_text(folder / "inverted.msh", head + "1 4 2 1 1 1 3 2 4\n$EndElements\n");
    for (const char* name : {"flat", "inverted"}) {
        write_text(folder / "scene.yaml", std::string("mesh: {file: ") + name + ".msh}\n");
        expect_refused(
            livetet(folder, "solve scene.yaml"),
            {std::string(name) + ".msh", std::string(name) == "flat" ? "no tet" : "inverted"});
        EXPECT_FALSE(std::filesystem::exists(folder / "result.h5"));
    }
}

TEST(BadInput, ASceneWithAMistake) {
    const Folder folder;
    write_block(folder / "block.h5");
    write_text(folder / "scene.yaml", held_scene + "materials: [{yuong_Pa: 3}]\n");
    expect_refused(livetet(folder, "solve scene.yaml"), {"yuong_Pa", "young_Pa", "scene.yaml:3"});
    write_text(folder / "scene.yaml", held_scene + "materials: [{poisson: 0.5}]\n");
    expect_refused(livetet(folder, "solve scene.yaml"), {"poisson", "0.5", "scene.yaml:3"});
    write_text(folder / "scene.yaml",
               held_scene + "drive: [{sphere_mm: [500, 0, 0, 3], displacement_mm: [0, 0, 1]}]\n");
    expect_refused(livetet(folder, "solve scene.yaml"), {"drive[0]", "no node", "100.0"});
    write_text(folder / "scene.yaml",
               held_scene + "drive: [{group: top, displacement_mm: [0, 0, 1]}]\n");
    expect_refused(livetet(folder, "solve scene.yaml"), {"drive[0].group", "top"});
    for (const std::string budget :
         {"fast", "10", "0 ms", "-3 ms", "10 min", "1e400 s", "nan ms"}) {
        write_text(folder / "scene.yaml", held_scene + "track: {budget: " + budget + "}\n");
        expect_refused(livetet(folder, "track scene.yaml"),
                       {"budget", budget, "10 ms", "scene.yaml:3"});
    }
    expect_refused(livetet(folder, "solve none.yaml"), {"none.yaml", "no such file"});
    expect_refused(livetet(folder, "solve scene.yaml --jsn x"), {"--jsn"});
    expect_refused(livetet(folder, "slove scene.yaml"), {"slove"});
}

struct Touched {
    Folder folder;
    std::vector<NamedPoint> image, tracker;
    Touched() {
        const Vector3 places[] = {{0.1, 0, 0},
                                  {0, 0.12, 0.01},
                                  {-0.09, 0.01, 0.05},
                                  {0.02, -0.11, 0.03},
                                  {0.05, 0.04, 0.1}};
        const Eigen::Matrix3d R =
            Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
        for (int i = 0; i < 5; ++i) {
            image.push_back({"F" + std::to_string(i + 1), places[i]});
            tracker.push_back({image.back().name, R * places[i] + Vector3(0.3, 0.1, 0)});
        }
    }
    test::Outcome run() {
        write_fiducials(folder / "image.mrk.json", image);
        write_fiducials(folder / "tracker.mrk.json", tracker);
        return livetet(
            folder,
            "register --tracker tracker.mrk.json --image image.mrk.json -o registration.json");
    }
};

TEST(BadInput, FewCollinearOrDisorderedFiducials) {
    Touched t;
    EXPECT_EQ(t.run().status, 0);
    std::filesystem::remove(t.folder / "registration.json");
    std::swap(t.tracker[1], t.tracker[3]);
    expect_refused(t.run(), {"1, 4, 3, 2, 5", "fit better"});
    t.tracker.pop_back();
    t.tracker[0].name = "none of them";
    expect_refused(t.run(), {"4", "5", "names that match"});
    t.image.resize(2);
    t.tracker.resize(2);
    expect_refused(t.run(), {"2", "3"});
    for (int i = 0; i < 3; ++i) {
        t.image.resize(3);
        t.tracker.resize(3);
        t.image[i] = {"L" + std::to_string(i), {0.01 * i, 0.02 * i, 0.03 * i}};
        t.tracker[i] = t.image[i];
    }
    expect_refused(t.run(), {"line"});
    EXPECT_FALSE(std::filesystem::exists(t.folder / "registration.json"));
}

TEST(BadInput, ARecordingWithoutTheSensorListsThoseItHas) {
    const Folder folder;
    SimulatedTrackerOptions options;
    write_sequence(folder / "press.igs.mha", simulate_press(options));
    expect_refused(livetet(folder, "calibrate pivot press.igs.mha --tool Stylus"),
                   {"Stylus", "Reference", "Sensor"});
    const std::string whole = text_of(folder / "press.igs.mha");
    write_text(folder / "cut.igs.mha", whole.substr(0, whole.size() / 2));
    expect_refused(livetet(folder, "calibrate pivot cut.igs.mha --tool Sensor"), {"cut.igs.mha"});
}

TEST(BadInput, WhatIsReadIsNotWritten) {
    const Folder folder;
    write_block(folder / "block.h5");
    write_text(folder / "points.csv", "name,x_mm,y_mm,z_mm\nmiddle,50,40,30\n");
    SimulatedTrackerOptions options;
    write_sequence(folder / "press.igs.mha", simulate_press(options));
    write_fiducials(
        folder / "image.mrk.json",
        std::vector<NamedPoint>{
            {"F1", {0, 0, 0}}, {"F2", {0.1, 0, 0}}, {"F3", {0, 0.1, 0}}, {"F4", {0, 0, 0.1}}});
    std::filesystem::copy_file(folder / "image.mrk.json", folder / "touched.mrk.json");
    const auto kept = [&](const std::string& file, const std::string& command,
                          std::initializer_list<std::string> parts) {
        const std::string bytes = text_of(folder / file);
        expect_refused(livetet(folder, command), parts);
        EXPECT_EQ(text_of(folder / file), bytes) << command;
    };
    write_text(folder / "scene.yaml", held_scene + "output: {file: block.h5}\n");
    kept("block.h5", "solve scene.yaml", {"output.file", "block.h5", "is read", "scene.yaml"});
    write_text(folder / "scene.yaml",
               held_scene + "probes: {points: points.csv, displacements: ./points.csv}\n");
    kept("points.csv", "solve scene.yaml", {"probes.displacements", "points.csv", "is read"});
    write_text(folder / "mask.nii.gz", "a mask");
    write_text(
        folder / "scene.yaml",
        held_scene +
            "loads: [{mask: mask.nii.gz, force_N: [0, 0, 1]}]\nprobes: {points: points.csv}\n");
    for (const std::string read : {"mask.nii.gz", "points.csv", "block.h5", "scene.yaml"})
        kept(read, "solve scene.yaml --json " + read, {"--json " + read, "is read"});
    write_text(folder / "result.h5", "an older result");
    write_text(folder / "result.xdmf", "an older one's");
    for (const std::string written : {"result.h5", "result.xdmf"})
        kept(written, "solve scene.yaml --json " + written,
             {"--json " + written, "written besides"});
    write_text(folder / "tip.json", "a tip");
    write_text(folder / "scene.yaml", held_scene +
                                          "track: {source: press.igs.mha, registration: r.json, "
                                          "tools: [{tool: Stylus, tip: tip.json}]}\n");
    kept("tip.json", "track scene.yaml --json tip.json", {"--json tip.json", "is read"});
    expect_refused(livetet(folder, "track scene.yaml --json nowhere/run.json"),
                   {"nowhere/run.json", "no folder nowhere"});
    kept("press.igs.mha", "record press.igs.mha -o press.igs.mha",
         {"--output press.igs.mha", "is read"});
    kept("press.igs.mha", "calibrate pivot press.igs.mha --tool Sensor -o press.igs.mha",
         {"--output press.igs.mha", ".json"});
    kept("image.mrk.json",
         "register --tracker touched.mrk.json --image image.mrk.json -o image.mrk.json",
         {"--output image.mrk.json", "is read"});
    EXPECT_EQ(
        livetet(folder,
                "register --tracker touched.mrk.json --image image.mrk.json -o registration.json")
            .status,
        0);
    kept("block.h5", "register --tracker touched.mrk.json --image image.mrk.json -o block.h5",
         {"--output block.h5", ".json"});
    write_text(folder / "scene.yaml", held_scene + "gravity_m_per_s2: [0, 0, -1]\n");
    ASSERT_EQ(livetet(folder, "solve scene.yaml").status, 0);
    kept("result.h5", "report result.h5 --no-pictures --json result.h5",
         {"--json result.h5", "is read"});
    kept("result.h5", "report result.h5 -o page.pdf", {"page.pdf", ".html"});
#ifdef LIVETET_IMAGES
    kept("block.h5", "view result.h5 --screenshot block.h5", {"--screenshot block.h5", ".png"});
#endif
}

TEST(BadInput, AGreyImageIsNoMask) {
    const Folder folder;
    write_block(folder / "block.h5");
    LabelImage grey = ball();
    for (std::size_t n = 0; n < grey.values.size(); ++n)
        grey.values[n] = static_cast<std::int32_t>(n % 500);
    write_image(folder / "grey.nii.gz", grey);
    expect_refused(livetet(folder, "mesh block.h5 --fix grey.nii.gz -o m.h5"),
                   {"grey.nii.gz", "looks like a grey image", "expected a mask"});
    write_text(folder / "scene.yaml", "mesh: {file: block.h5}\nfix: [{mask: grey.nii.gz}]\n");
    expect_refused(livetet(folder, "solve scene.yaml"), {"grey.nii.gz", "expected a mask"});
}

TEST(BadInput, ATrackerOfWhichNothingComesLeavesTheGoodResultAlone) {
    const Folder folder;
    write_block(folder / "block.h5");
    FiducialRegistration registration;
    registration.reference_tool = "Reference";
    for (const Vector3& x :
         {Vector3(0, 0, 0), Vector3(0.1, 0, 0), Vector3(0, 0.1, 0), Vector3(0, 0, 0.1)})
        registration.fiducials.push_back({"F", x, x, x, 0, 0});
    write_registration(folder / "registration.json", registration);
    write_text(folder / "result.h5", "something good");
    write_text(folder / "scene.yaml",
               held_scene +
                   "track: {source: \"openigtlink://localhost:9\", registration: "
                   "registration.json, sensors: [{tool: Sensor}]}\n");
    const auto outcome = livetet(folder, "track scene.yaml --for 2");
    EXPECT_EQ(outcome.status, 2);
    EXPECT_NE(outcome.err.find("nothing is kept"), std::string::npos) << outcome.err;
    EXPECT_EQ(text_of(folder / "result.h5"), "something good");
}

TEST(BadInput, WordsForNumbers) {
    const Folder folder;
    expect_refused(livetet(folder, "mesh labels.nii.gz --tets many"),
                   {"--tets: found many, expected a whole number from 100 to 20000000"});
    expect_refused(livetet(folder, "mesh labels.nii.gz --labels 1,3000000000 -o x.h5"),
                   {"--labels: found", "expected a whole number from -2147483648 to 2147483647"});
    expect_refused(livetet(folder, "track scene.yaml --for long"),
                   {"--for: found long, expected a positive number"});
    expect_refused(livetet(folder, "fiducials image.nii.gz --diameter-mm 10 --count 2.5"),
                   {"--count: found 2.5, expected a whole number from 1 to 100"});
    expect_refused(livetet(folder, "warp result.h5 -o out.nii.gz --frame first"),
                   {"--frame: found first, expected a whole number"});
    expect_refused(livetet(folder, "warp result.h5 -o out.nii.gz --time then"),
                   {"--time: found then, expected a number"});
    expect_refused(livetet(folder, "warp result.h5 -o out.nii.gz --rind-mm -1"),
                   {"--rind-mm: found -1, expected 0 to 1000"});
    expect_refused(livetet(folder, "view result.h5 --record v.ogv --rate 1000"),
                   {"--rate: found 1000, expected 1 to 100"});
    expect_refused(livetet(folder, "view result.h5 --record v.ogv --rate nan"),
                   {"--rate: found nan, expected a number"});
    expect_refused(livetet(folder, "track scene.yaml --for nan"),
                   {"--for: found nan, expected a number"});
    expect_refused(livetet(folder, "warp result.h5 -o out.nii.gz --interpolation foo"),
                   {"--interpolation: found foo, expected one of cubic, linear, nearest"});
    expect_refused(livetet(folder, "view result.h5 --colour red"),
                   {"--colour: found red, expected one of displacement,stress"});
    expect_refused(livetet(folder, "serve recording.mha --port 99999"),
                   {"--port: found 99999, expected a whole number from 0 to 65535"});
    expect_refused(livetet(folder, "solve scene.yaml --profile=banana"),
                   {"--profile: found banana, expected no value"});
    expect_refused(livetet(folder, "mesh -o out.h5 labels.nii.gz " + std::string(100000, 'x')),
                   {"not expected"});
}

TEST(BadInput, TheFiguresAreNotWrittenOverWhatIsReadOrWrittenElse) {
    const Folder folder;
    write_block(folder / "block.h5");
    const std::string scene =
        "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\noutput: {file: "
        "out.h5}\n";
    write_text(folder / "scene.yaml", scene + "materials: [{young_Pa: 5000, poisson: 0.4}]\n");
    for (const std::string taken : {"scene.yaml", "block.h5", "out.h5"})
        expect_refused(livetet(folder, "solve scene.yaml --json " + taken),
                       {"--json", taken, "another file"});
    expect_refused(livetet(folder, "solve scene.yaml --json nowhere/x.json"),
                   {"nowhere/x.json", "no folder"});
    EXPECT_FALSE(std::filesystem::exists(folder / "out.h5"));
    write_text(folder / "points.csv", "name,x_mm,y_mm,z_mm\na,1,1,1\n");
    write_text(folder / "twice.yaml", scene +
                                          "materials: [{young_Pa: 5000, poisson: 0.4}]\nprobes: "
                                          "{points: points.csv, displacements: out.h5}\n");
    expect_refused(livetet(folder, "solve twice.yaml"),
                   {"output.file and probes.displacements", "out.h5", "two files"});
}

TEST(BadInput, AKeyWithoutAValueIsRefusedWithItsPlace) {
    const Folder folder;
    write_block(folder / "block.h5");
    const std::string scene =
        "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\n";
    for (const char* value : {"\"\"", "result.vtu"}) {
        write_text(folder / "scene.yaml", scene + "output: {file: " + value + "}\n");
        expect_refused(livetet(folder, "solve scene.yaml"),
                       {"output.file", "ends in .h5, or none", "scene.yaml:3"});
    }
    for (const char* value : {"~", "null", ""}) {
        write_text(folder / "scene.yaml", scene + "output:\n  file: " + value + "\n");
        expect_refused(livetet(folder, "solve scene.yaml"),
                       {"output.file has no value", "scene.yaml:4)"});
        write_text(folder / "scene.yaml", scene + "image: " + value + "\n");
        expect_refused(livetet(folder, "explain scene.yaml"),
                       {"image has no value", "scene.yaml:3)"});
    }
    write_text(folder / "points.csv", "name,x_mm,y_mm,z_mm\na,1,1,1\n");
    write_text(folder / "scene.yaml",
               scene + "probes: {points: points.csv, displacements: \"\"}\n");
    expect_refused(livetet(folder, "solve scene.yaml"), {"probes.displacements", "a file name"});
}

/// Found by changed inputs: a missing bracket makes the rest of a scene the name of a file.
TEST(BadInput, NamesThatAreTooLongForAFile) {
    const Folder folder;
    const std::string name(5000, 'n');
    write_block(folder / "block.h5");
    write_text(folder / "read.yaml", "mesh: {file: " + name + ".h5}\n");
    write_text(
        folder / "written.yaml",
        "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0]}]\noutput: {file: " +
            name + ".h5}\n");
    expect_refused(livetet(folder, "solve read.yaml"), {name, "no such file"});
    expect_refused(livetet(folder, "solve written.yaml"), {name});
    for (const char* command : {"solve NAME.yaml", "report NAME.h5", "warp NAME.h5 -o o.nii.gz",
                                "mesh NAME.nii.gz -o o.h5", "serve NAME.igs.mha"}) {
        std::string with = command;
        with.replace(with.find("NAME"), 4, name);
        expect_refused(livetet(folder, with), {name});
    }
}

TEST(BadInput, AnXServerThatDoesNotStart) {
    const Folder folder;
    const std::string verify = "bench verification --only patch --figure f.png",
                      alone = "env -u DISPLAY PATH=" + folder.path().string();
    expect_refused(livetet(folder, verify, alone),
                   {"f.png: there is no X server", "Xvfb is not installed"});
    for (const std::string does : {"exit 1", "echo 98765 >&3; exec sleep 60"}) {
        write_text(folder / "Xvfb", "#!/bin/sh\n" + does + "\n");
        std::filesystem::permissions(folder / "Xvfb", std::filesystem::perms::owner_all);
        expect_refused(livetet(folder, verify, alone + ":$PATH"),
                       {"f.png: there is no X server",
                        does == "exit 1" ? "Xvfb does not start" : "does not answer"});
    }
}

TEST(BadInput, AFileOfABenchmarkInNoFolderIsRefusedBeforeItsRuns) {
    const Folder folder;
    for (const std::string bench :
         {"verification --figure", "verification --csv", "stability --figure", "scaling --json",
          "convergence --figure", "accuracy --calibration", "savings scene.yaml --json"})
        expect_refused(livetet(folder, "bench " + bench + " nowhere/f.png"),
                       {"nowhere/f.png", "no folder nowhere"});
    expect_refused(livetet(folder, "bench verification --figure ."), {"is a folder"});
}

TEST(BadInput, HelpAndVersionAreNotErrors) {
    const Folder folder;
    EXPECT_EQ(livetet(folder, "--help").status, 0);
    EXPECT_NE(livetet(folder, "--help").out.find("track"), std::string::npos);
    EXPECT_NE(livetet(folder, "track --help").out.find("--every-sample"), std::string::npos);
    EXPECT_NE(livetet(folder, "scene").out.find("young_Pa"), std::string::npos);
    EXPECT_EQ(livetet(folder, "--version").status, 0);
}

TEST(BadInput, ABodyThatIsNotHeldSaysWhichMotionsAreFree) {
    const Folder folder;
    write_block(folder / "block.h5");
    write_text(folder / "free.yaml", "mesh: {file: block.h5}\ngravity_m_per_s2: [0, 0, -9.81]\n");
    expect_refused(livetet(folder, "solve free.yaml"),
                   {"not held", "6 rigid motions", "translation along", "rotation about"});
    write_text(
        folder / "slide.yaml",
        "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0], components: xy}]\n");
    expect_refused(livetet(folder, "solve slide.yaml"),
                   {"1 rigid motion is free", "translation along (0, 0, 1)"});
    EXPECT_FALSE(std::filesystem::exists(folder / "result.h5"));
    // A spring is enough.
    write_text(folder / "soft.yaml",
               "mesh: {file: block.h5}\nfix: [{half_space_mm: [1, 0, 0, 1, 0, 0], "
               "stiffness_N_per_m: 100}]\n");
    EXPECT_EQ(livetet(folder, "solve soft.yaml").status, 0);
}

TEST(BadInput, MaterialsAndFieldsThatCannotBe) {
    const Folder folder;
    write_block(folder / "block.h5");
    write_text(folder / "a.yaml", held_scene + "materials: [{poisson: -1.2}]\n");
    expect_refused(livetet(folder, "solve a.yaml"), {"poisson", "-1.2", "positive definite"});
    write_text(folder / "f.yaml", held_scene + "materials: [{young_Pa: 1e6}, {young_Pa: 1e3}]\n");
    expect_refused(livetet(folder, "solve f.yaml"), {"materials[1].region = 0", "materials[0]"});
    write_text(folder / "g.yaml", held_scene + "materials: [{young_Pa: 1e6}, {region: 7}]\n");
    expect_refused(livetet(folder, "solve g.yaml"), {"materials[1].region = 7", "no cell"});
    write_text(folder / "h.yaml", held_scene + "time: {scheme: newmark, beta: 0.1, gamma: 0.9}\n");
    expect_refused(livetet(folder, "solve h.yaml"), {"time.beta = 0.1", "gamma"});
    write_text(folder / "b.yaml", held_scene + "materials: [{region: 4}]\n");
    expect_refused(livetet(folder, "solve b.yaml"), {"materials", "region"});
    write_text(folder / "c.yaml", held_scene + "output: {fields: [stres]}\n");
    expect_refused(livetet(folder, "solve c.yaml"), {"output.fields", "stres", "von_mises"});
    write_text(folder / "d.yaml", held_scene + "loads: [{group: lid, pressure_Pa: 10}]\n");
    expect_refused(livetet(folder, "solve d.yaml"), {"loads[0].group", "lid"});
    write_text(folder / "e.yaml", held_scene + "formulation: mixed\nmaterials: [{poisson: 0}]\n");
    expect_refused(livetet(folder, "solve e.yaml"), {"poisson", "mixed"});
}

TEST(BadInput, StandardStreamsThatAreFullOrClosed) {
    const Folder folder;
    write_block(folder / "block.h5");
    write_text(folder / "scene.yaml", held_scene);
    // What is printed goes where the script says, not to the helper's files.
    write_text(folder / "full", "exec \"$@\" >/dev/full\n");
    write_text(folder / "closed", "exec \"$@\" <&- >&- 2>&-\n");
    for (const char* command : {"scene", "explain scene.yaml"})
        expect_refused(livetet(folder, command, "sh full"), {"No space left on device"});
    expect_refused(livetet(folder, "solve scene.yaml", "sh full"), {"standard output"});
    EXPECT_EQ(livetet(folder, "solve scene.yaml", "sh closed").status, 0);
    ASSERT_EQ(livetet(folder, "solve scene.yaml -ksp_view", "sh closed").status, 0);
    EXPECT_EQ(text_of(folder / "result.h5").find("KSP Object"), std::string::npos)
        << "what is printed is not the next file's";
    EXPECT_EQ(livetet(folder, "solve none.yaml", "sh closed").status, 2);
}

}  // namespace
}  // namespace livetet
