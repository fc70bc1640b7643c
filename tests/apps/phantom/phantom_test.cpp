#ifdef LIVETET_IMAGES
#include "apps/phantom/phantom.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/phantom/phantom_shape.hpp"
#include "apps/phantom/phantom_truth.hpp"
#include "apps/scene/scene.hpp"
#include "base/error.hpp"
#include "base/file.hpp"
#include "geometry/pivot.hpp"
#include "io/image_file.hpp"
#include "io/sequence_file.hpp"
#include "solvers/parallel/petsc_session.hpp"
#include "tracking/poses.hpp"

namespace livetet {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using nlohmann::json;

fs::path fresh_folder() {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    const fs::path folder = fs::path(testing::TempDir()) / "livetet_phantom" / test->name();
    fs::remove_all(folder);
    fs::create_directories(folder);
    return folder;
}

const PhantomImages& images() {
    static const PhantomImages made = make_phantom_images(0.002, 1);
    return made;
}

Vector3d centre_of(const LabelImage& image, int i, int j, int k) {
    return (image.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>();
}

template <class T, class Visit>
void for_each_voxel(const Image<T>& image, const Visit& visit) {
    for (int k = 0; k < image.size[2]; ++k)
        for (int j = 0; j < image.size[1]; ++j)
            for (int i = 0; i < image.size[0]; ++i) visit(i, j, k);
}

Truth a_truth() {
    Truth truth = true_motion(phantom_tracker({}), {{}, {{0, {}}, {0.5, {}}, {5, {}}}});
    for (const NamedPoint& p : phantom::targets()) {
        TruthTarget target{p.name, p.position, {}};
        for (const double depth : truth.depths)
            target.displacement.push_back(depth * depth * Vector3d(1, -2, 3));
        truth.targets.push_back(target);
    }
    truth.provenance = "a test";
    return truth;
}

TEST(Phantom, TheOrganHasTheSizeAndVolumeOfItsDescription) {
    const LabelImage& labels = images().labels;
    Vector3d low = Vector3d::Constant(1), high = -low, sum = Vector3d::Zero();
    double voxels = 0, left = 0;
    for_each_voxel(labels, [&](int i, int j, int k) {
        if (labels.at(i, j, k) == 0) return;
        const Vector3d x = centre_of(labels, i, j, k);
        low = low.cwiseMin(x);
        high = high.cwiseMax(x);
        sum += x;
        ++voxels;
        left += x.x() < phantom::organ_centre().x();
    });
    const Vector3d extent = 1e3 * (high - low) + Vector3d::Constant(2);
    EXPECT_NEAR(extent.x(), 150, 4);
    EXPECT_NEAR(extent.y(), 110, 4);
    EXPECT_NEAR(extent.z(), 80, 4);
    EXPECT_LT((0.5 * (low + high) - phantom::organ_centre()).norm(), 0.002);
    EXPECT_NEAR(voxels * 8e-9, 0.57e-3, 0.02e-3);  // m^3
    EXPECT_LT(left / voxels, 0.4) << "the right lobe is the large one";
    // A margin all round.
    EXPECT_GT(1e3 * (low - centre_of(labels, 0, 0, 0)).minCoeff(), 14);
    EXPECT_GT(
        1e3 * (centre_of(labels, labels.size[0] - 1, labels.size[1] - 1, labels.size[2] - 1) - high)
                  .minCoeff(),
        14);
}

TEST(Phantom, LabelsMaskAndImageShareTheirGridAndAgree) {
    const PhantomImages& made = images();
    EXPECT_EQ(made.labels.size, made.image.size);
    EXPECT_EQ(made.fixed_mask.size, made.image.size);
    EXPECT_EQ(made.labels.ras_from_voxel, made.image.ras_from_voxel);
    EXPECT_EQ(made.fixed_mask.ras_from_voxel, made.image.ras_from_voxel);
    double inside = 0, organ = 0, beside = 0, others = 0, held = 0;
    for_each_voxel(made.labels, [&](int i, int j, int k) {
        const Vector3d x = centre_of(made.labels, i, j, k);
        if (made.labels.at(i, j, k))
            inside += made.image.at(i, j, k), ++organ;
        else if (phantom::body_distance(x) < -0.005)
            beside += made.image.at(i, j, k), ++others;
        if (!made.fixed_mask.at(i, j, k)) return;
        ++held;
        EXPECT_LE(std::abs(phantom::organ_distance(x)), 0.004);
        EXPECT_LT(x.z(), phantom::organ_centre().z() + 0.004);
    });
    EXPECT_GT(inside / organ, 1.6 * beside / others) << "the organ stands out";
    EXPECT_GT(held, 1000);
}

TEST(Phantom, TheSensorLiesOnTheUpperSideAwayFromWhatIsHeld) {
    EXPECT_NEAR(phantom::organ_distance(phantom::sensor_place()), 0, 1e-6);
    EXPECT_GT(phantom::organ_normal(phantom::sensor_place()).z(), 0.9);
    EXPECT_FALSE(phantom::is_held(phantom::sensor_place()));
    EXPECT_TRUE(phantom::is_held(phantom::reference_place()));
}

TEST(Phantom, FiducialsLieOutsideTheOrganNotInOnePlaneNoTwoDistancesAlike) {
    const auto fiducials = phantom::fiducials();
    ASSERT_EQ(fiducials.size(), 5u);
    Eigen::Matrix<double, 3, 5> places;
    std::vector<double> distances;
    for (int i = 0; i < 5; ++i) {
        EXPECT_EQ(fiducials[i].name, fmt::format("F{}", i + 1));
        EXPECT_GT(phantom::organ_distance(fiducials[i].position),
                  phantom::marker_radius + phantom::marker_casing);
        EXPECT_NEAR(phantom::body_distance(fiducials[i].position), 0, 1e-6);
        places.col(i) = fiducials[i].position;
        for (int k = 0; k < i; ++k) distances.push_back((places.col(i) - places.col(k)).norm());
    }
    const Eigen::Matrix<double, 3, 5> about_mean = places.colwise() - places.rowwise().mean();
    EXPECT_GT(about_mean.jacobiSvd().singularValues()[2], 0.03) << "thickness of the cloud, m";
    std::sort(distances.begin(), distances.end());
    for (std::size_t i = 1; i < distances.size(); ++i)
        EXPECT_GT(distances[i] - distances[i - 1], 0.0005);
}

TEST(Phantom, TargetsAreManyAndWellInside) {
    const auto targets = phantom::targets();
    EXPECT_GE(targets.size(), 30u);
    for (const NamedPoint& t : targets)
        EXPECT_LE(phantom::organ_distance(t.position), -0.005) << t.name;
}

TEST(Phantom, TheOrganMovesAtASurgeonsSpeed) {
    const SimulatedTrackerOptions tracker = phantom_tracker({});
    double speed = 0, turn = 0;
    constexpr double dt = 0.01;
    for (double t = 0; t < press_duration_s(tracker); t += dt) {
        const auto before = true_tracker_from_image(tracker, t),
                   after = true_tracker_from_image(tracker, t + dt);
        const Vector3d centre = phantom::organ_centre();
        speed = std::max(speed, (after * centre - before * centre).norm() / dt);
        turn = std::max(
            turn, Eigen::AngleAxisd(after.rotation * before.rotation.transpose()).angle() / dt);
    }
    EXPECT_GT(1e3 * speed, 30);
    EXPECT_LT(1e3 * speed, 50);
    EXPECT_GT(turn * 180 / M_PI, 20);
    EXPECT_LT(turn * 180 / M_PI, 32);
}

TEST(Phantom, RecordingsHoldTheirToolsAndThePivotGivesTheTip) {
    const PhantomOptions options{.position_noise_mm = 0, .rotation_noise_deg = 0};
    const PhantomRecordings recordings = record_phantom(options, phantom::fiducials());
    EXPECT_EQ(recordings.pivot.tools, std::vector<std::string>{"Stylus"});
    EXPECT_EQ(recordings.fiducials.tools, (std::vector<std::string>{"Reference", "Stylus"}));
    EXPECT_EQ(recordings.press.tools, (std::vector<std::string>{"Reference", "Sensor"}));
    const Truth truth = true_motion(phantom_tracker(options), recordings.press);
    ASSERT_EQ(truth.samples.size(), recordings.press.samples.size());
    // Without noise the sensor is where the truth says, at rest and pressed.
    double deepest = 0;
    for (std::size_t i = 0; i < truth.samples.size(); ++i) {
        const TruthSample& s = truth.samples[i];
        const Vector3d expected =
            s.tracker_from_image * (truth.sensor_rest + s.depth * truth.press_direction).eval();
        EXPECT_LT((recordings.press.samples[i].poses[1].translation - expected).norm(), 1e-9);
        deepest = std::max(deepest, s.depth);
    }
    EXPECT_NEAR(deepest, 0.015, 1e-6);
    const auto poses = usable_poses(recordings.pivot, "Stylus");
    for (const auto& pose : poses)
        EXPECT_LT((pose * truth.tip_in_tool - truth.pivot_in_tracker).norm(), 1e-9);
}

TEST(Phantom, NoiseDiffersBetweenRecordingsAndSeeds) {
    const auto error_of = [](std::uint64_t seed, bool press) {
        const PhantomRecordings noisy = record_phantom({.seed = seed}, phantom::fiducials());
        const PhantomRecordings clean = record_phantom(
            {.seed = seed, .position_noise_mm = 0, .rotation_noise_deg = 0}, phantom::fiducials());
        return Vector3d(press ? noisy.press.samples[0].poses[0].translation -
                                    clean.press.samples[0].poses[0].translation
                              : noisy.fiducials.samples[0].poses[0].translation -
                                    clean.fiducials.samples[0].poses[0].translation);
    };
    EXPECT_GT((error_of(1, true) - error_of(1, false)).norm(), 1e-6);
    EXPECT_GT((error_of(1, true) - error_of(2, true)).norm(), 1e-6);
    EXPECT_EQ(error_of(3, true), error_of(3, true));
}

TEST(Truth, InterpolatesLinearlyFromZeroAndStaysBeyondTheDeepest) {
    Truth truth = a_truth();
    truth.depths = {0.003, 0.006};
    TruthTarget target{"T", {}, {{1, 0, 0}, {1, 4, 0}}};
    EXPECT_EQ(displacement_of(truth, target, -1), Vector3d(0, 0, 0));
    EXPECT_EQ(displacement_of(truth, target, 0), Vector3d(0, 0, 0));
    EXPECT_LT((displacement_of(truth, target, 0.0015) - Vector3d(0.5, 0, 0)).norm(), 1e-12);
    EXPECT_LT((displacement_of(truth, target, 0.0045) - Vector3d(1, 2, 0)).norm(), 1e-12);
    EXPECT_EQ(displacement_of(truth, target, 0.006), Vector3d(1, 4, 0));
    EXPECT_EQ(displacement_of(truth, target, 1), Vector3d(1, 4, 0));
}

TEST(Truth, ComesBackAsItWasWritten) {
    const fs::path file = fresh_folder() / "truth.json";
    const Truth truth = a_truth();
    write_truth(file, truth);
    const Truth read = read_truth(file);
    EXPECT_EQ(read.provenance, truth.provenance);
    EXPECT_LT((read.tip_in_tool - truth.tip_in_tool).norm(), 1e-12);
    EXPECT_LT((read.press_direction - truth.press_direction).norm(), 1e-12);
    EXPECT_NEAR(read.patch_radius, truth.patch_radius, 1e-12);
    ASSERT_EQ(read.depths.size(), truth.depths.size());
    ASSERT_EQ(read.targets.size(), truth.targets.size());
    ASSERT_EQ(read.samples.size(), truth.samples.size());
    for (std::size_t i = 0; i < truth.targets.size(); ++i) {
        EXPECT_EQ(read.targets[i].name, truth.targets[i].name);
        EXPECT_LT((read.targets[i].position - truth.targets[i].position).norm(), 1e-12);
        for (const double depth : {0.002, 0.009, 0.014})
            EXPECT_LT((displacement_of(read, read.targets[i], depth) -
                       displacement_of(truth, truth.targets[i], depth))
                          .norm(),
                      1e-12);
    }
    for (std::size_t i = 0; i < truth.samples.size(); ++i) {
        EXPECT_EQ(read.samples[i].time_s, truth.samples[i].time_s);
        EXPECT_NEAR(read.samples[i].depth, truth.samples[i].depth, 1e-12);
        const Vector3d x = phantom::organ_centre();
        EXPECT_LT((read.samples[i].tracker_from_image * x - truth.samples[i].tracker_from_image * x)
                      .norm(),
                  1e-12);
    }
}

TEST(Truth, HostileFilesAreRefusedNamingFileAndKey) {
    const fs::path file = fresh_folder() / "truth.json";
    write_truth(file, a_truth());
    const json good = json::parse(read_text_file(file));
    const auto refused = [&](const std::string& text, const std::string& word) {
        write_text_file(file, text);
        try {
            (void)read_truth(file);
            ADD_FAILURE() << "accepted: " << word;
        } catch (const Error& e) {
            const std::string message = e.what();
            EXPECT_NE(message.find("truth.json"), std::string::npos) << message;
            EXPECT_NE(message.find(word), std::string::npos) << message;
            EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        }
    };
    const auto with = [&](const char* pointer, const json& value) {
        json bad = good;
        bad[json::json_pointer(pointer)] = value;
        return bad.dump();
    };
    refused("", "JSON");
    refused(good.dump().substr(0, 500), "JSON");
    refused("[1, 2]", "format");
    refused(with("/format", "something else"), "format");
    refused(with("/press/depths_mm", {3, 3, 9, 12, 15}), "press.depths_mm[1]");
    refused(with("/press/depths_mm", json::array()), "depths_mm");
    refused(with("/press/direction", {0, 0, 2}), "press.direction");
    refused(with("/tool/tip_mm", {1, 2}), "tool.tip_mm");
    refused(with("/targets", json::array()), "targets");
    refused(with("/targets/1/name", "T01"), "T01");
    refused(with("/targets/0/displacements_mm/2", {1, "x", 3}),
            "targets[0].displacements_mm[2][1]");
    refused(with("/targets/0/displacements_mm", json::array()), "T01");
    refused(with("/samples/1/time_s", -1), "samples[1].time_s");
    refused(with("/samples/1/tracker_from_image_mm", std::vector<double>(16, 1)),
            "samples[1].tracker_from_image_mm");
    json bad = good;
    bad["press"].erase("sensor_rest_mm");
    refused(bad.dump(), "press.sensor_rest_mm");
}

TEST(Phantom, ImpossibleOptionsAreRefusedByName) {
    for (const auto& [options, name] :
         {std::pair{PhantomOptions{.spacing_mm = 0}, "spacing-mm"},
          std::pair{PhantomOptions{.position_noise_mm = -1}, "position-noise-mm"},
          std::pair{PhantomOptions{.rate_Hz = std::nan("")}, "rate-Hz"},
          std::pair{PhantomOptions{.truth_tets = 0}, "truth-tets"}}) {
        try {
            check_options(options);
            ADD_FAILURE() << name;
        } catch (const Error& e) {
            EXPECT_NE(std::string(e.what()).find(name), std::string::npos) << e.what();
        }
    }
}

TEST(Phantom, TheSameSeedGivesTheSameBytesAndTheFolderHoldsTogether) {
    const PetscSession session(
        "phantom_test", {});  // MPI starts once in a process: all that solves is in this test
    const fs::path folder = fresh_folder();
    const PhantomOptions options{.seed = 5, .spacing_mm = 3, .truth_tets = 3000};
    const auto names = write_phantom(folder / "one", options);
    PhantomOptions quicker = options;  // what the truth's mesh gives is not compared
    quicker.truth_tets = 2000;
    (void)write_phantom(folder / "two", quicker);
    for (const fs::path& name : names) {
        // Gmsh does not make the same mesh twice, so the pressed organ differs a little.
        if (name == "truth/truth.json" || name == "sweep.igs.mha") continue;
        EXPECT_EQ(read_text_file(folder / "one" / name), read_text_file(folder / "two" / name))
            << name;
    }
    std::size_t files = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder / "one"))
        files += entry.is_regular_file();
    EXPECT_EQ(files, names.size()) << "nothing is left lying about";
    EXPECT_NE(make_phantom_images(0.003, 5).image.values,
              make_phantom_images(0.003, 6).image.values);

    // The truth: under the patch things move, far away they hardly do, and never more than the
    // patch.
    const Truth truth = read_truth(folder / "one" / "truth" / "truth.json");
    int moved = 0, resting = 0;
    for (const TruthTarget& t : truth.targets) {
        const double u = 1e3 * displacement_of(truth, t, 0.015).norm();
        moved += u > 3;
        resting += u < 1;
        EXPECT_LT(u, 15.5) << t.name;
    }
    EXPECT_GE(moved, 10);
    EXPECT_GE(resting, 5);
    EXPECT_GT(displacement_of(truth, truth.targets.front(), 0.015).dot(truth.press_direction),
              0.009);
    EXPECT_EQ(read_sequence(folder / "one" / "press.igs.mha").samples.size(), truth.samples.size());
    EXPECT_GT(read_sequence(folder / "one" / "sweep.igs.mha").samples.size(), 200U);

    // On one mesh the truth is the same twice.
    const MeshHierarchy hierarchy = mesh_for_truth(images().labels, images().fixed_mask, 1500);
    Truth once = a_truth(), twice = a_truth();
    solve_truth(hierarchy, phantom::targets(), once);
    solve_truth(hierarchy, phantom::targets(), twice);
    for (std::size_t i = 0; i < once.targets.size(); ++i)
        EXPECT_EQ(once.targets[i].displacement, twice.targets[i].displacement)
            << once.targets[i].name;

    // The scenes are scenes.
    const Scene track = load_scene(folder / "one" / "scene.yaml"),
                solve = load_scene(folder / "one" / "solve.yaml"),
                sweep = load_scene(folder / "one" / "sweep.yaml");
    ASSERT_TRUE(sweep.deform.has_value());
    const Scene resection = load_scene(folder / "one" / "resection.yaml");
    ASSERT_TRUE(resection.track.has_value());
    EXPECT_TRUE(has_blades(*resection.track));
    EXPECT_NO_THROW(tool_index(read_sequence(folder / "one" / "resection.igs.mha"), "Scalpel"));
    ASSERT_TRUE(track.track.has_value());
    EXPECT_EQ(track.time.scheme, TimeScheme::newmark);
    EXPECT_EQ(track.materials.front().young_Pa, Material{}.young_Pa);
    EXPECT_NEAR(solve.drive.at(0).displacement_mm.norm(), 15, 0.01);
}

TEST(Phantom, AFolderThatCannotBeMadeLeavesNothing) {
    const fs::path file = fresh_folder() / "in_the_way";
    write_text_file(file, "a file");
    EXPECT_THROW((void)write_phantom(file, {}), Error);
    EXPECT_EQ(read_text_file(file), "a file");
    EXPECT_THROW((void)write_phantom(file / "below", {}), Error);
}

}  // namespace
}  // namespace livetet
#endif
