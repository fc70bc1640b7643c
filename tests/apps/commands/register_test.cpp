#include <gtest/gtest.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "geometry/error_ellipsoid.hpp"
#include "geometry/registration_covariance.hpp"
#include "geometry/registration_error.hpp"
#include "io/fiducial_file.hpp"
#include "io/hierarchy_file.hpp"
#include "io/points_csv.hpp"
#include "io/registration_file.hpp"
#include "io/sequence_file.hpp"
#include "io/tip_file.hpp"
#include "support/program.hpp"
#include "support/shapes.hpp"
#include "tracking/dwell.hpp"
#include "tracking/poses.hpp"
#include "tracking/simulated_tracker.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;

/// Fiducials round a block of 200 x 100 x 100 mm, touched with a normal error of `noise` metres an
/// axis.
struct TouchedFiducials {
    Folder folder;
    RigidTransform<Tracker, ImageFrame> tracker_from_image{rotation_of_vector({0.7, -0.4, 1.1}),
                                                           {0.3, 0.1, -0.2}};
    std::vector<NamedPoint> image, tracker;
    std::mt19937_64 engine{5};

    explicit TouchedFiducials(double noise) {
        const Vector3 places[] = {{-0.02, 0, 0},      {0.22, 0.01, 0.03},  {0.1, 0.13, 0.02},
                                  {0.06, 0.05, 0.14}, {0.15, -0.03, 0.08}, {0.0, 0.11, 0.09}};
        for (int i = 0; i < 6; ++i) {
            image.push_back({fmt::format("F{}", i + 1), places[i]});
            tracker.push_back({image.back().name, touch(places[i], noise)});
        }
    }
    Vector3 touch(const Vector3& place, double noise) {
        std::normal_distribution<double> normal(0, 1);
        return tracker_from_image * place +
               noise * Vector3(normal(engine), normal(engine), normal(engine));
    }
    test::Outcome run(const std::string& options = "") {
        write_fiducials(folder / "image.mrk.json", image);
        write_fiducials(folder / "tracker.mrk.json", tracker);
        return livetet(
            folder,
            "register --tracker tracker.mrk.json --image image.mrk.json -o registration.json " +
                options);
    }
    FiducialRegistration registration() const {
        return read_registration(folder / "registration.json");
    }
    /// The error of the registration at a place in the image, metres.
    double error_at(const Vector3& place) const {
        return (registration().image_from_base * (tracker_from_image * place) - place).norm();
    }
};

TEST(Register, FindsTheOrderOfFiducialsTouchedInAnother) {
    TouchedFiducials t(0.0003);
    std::swap(t.tracker[0], t.tracker[4]);
    std::swap(t.tracker[2], t.tracker[3]);
    expect_refused(t.run(), {"tracker.mrk.json", "5, 2, 4, 3, 1, 6", "--any-order"});
    const auto outcome = t.run("--any-order");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("order        5, 2, 4, 3, 1, 6"), std::string::npos) << outcome.out;
    EXPECT_LT(t.error_at({0.1, 0.05, 0.05}), 0.0005);
    EXPECT_LT((t.registration().fiducials[0].in_tracker - t.tracker[4].position).norm(), 1e-12);
}

TEST(Register, MatchesByNameWhereAFiducialWasNotTouched) {
    TouchedFiducials t(0);
    t.image.resize(4);
    t.tracker.resize(4);
    t.tracker.erase(t.tracker.begin() + 1);  // F1, F3, F4
    const auto outcome = t.run();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("3 fiducials are matched by name"), std::string::npos);
    EXPECT_NE(outcome.err.find(": F2"), std::string::npos) << outcome.err;
    ASSERT_EQ(t.registration().fiducials.size(), 3u);
    EXPECT_EQ(t.registration().fiducials[1].name, "F3");
    EXPECT_LT(t.error_at({0.1, 0.05, 0.05}), 1e-9);
    t.tracker[1].name = "Third";
    expect_refused(t.run(), {"3 fiducials", "has 4", "2 have the same names"});
    t.tracker = {t.tracker[0], t.tracker[2]};
    expect_refused(t.run(), {"2 fiducials", "has 4"});
}

TEST(Register, SaysWhatToDoWithAStylusThatRestsWithoutTurning) {
    TouchedFiducials t(0);
    write_fiducials(t.folder / "image.mrk.json", t.image);
    test::write_text(t.folder / "still.yaml",
                     "rate_Hz: 40\nduration_s: 6\n"
                     "tools: [{tool: Stylus, on: tracker, at_mm: [10, 20, 30]}]\n");
    expect_refused(
        livetet(t.folder, "register --tracker still.yaml --tip-mm 0 0 150 --image image.mrk.json"),
        {"rested 0 times, expected 6", "turned by less than 2 degrees",
         "turn the tool about its tip", "--dwells 0:241"});
}

TEST(Register, RefusesAnOrderThatASymmetricLayoutDoesNotTell) {
    TouchedFiducials t(0);
    t.image.resize(4);
    t.tracker.resize(4);
    const Vector3 square[] = {{0.05, 0, 0}, {0, 0.05, 0}, {-0.05, 0, 0}, {0, -0.05, 0}};
    for (int i = 0; i < 4; ++i) {
        t.image[i].position = square[i];
        t.tracker[i].position = t.touch(square[i], 0.0005);
    }
    expect_refused(t.run("--any-order"), {"fit equally well", "FRE"});
    const auto outcome = t.run();
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("warning: the fiducials' layout is symmetric"), std::string::npos)
        << outcome.out;
    TouchedFiducials other(0.0003);
    EXPECT_EQ(other.run().out.find("warning"), std::string::npos);
}

TEST(Register, NamesTheOutlierAndLeavesItOutByItsWeight) {
    TouchedFiducials t(0.0003);
    t.tracker[2].position += Vector3(0, 0.008, 0);
    const auto outcome = t.run();
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(t.registration().outlier, "F3");
    EXPECT_NE(outcome.out.find("--weight F3=0"), std::string::npos) << outcome.out;
    EXPECT_GT(t.registration().fre, 0.002);
    EXPECT_NEAR(t.registration().fiducials[2].leave_one_out, 0.008, 0.0015);
    ASSERT_EQ(t.run("--weight F3=0 --weight F1=0.5").status, 0);
    const FiducialRegistration without = t.registration();
    EXPECT_FALSE(without.outlier);
    EXPECT_LT(without.fre, 0.001);
    EXPECT_EQ(without.fiducials[2].weight, 0);
    EXPECT_EQ(without.fiducials[0].weight, 0.5);
    EXPECT_GT(without.fiducials[2].residual, 0.007);
    EXPECT_LT(t.error_at({0.1, 0.05, 0.05}), 0.0007);
}

TEST(Register, StatesAndKeepsTheExpectedErrorOfARigidFit) {
    TouchedFiducials t(0.0005);
    const auto outcome = t.run("--weight F2=0.5 --weight F5=0 --target-mm 10 20 300");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const FiducialRegistration r = t.registration();
    ASSERT_TRUE(r.expected_error);
    EXPECT_FALSE(r.expected_error->holds_tip);
    std::vector<Vector3> places;
    std::vector<double> weights;
    Vector3 centre = Vector3::Zero();
    for (const RegisteredFiducial& f : r.fiducials) {
        places.push_back(f.in_image);
        weights.push_back(f.weight);
        centre += f.weight * f.in_image / 4.5;
    }
    const auto expect_stated = [&](const Vector3& target, const std::string& name) {
        const Eigen::Matrix3d covariance =
            point_covariance(r.expected_error->covariance, target - r.image_from_base.translation);
        const double tre = expected_tre(places, r.fle, target, Scaling::rigid, weights);
        // The one takes the fiducials in the image, the other as touched, 0.5 mm apart.
        EXPECT_NEAR(std::sqrt(covariance.trace()) / tre, 1, 1e-3);
        const double radius_mm = 1e3 * error_ellipsoid(covariance).radius_95;
        EXPECT_NE(outcome.out.find(fmt::format(
                      "error        95 % within {:.2f} mm at {}, without that of the tip\n",
                      radius_mm, name)),
                  std::string::npos)
            << outcome.out;
    };
    expect_stated(centre, "the fiducials' centre");
    expect_stated({0.01, 0.02, 0.3}, "(10.0, 20.0, 300.0) mm");

    const auto scaled = t.run("--scale");
    ASSERT_EQ(scaled.status, 0) << scaled.err;
    EXPECT_FALSE(t.registration().expected_error);
    EXPECT_NE(scaled.out.find("error        not stated"), std::string::npos) << scaled.out;
}

/// A stylus that touches the fiducials, each in another orientation, and turns by 0.1 rad to and
/// fro in each, seen from a reference sensor that is carried.
Recording touched_by_a_turning_tool(const TouchedFiducials& t, const Vector3& tip) {
    Recording recording{{"Stylus", "Reference"}, {}};
    for (std::size_t i = 0; i < 20 * t.image.size(); ++i) {
        const double at = static_cast<double>(i / 20);
        auto now = t.tracker_from_image;
        now.translation.x() += 0.0002 * static_cast<double>(i);
        RigidTransform<Tracker, Tool> tool{
            rotation_of_vector({0.3 * at, 0.5 * std::sin(at), -0.2 * at}) *
                rotation_of_vector({i % 2 ? 0.1 : -0.1, 0, 0}),
            {}};
        const Vector3 touched = t.tracker_from_image.inverse() * t.tracker[i / 20].position;
        tool.translation = now * touched - tool.rotation * tip;
        recording.samples.push_back({0.1 * static_cast<double>(i), {pose_of(tool), pose_of(now)}});
    }
    return recording;
}

TEST(Register, ExpectedErrorHoldsThatOfTheTipThatTouchedTheFiducials) {
    TouchedFiducials t(0.0005);
    ToolTip tip{"Stylus", {}, {}, Vector3(1e-8, 4e-8, 9e-8).asDiagonal()};
    tip.pivot.tool_from_tip.translation = {0.004, -0.002, 0.15};
    write_tip(t.folder / "tip.json", tip);
    write_sequence(t.folder / "touched.igs.mha",
                   touched_by_a_turning_tool(t, tip.pivot.tool_from_tip.translation));
    const auto run = [&](const std::string& options) {
        write_fiducials(t.folder / "image.mrk.json", t.image);
        return livetet(t.folder,
                       "register --tracker touched.igs.mha --reference Reference --image "
                       "image.mrk.json -o registration.json --dwells "
                       "0:20,20:40,40:60,60:80,80:100,100:120 " +
                           options);
    };
    const auto outcome = run("--tip tip.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("at the fiducials' centre, with the error of the tip"),
              std::string::npos)
        << outcome.out;
    const FiducialRegistration r = t.registration();
    ASSERT_TRUE(r.expected_error);
    EXPECT_TRUE(r.expected_error->holds_tip);

    // The same from the library's functions.
    std::vector<FrameWindow> windows;
    for (std::size_t i = 0; i < 6; ++i) windows.push_back({20 * i, 20 * i + 20});
    DwellOptions in_reference;
    in_reference.reference = "Reference";
    FiducialErrors errors;
    errors.tip = *tip.covariance;
    std::vector<Vector3> places;
    for (const Dwell& d : dwells_in_windows(read_sequence(t.folder / "touched.igs.mha"),
                                            tip.tool_from_tip(), windows, in_reference)) {
        places.push_back(*d.tip_in_reference);
        errors.from_from_tool.push_back(d.mean_turn);
        errors.in_to.push_back(r.fle * r.fle / 3 * Eigen::Matrix3d::Identity());
    }
    const auto expected = registration_covariance(places, r.image_from_base.rotation, errors);
    EXPECT_LT((r.expected_error->covariance - expected).norm(), 1e-9 * expected.norm());

    // Touched in another order than the image's, it is the same.
    std::reverse(t.image.begin(), t.image.end());
    const auto reversed = run("--tip tip.json --any-order");
    ASSERT_EQ(reversed.status, 0) << reversed.err;
    EXPECT_LT((t.registration().expected_error->covariance - expected).norm(),
              1e-6 * expected.norm());

    // A tip without a covariance is taken as exact, and the file says so.
    std::reverse(t.image.begin(), t.image.end());
    const auto without = run("--tip-mm 4 -2 150");
    ASSERT_EQ(without.status, 0) << without.err;
    EXPECT_NE(without.out.find("without that of the tip"), std::string::npos) << without.out;
    ASSERT_TRUE(t.registration().expected_error);
    EXPECT_FALSE(t.registration().expected_error->holds_tip);
    errors.tip.setZero();
    const auto exact = registration_covariance(places, r.image_from_base.rotation, errors);
    EXPECT_LT((t.registration().expected_error->covariance - exact).norm(), 1e-6 * exact.norm());
}

TEST(Register, RefusesFiducialsOfAnotherUnit) {
    TouchedFiducials t(0.0003);
    for (NamedPoint& p : t.image) p.position *= 1e-3;
    expect_refused(t.run(),
                   {"image.mrk.json", "0.001 times as far apart", "tracker.mrk.json", "--scale"});
}

TEST(Register, RefusesWeightsThatAreNone) {
    TouchedFiducials t(0.0003);
    expect_refused(t.run("--weight F9=1"), {"F9", "image.mrk.json"});
    for (const char* wrong : {"F1", "F1=", "F1=-1", "F1=nan", "F1=1e999"})
        expect_refused(t.run(fmt::format("--weight {}", wrong)), {wrong, "NAME=W"});
    expect_refused(t.run("--weight F1=0 --weight F2=0 --weight F3=0 --weight F4=0"),
                   {"2 points of some weight"});
}

/// Points of the block's six sides, or of its top alone, as a tracker with `noise` sees them.
std::vector<NamedPoint> on_the_block(TouchedFiducials& t, bool top_only, double noise) {
    std::uniform_real_distribution<double> unit(0.05, 0.95);
    std::vector<NamedPoint> points;
    for (int i = 0; i < 300; ++i) {
        Vector3 x(0.2 * unit(t.engine), 0.1 * unit(t.engine), 0.1 * unit(t.engine));
        const int side = top_only ? 5 : i % 6;
        x[side / 2] = side % 2 ? (side / 2 ? 0.1 : 0.2) : 0;
        points.push_back({std::to_string(i), t.touch(x, noise)});
    }
    return points;
}

void write_block(const TouchedFiducials& t) {
    write_hierarchy(t.folder / "block.h5",
                    make_hierarchy({test::block({8, 4, 4}, {0.2, 0.1, 0.1})}, "a block"));
}

TEST(Register, SurfacePointsRefineWhatBadFiducialsBegan) {
    TouchedFiducials t(0.004);
    write_block(t);
    const Vector3 target(0.1, 0.05, 0.05);
    ASSERT_EQ(t.run().status, 0);
    const double before = t.error_at(target);
    write_points_csv(t.folder / "points.csv", on_the_block(t, false, 0.0005));
    const auto outcome = t.run("--surface block.h5 --surface-points points.csv");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_GT(before, 0.001);
    EXPECT_LT(t.error_at(target), 0.0003);
    const auto surface = t.registration().surface;
    ASSERT_TRUE(surface);
    EXPECT_EQ(surface->points, 300u);
    EXPECT_EQ(surface->used, 270u);
    EXPECT_GT(surface->rms_before, 0.001);
    EXPECT_LT(surface->rms_after, 0.0006);
    EXPECT_EQ(surface->free_motions, 0u);
    EXPECT_FALSE(t.registration().expected_error);
    EXPECT_NE(outcome.out.find("error        not stated"), std::string::npos) << outcome.out;
}

TEST(Register, SaysWhatPointsOnOnePlaneDoNotHold) {
    TouchedFiducials t(0.001);
    write_block(t);
    write_points_csv(t.folder / "points.csv", on_the_block(t, true, 0.0003));
    const auto outcome = t.run("--surface block.h5 --surface-points points.csv");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(t.registration().surface->free_motions, 3u);
    EXPECT_NE(outcome.out.find("warning: the surface points do not determine"), std::string::npos)
        << outcome.out;
    EXPECT_NE(outcome.out.find("turning about"), std::string::npos);
    EXPECT_NE(outcome.out.find("sliding along"), std::string::npos);
}

TEST(Register, RefusesSurfacesWithoutPointsAndPointsWithoutASurface) {
    TouchedFiducials t(0.001);
    write_block(t);
    expect_refused(t.run("--surface block.h5"),
                   {"block.h5", "--surface-points", "--surface-frames"});
    expect_refused(t.run("--surface-points points.csv"), {"--surface FILE"});
    for (const char* idle : {"--surface-left-out 0.2", "--space lps", "--support", "--for 3"})
        expect_refused(t.run(idle), {std::string(idle).substr(0, std::string(idle).find(' ')),
                                     "has no effect here"});
    write_points_csv(t.folder / "points.csv", std::vector<NamedPoint>{{"a", {0, 0, 0}}});
    expect_refused(t.run("--surface block.h5 --surface-points points.csv"),
                   {"1 points", "expected at least 10"});
    expect_refused(t.run("--surface block.h5 --surface-points points.csv --surface-frames 1:2"),
                   {"points.csv"});
    expect_refused(t.run("--surface gone.h5 --surface-points points.csv"), {"gone.h5"});
    write_points_csv(t.folder / "points.csv", on_the_block(t, false, 0));
    expect_refused(t.run("--surface block.h5 --surface-points points.csv --surface-left-out 0.7"),
                   {"0.7", "below 0.5"});
}

/// A stylus whose tip is led over the block's sides, or turned about its shaft, while the reference
/// sensor moves.
TEST(Register, LeadsATipOverTheSurfaceInARecording) {
    TouchedFiducials t(0.004);
    write_block(t);
    const Vector3 tip(0.004, -0.002, 0.15);
    const RigidTransform<ImageFrame, Reference> image_from_reference{
        rotation_of_vector({0.1, 0.2, 0.3}), {0.1, 0, 0}};
    Recording recording{{"Stylus", "Reference"}, {}};
    std::vector<Vector3> places;
    std::string dwells;
    for (std::size_t i = 0; i < t.image.size(); ++i) {
        const Vector3 off = t.tracker_from_image.inverse() * t.tracker[i].position;
        dwells += fmt::format("{}{}:{}", i ? "," : "", places.size(), places.size() + 20);
        for (int k = 0; k < 20; ++k) places.push_back(off);
    }
    const std::size_t begin = places.size();
    for (const NamedPoint& p : on_the_block(t, false, 0.0003))
        places.push_back(t.tracker_from_image.inverse() * p.position);
    for (std::size_t i = 0; i < places.size(); ++i) {
        auto now = t.tracker_from_image;
        now.translation.x() += 0.0002 * static_cast<double>(i);  // the organ is carried by 84 mm
        RigidTransform<Tracker, Tool> tool{
            rotation_of_vector({0.3 * std::sin(0.3 * i), 0.2 * std::cos(0.2 * i), 0}), {}};
        tool.translation = now * places[i] - tool.rotation * tip;
        recording.samples.push_back(
            {0.1 * static_cast<double>(i), {pose_of(tool), pose_of(now * image_from_reference)}});
    }
    write_sequence(t.folder / "touched.igs.mha", recording);
    write_fiducials(t.folder / "image.mrk.json", t.image);
    const std::string command =
        "register --tracker touched.igs.mha --tip-mm 4 -2 150 --reference Reference --image "
        "image.mrk.json -o registration.json --dwells " +
        dwells;
    ASSERT_EQ(livetet(t.folder, command).status, 0);
    const auto error = [&] {
        const auto fit = t.registration().image_from_base;
        return (fit * (image_from_reference.inverse() * Vector3(0.1, 0.05, 0.05)) -
                Vector3(0.1, 0.05, 0.05))
            .norm();
    };
    const double before = error();
    const auto outcome = livetet(
        t.folder,
        command + fmt::format(" --surface block.h5 --surface-frames {}:{}", begin, places.size()));
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(t.registration().surface->points, 300u);
    EXPECT_GT(before, 0.001);
    EXPECT_LT(error(), 0.0003);
    expect_refused(livetet(t.folder, command + " --surface block.h5 --surface-frames 400:4000"),
                   {"400", "4000"});
    expect_refused(livetet(t.folder, command + " --surface block.h5 --surface-frames 40-90"),
                   {"40-90", "FIRST:END"});
    // A moving tip is no fiducial.
    expect_refused(
        livetet(t.folder,
                fmt::format("register --tracker touched.igs.mha --tip-mm 4 -2 150 --image "
                            "image.mrk.json --dwells {}:{}",
                            begin, begin + 50)),
        {"touched.igs.mha", "the tip moves"});
}

/// A stylus that turns about its shaft and about nothing else.
Recording spun(double turn_deg) {
    const Vector3 shaft = Vector3(0.1, -0.2, 1).normalized();
    Recording recording{{"Stylus"}, {}};
    for (int i = 0; i < 60; ++i) {
        const double angle = turn_deg * std::numbers::pi / 180 * i / 59;
        const RigidTransform<Tracker, Tool> pose{
            rotation_of_vector({0.5, 1, 0.2}) * rotation_of_vector(angle * shaft), {0.1, 0.2, 0.3}};
        recording.samples.push_back({0.1 * i, {pose_of(pose)}});
    }
    return recording;
}

TEST(Calibrate, PivotRefusesATipThatWanders) {
    const Folder folder;
    SimulatedTrackerOptions options;
    write_sequence(folder / "press.igs.mha",
                   simulate_press(options));  // the organ's reference sensor, carried about
    expect_refused(livetet(folder, "calibrate pivot press.igs.mha --tool Reference -o tip.json"),
                   {"press.igs.mha", "Reference", "mm RMS", "at most 5"});
    EXPECT_FALSE(std::filesystem::exists(folder / "tip.json"));
}

TEST(Calibrate, PivotStatesAndKeepsTheErrorOfTheTip) {
    const Folder folder;
    const SimulatedTrackerOptions options;
    write_sequence(folder / "pivot.igs.mha", simulate_pivoting(options));
    const auto outcome = livetet(folder, "calibrate pivot pivot.igs.mha -o tip.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const auto fit =
        calibrate_pivot(usable_poses(read_sequence(folder / "pivot.igs.mha"), "Stylus"));
    const Eigen::Matrix3d expected = fit.covariance->topLeftCorner<3, 3>();
    const ToolTip tip = read_tip(folder / "tip.json");
    ASSERT_TRUE(tip.covariance);
    EXPECT_LT((*tip.covariance - expected).norm(), 1e-9 * expected.norm());
    const double radius = error_ellipsoid(expected).radius_95;
    EXPECT_GT(radius, 1e-4);
    EXPECT_NE(outcome.out.find(fmt::format("error of the tip   {:.2f} mm with 95 %", 1e3 * radius)),
              std::string::npos)
        << outcome.out;

    write_sequence(folder / "spin.igs.mha", spun(300));
    ASSERT_EQ(livetet(folder, "calibrate spin spin.igs.mha --tip tip.json -o both.json").status, 0);
    const ToolTip both = read_tip(folder / "both.json");
    ASSERT_TRUE(both.spin);
    ASSERT_TRUE(both.covariance);
    EXPECT_LT((*both.covariance - expected).norm(), 1e-9 * expected.norm());
}

TEST(Calibrate, SpinAddsTheShaftToTheTip) {
    const Folder folder;
    write_sequence(folder / "spin.igs.mha", spun(300));
    ToolTip tip{"Stylus", {}, {}};
    tip.pivot.tool_from_tip.translation = {-0.01, 0.03, -0.15};
    write_tip(folder / "tip.json", tip);
    const auto outcome = livetet(folder, "calibrate spin spin.igs.mha --tip tip.json -o both.json");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const ToolTip both = read_tip(folder / "both.json");
    EXPECT_LT((both.tool_from_tip().rotation.col(2) + Vector3(0.1, -0.2, 1).normalized()).norm(),
              1e-4);
    EXPECT_LT((both.tool_from_tip().translation - tip.pivot.tool_from_tip.translation).norm(),
              1e-12);
    EXPECT_NEAR(both.spin->turn_deg, 300, 1);
    EXPECT_EQ(livetet(folder, "calibrate spin spin.igs.mha").status, 0);
}

TEST(Calibrate, SpinRefusesPosesThatDoNotSpanAndAnotherToolsTip) {
    const Folder folder;
    write_sequence(folder / "spin.igs.mha", spun(300));
    write_sequence(folder / "short.igs.mha", spun(40));
    expect_refused(livetet(folder, "calibrate spin short.igs.mha"),
                   {"short.igs.mha", "Stylus", "40.", "at least 90"});
    expect_refused(livetet(folder, "calibrate spin spin.igs.mha -o both.json"),
                   {"--output both.json", "--tip"});
    write_tip(folder / "tip.json", {"Probe", {}, {}});
    expect_refused(livetet(folder, "calibrate spin spin.igs.mha --tip tip.json"),
                   {"tip.json", "Probe", "Stylus"});
    // What turns about one axis only is no pivot.
    expect_refused(livetet(folder, "calibrate pivot spin.igs.mha"),
                   {"spin.igs.mha", "more than one axis"});
}

}  // namespace
}  // namespace livetet
