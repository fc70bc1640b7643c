#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "apps/commands/own_weight.hpp"
#include "geometry/umeyama.hpp"
#include "io/fiducial_file.hpp"
#include "io/registration_file.hpp"
#include "io/sequence_file.hpp"
#include "mesh/tet_mesh.hpp"
#include "support/program.hpp"
#include "tracking/dwell.hpp"
#include "tracking/live_registration.hpp"

namespace livetet {
namespace {

using nlohmann::json;
using test::as_assembled;
using test::Folder;
using test::livetet;
using test::own_weight_iterations;
using test::text_of;
using test::write_text;

/// Inputs that nobody here made; see the README of the folder that LIVETET_DATA names.
#define LIVETET_NEEDS_DATA()                                                                  \
    const char* data_folder = std::getenv("LIVETET_DATA");                                    \
    if (!data_folder) GTEST_SKIP() << "LIVETET_DATA does not name the folder of real inputs"; \
    const std::string data = data_folder

/// Meshes a real liver, presses its mesh by 10 mm from above with its lowest tenth held, and lets
/// it hang.
void mesh_and_solve(const std::string& input, const std::string& options, double volume_ml) {
    const Folder folder;
    const auto meshed = livetet(
        folder, "mesh '" + input + "' -o liver.h5 --tets 20000 --json mesh.json " + options);
    ASSERT_EQ(meshed.status, 0) << meshed.err;
    const json finest = json::parse(text_of(folder / "mesh.json"))["levels"][0];
    EXPECT_NEAR(finest["volume_ml"].get<double>(), volume_ml, 0.01 * volume_ml);
    EXPECT_NEAR(finest["tets"].get<double>(), 20000, 4000);
    EXPECT_GT(finest["min_dihedral_deg"].get<double>(), 5);
    EXPECT_GT(finest["min_radius_ratio"].get<double>(), 0.05);

    const Eigen::AlignedBox3d box = test::span_of_mesh(folder / "liver.h5");
    const Vector3 low = box.min(), high = box.max();
    const double height = high[2] - low[2];
    write_text(
        folder / "press.yaml",
        fmt::format(
            "mesh: {{file: liver.h5}}\nfix: [{{half_space_mm: [0, 0, {}, 0, 0, 1]}}]\n"
            "drive: [{{half_space_mm: [0, 0, {}, 0, 0, -1], displacement_mm: [0, 0, -10]}}]\n",
            low[2] + 0.1 * height, high[2] - 0.05 * height));
    const auto solved = livetet(folder, "solve press.yaml --json solve.json");
    ASSERT_EQ(solved.status, 0) << solved.err << solved.out;
    const json report = json::parse(text_of(folder / "solve.json"));
    EXPECT_TRUE(report["converged"].get<bool>());
    EXPECT_GE(report["largest_displacement_mm"].get<double>(), 10 - 1e-9);
    EXPECT_LT(report["largest_displacement_mm"].get<double>(), 20);
    EXPECT_LE(own_weight_iterations(folder, "liver.h5", "coarse: rediscretised"), 20);
    EXPECT_LE(own_weight_iterations(folder, "liver.h5", as_assembled), 15);
    EXPECT_LE(own_weight_iterations(folder, "liver.h5", "coarse: galerkin"), 15);
}

TEST(RealData, AHumanLiversSurfaceGoesThroughMeshAndSolve) {
    LIVETET_NEEDS_DATA();
    mesh_and_solve(data + "/liver/OpenHELP_Liver.stl", "", 1817.7);
}

TEST(RealData, ALiversLabelMapGoesThroughMeshAndSolve) {
    LIVETET_NEEDS_DATA();
    mesh_and_solve(data + "/liver/cgal_liver_labels.nii.gz", "--labels 1", 1605.2);
}

/// Labels of the CT or of the liver map to a valid hierarchy whose finest level has the voxels'
/// volume.
json mesh_labels(const std::string& input, const std::string& options) {
    const Folder folder;
    const auto meshed =
        livetet(folder, "mesh '" + input + "' -o organ.h5 --json mesh.json " + options);
    EXPECT_EQ(meshed.status, 0) << meshed.err;
    if (meshed.status != 0) return {};
    const json report = json::parse(text_of(folder / "mesh.json"));
    for (const json& level : report["levels"])
        EXPECT_GE(level["min_dihedral_deg"].get<double>(), 5);
    const double voxels_ml = report["image"]["body_ml"];
    EXPECT_NEAR(report["levels"][0]["volume_ml"].get<double>(), voxels_ml, 0.01 * voxels_ml);
    for (const json& region : report.value("regions", json::array())) {
        const double voxels = region["voxels_ml"];
        EXPECT_NEAR(region["tets_ml"].get<double>(), voxels, 0.05 * voxels + 0.05) << region;
    }
    return report;
}

TEST(RealData, ACtsLiverLabelIsMeshed) {
    LIVETET_NEEDS_DATA();
    mesh_labels(data + "/ct/totalseg_example_seg.nii.gz", "--labels 5 --tets 20000");
}

TEST(RealData, ALiversLabelMapIsMeshedWithItsTumours) {
    LIVETET_NEEDS_DATA();
    const json report = mesh_labels(data + "/liver/cgal_liver_labels.nii.gz", "--tets 20000");
    EXPECT_EQ(report["regions"].size(), 3u);
}

/// No organ: thin ears beside the head, whose gaps a coarse mesh closes.
TEST(RealData, AnElephantWithThinEarsTakesMultigridTwiceAsLong) {
    LIVETET_NEEDS_DATA();
    const Folder folder;
    const auto meshed = livetet(
        folder, "mesh '" + data + "/surfaces/elephant.off' -o liver.h5 --tets 60000 --space ras");
    ASSERT_EQ(meshed.status, 0) << meshed.err;
    EXPECT_LE(own_weight_iterations(folder, "liver.h5", "coarse: rediscretised"), 45);
    EXPECT_LE(own_weight_iterations(folder, "liver.h5", as_assembled), 35);
    EXPECT_LE(own_weight_iterations(folder, "liver.h5", "coarse: galerkin"), 23);
    EXPECT_LE(own_weight_iterations(folder, "liver.h5", "coarse: galerkin, smoothing_steps: 12"),
              18)
        << "for who counts iterations: it takes half as long again";
}

const std::vector<int> touched_order{1, 2, 3, 4, 5, 6, 7, 8};

/// The recorded phantom's landmarks in this order, metres; written to landmarks.mrk.json, too.
std::vector<NamedPoint> write_landmarks(const Folder& folder, const json& known,
                                        const std::vector<int>& order) {
    std::vector<NamedPoint> landmarks;
    for (const int i : order) {
        const auto mm = known["landmarks_in_phantom"][std::to_string(i)].get<std::vector<double>>();
        landmarks.push_back({std::to_string(i), Vector3(mm[0], mm[1], mm[2]) / 1e3});
    }
    write_fiducials(folder / "landmarks.mrk.json", landmarks);
    return landmarks;
}

/// `livetet register` of the recorded phantom by the landmarks that write_landmarks wrote.
auto register_landmarks(const Folder& folder, const std::string& data, const json& known,
                        const std::string& options) {
    const auto tip = known["stylus_from_tip"]["translation"].get<std::vector<double>>();
    return livetet(
        folder, fmt::format("register --tracker "
                            "'{}/tracker/EightLandmarkPointsTrackedForPhantomRegistration.igs.mha' "
                            "--reference Reference --tip-mm {} {} {} --image landmarks.mrk.json {}",
                            data, tip[0], tip[1], tip[2], options));
}

/// Known answers: FRE 0.341 mm, leave-one-out 0.407 mm RMS; registered on landmarks 1 to 4 and
/// tested on 5 to 8, after the phantom was turned over: 138 to 165 mm wrong in the tracker's
/// frame, 1.02 to 1.24 mm by the reference sensor.
TEST(RealData, ARealTrackersLandmarksRegisterAndTheReferenceSensorCarriesThem) {
    LIVETET_NEEDS_DATA();
    const std::string recording =
        data + "/tracker/EightLandmarkPointsTrackedForPhantomRegistration.igs.mha";
    const json known = json::parse(text_of(data + "/tracker/known_answers.json"));
    const Folder folder;
    const std::vector<NamedPoint> landmarks = write_landmarks(folder, known, touched_order);
    std::string windows;
    std::vector<FrameWindow> frames;
    for (const int i : touched_order) {
        const auto w = known["dwell_frames"][std::to_string(i)].get<std::vector<std::size_t>>();
        windows += fmt::format("{}{}:{}", i == 1 ? "" : ",", w[0], w[1]);
        frames.push_back({w[0], w[1]});
    }
    const auto tip = known["stylus_from_tip"]["translation"].get<std::vector<double>>();
    const auto outcome =
        register_landmarks(folder, data, known, "--dwells " + windows + " -o registration.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const FiducialRegistration registration = read_registration(folder / "registration.json");
    EXPECT_NEAR(1e3 * registration.fre, 0.341, 0.005);
    double squares = 0;
    for (const RegisteredFiducial& f : registration.fiducials)
        squares += f.leave_one_out * f.leave_one_out / 8;
    EXPECT_NEAR(1e3 * std::sqrt(squares), 0.407, 0.005);

    // PLUS's own registration of the same phantom, the other way round: within 0.05 degrees and
    // 0.25 mm.
    const json& rows = known["reference_from_phantom_by_plus"]["matrix_rows"];
    SimilarityTransform<Base, ImageFrame> by_plus;
    for (int i = 0; i < 3; ++i) {
        for (int k = 0; k < 3; ++k) by_plus.rotation(i, k) = rows[i][k].get<double>();
        by_plus.translation[i] = rows[i][3].get<double>() / 1e3;
    }
    const auto ours = registration.image_from_base.inverse();
    EXPECT_NEAR(ours.scale, 1, 1e-9);
    const Eigen::AngleAxisd turn(ours.rotation.transpose() * nearest_rotation(by_plus.rotation));
    EXPECT_LT(turn.angle() * 180 / M_PI, 0.05);
    EXPECT_LT(1e3 * (ours.translation - by_plus.translation).norm(), 0.25);
    EXPECT_FALSE(registration.outlier);

    // 1 to 4 before, 5 to 8 after the phantom was turned over.
    RigidTransform<Tool, Tip> tool_from_tip;
    tool_from_tip.translation = Vector3(tip[0], tip[1], tip[2]) / 1e3;
    DwellOptions options;
    options.reference = "Reference";
    const auto dwells = dwells_in_windows(read_sequence(recording), tool_from_tip, frames, options);
    std::vector<Vector3> in_tracker, in_reference, in_image;
    for (int i = 0; i < 4; ++i) {
        in_tracker.push_back(dwells[i].tip_in_tracker);
        in_reference.push_back(*dwells[i].tip_in_reference);
        in_image.push_back(landmarks[i].position);
    }
    const PointFit by_tracker = fit_points(in_tracker, in_image, Scaling::rigid),
                   by_reference = fit_points(in_reference, in_image, Scaling::rigid);
    for (int i = 4; i < 8; ++i) {
        EXPECT_NEAR(1e3 * (by_tracker * dwells[i].tip_in_tracker - landmarks[i].position).norm(),
                    151.5, 14.5);
        EXPECT_NEAR(
            1e3 * (by_reference * *dwells[i].tip_in_reference - landmarks[i].position).norm(), 1.13,
            0.13);
    }
}

TEST(RealData, ARealTrackersDwellsAreFoundWithoutBeingNamed) {
    LIVETET_NEEDS_DATA();
    const json known = json::parse(text_of(data + "/tracker/known_answers.json"));
    const Folder folder;
    write_landmarks(folder, known, touched_order);
    const auto outcome = register_landmarks(folder, data, known, "-o registration.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_LT(1e3 * read_registration(folder / "registration.json").fre, 0.4);
}

/// Of 40,320 orders the one in which they were touched fits, and the next best does not.
TEST(RealData, ARealTrackersLandmarksFindTheirOrder) {
    LIVETET_NEEDS_DATA();
    const json known = json::parse(text_of(data + "/tracker/known_answers.json"));
    const Folder folder;
    write_landmarks(folder, known, {4, 7, 1, 8, 2, 6, 3, 5});
    const auto outcome = register_landmarks(folder, data, known, "--any-order");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("order        4, 7, 1, 8, 2, 6, 3, 5"), std::string::npos)
        << outcome.out;
}

/// 152 border edges, 25 non-manifold ones: repaired or refused, within seconds, never a hang.
TEST(RealData, ASurfaceThatIsNotManifoldEndsWithAMeshOrAClearRefusal) {
    LIVETET_NEEDS_DATA();
    const Folder folder;
    const auto outcome = livetet(
        folder, "mesh '" + data +
                    "/surfaces/sofaenv_liver_visual_NONMANIFOLD.stl' -o liver.h5 --tets 10000");
    EXPECT_TRUE(outcome.status == 0 || outcome.status == 2) << outcome.err;
    EXPECT_EQ(outcome.status == 0, std::filesystem::exists(folder / "liver.h5"));
}

}  // namespace
}  // namespace livetet
