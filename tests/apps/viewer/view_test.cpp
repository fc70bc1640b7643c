#ifdef LIVETET_IMAGES
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "apps/commands/tracked_block.hpp"
#include "base/error.hpp"
#include "io/image_file.hpp"

// `livetet view` under a virtual X server. Kept pictures lie in tests/apps/viewer;
// LIVETET_KEEP_PICTURES=1 writes them anew.

namespace livetet {
namespace {

using nlohmann::json;
using test::Folder;
using test::livetet;
using test::Tracked;

constexpr const char* with_display = "xvfb-run -a -s '-screen 0 1280x1024x24'";
constexpr const char* without_display = "env -u DISPLAY";

struct Picture {
    int width = 0, height = 0;
    std::vector<unsigned char> rgb;

    explicit Picture(const std::filesystem::path& path) {
        vtkNew<vtkPNGReader> reader;
        if (!reader->CanReadFile(path.c_str())) return;
        reader->SetFileName(path.c_str());
        reader->Update();
        const int* size = reader->GetOutput()->GetDimensions();
        width = size[0];
        height = size[1];
        const auto* data = static_cast<unsigned char*>(reader->GetOutput()->GetScalarPointer());
        if (data) rgb.assign(data, data + 3 * width * height);
    }
    const unsigned char* at(int x, int y) const {
        return &rgb[3 * (x + static_cast<std::size_t>(width) * y)];
    }
    /// The number of pixels in these columns, from the first to before the second, whose colours
    /// are within these limits.
    std::size_t count(std::array<int, 2> columns, std::array<int, 3> low,
                      std::array<int, 3> high) const {
        std::size_t found = 0;
        for (int y = 0; y < height; ++y)
            for (int x = columns[0]; x < std::min(columns[1], width); ++x) {
                bool within = true;
                for (int c = 0; c < 3; ++c)
                    within = within && at(x, y)[c] >= low[c] && at(x, y)[c] <= high[c];
                found += within;
            }
        return found;
    }
    /// The share of the pixels whose colours differ by more than this in some channel.
    /// `rows_left_out`: at the bottom.
    double share_differing(const Picture& other, int by, int rows_left_out = 0) const {
        if (rgb.size() != other.rgb.size() || rgb.empty()) return 1;
        std::size_t count = 0;
        for (std::size_t p = 3 * static_cast<std::size_t>(width) * rows_left_out; p < rgb.size();
             p += 3) {
            int most = 0;
            for (int c = 0; c < 3; ++c)
                most = std::max(most, std::abs(rgb[p + c] - other.rgb[p + c]));
            count += most > by;
        }
        return 3.0 * static_cast<double>(count) / static_cast<double>(rgb.size());
    }
};

/// Another version of the renderer moves edges and letters by a pixel: four pixels in a thousand
/// may be another (by more than 40 of 255). The press, slices at rest instead of deformed, or
/// another colouring change more, which a test below holds.
void expect_as_kept(const std::filesystem::path& written, const std::string& name,
                    int rows_left_out = 0) {
    const std::filesystem::path kept = std::filesystem::path(LIVETET_TESTS) / "apps/viewer" / name;
    if (std::getenv("LIVETET_KEEP_PICTURES"))
        std::filesystem::copy_file(written, kept,
                                   std::filesystem::copy_options::overwrite_existing);
    EXPECT_LT(Picture(written).share_differing(Picture(kept), 40, rows_left_out), 0.004)
        << written << " is not as " << kept;
}

/// Stripes across x and z, of 20 mm, about the block.
GreyImage striped_image() {
    GreyImage image{{70, 45, 45}, Eigen::Matrix4d::Identity(), {}};
    image.ras_from_voxel.topLeftCorner<3, 3>() *= 0.004;
    image.ras_from_voxel.topRightCorner<3, 1>() = Vector3(-0.04, -0.04, -0.04);
    for (int k = 0; k < 45; ++k)
        for (int j = 0; j < 45; ++j)
            for (int i = 0; i < 70; ++i)
                image.values.push_back(static_cast<float>(100 + 60 * ((i / 5 + k / 5) % 2) + j));
    return image;
}

/// A recorded press, with an image of the block.
struct Viewed : Tracked {
    Viewed() {
        write_image(folder / "block.nii.gz", striped_image());
        name_image();
        tracker.position_rms_mm = tracker.rotation_rms_deg = 0;
        record();
    }
    void name_image() const {
        std::ofstream(folder / "scene.yaml", std::ios::app) << "image: block.nii.gz\n";
    }
    test::Outcome script(const std::string& text, const std::string& options = "",
                         const std::string& input = "result.h5") const {
        test::write_text(folder / "script.txt", text);
        return livetet(folder, "view " + input + " --script script.txt --size 640 400 " + options,
                       with_display);
    }
    /// What `tell` printed.
    static std::vector<json> told(const test::Outcome& outcome) {
        std::vector<json> lines;
        std::istringstream out(outcome.out);
        for (std::string line; std::getline(out, line);)
            if (line.starts_with('{')) lines.push_back(json::parse(line));
        return lines;
    }
};

double number(const json& list, int i) {
    return list.at(static_cast<std::size_t>(i)).get<double>();
}

TEST(View, ARecordedPressLooksAsKept) {
    Viewed viewed;
    const std::size_t frames = viewed.run().frame_count();
    const auto outcome = viewed.script(
        "frame 1\nscreenshot rest.png\ntime 4.8\ntell\nscreenshot pressed.png\nslices "
        "rest\nscreenshot image.png\n"
        "slices deformed\nvolume on\nscreenshot volume.png\n",
        "--off-screen");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err.find("left out"), std::string::npos) << outcome.err;
    EXPECT_GT(frames, 50u);
    for (const char* name : {"rest.png", "pressed.png", "image.png", "volume.png"})
        expect_as_kept(viewed.folder / name, name);
    const Picture rest(viewed.folder / "rest.png"), pressed(viewed.folder / "pressed.png"),
        image(viewed.folder / "image.png");
    EXPECT_GT(rest.share_differing(pressed, 40), 0.008);
    EXPECT_GT(image.share_differing(pressed, 40), 0.006);
    // The press, and what the sensor did, are the tracker's.
    const json state = Viewed::told(outcome).at(0);
    EXPECT_NEAR(state.at("largest_mm"), 15, 1.5);
    EXPECT_NEAR(number(state.at("sensors").at("Sensor").at("base_mm"), 0), 100, 0.5);
    EXPECT_NEAR(number(state.at("sensors").at("Sensor").at("base_mm"), 2), 100, 0.5);
    EXPECT_NEAR(number(state.at("sensors").at("Sensor").at("now_mm"), 2), 85, 1);
    EXPECT_GE(state.at("sensors").at("Sensor").at("patch"), 1);  // the block is coarse
}

TEST(View, PlayMouseAndKeysInAWindow) {
    Viewed viewed;
    (void)viewed.run();
    // The axial slice's middle is at 0.83 of the width, 0.845 of the height.
    const auto outcome = viewed.script(
        "tell\nplay 1.5\ntell\ndrag left 531 338 541 338\ntell\ndrag right 531 338 571 338\ntell\n"
        "key d\ntell\ndrag left 320 23 320 23\ntell\nkey Right\ntell\ndrag left 200 200 260 "
        "220\nscreenshot turned.png\n");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const std::vector<json> told = Viewed::told(outcome);
    ASSERT_EQ(told.size(), 7u);
    const double played = told[1].at("time_s").get<double>() - told[0].at("time_s").get<double>();
    EXPECT_GT(played, 0.5);  // a slow machine leaves frames out, but not time
    EXPECT_LT(played, 1.6);
    // The image is 280 mm wide about x = 98 mm, its 180 mm fill the slice's 123 pixels: 9.2 to the
    // right of the middle are 13.5 mm towards the patient's left.
    EXPECT_NEAR(number(told[2].at("cross_mm"), 0), 98 - 13.5, 2);
    EXPECT_EQ(number(told[2].at("cross_mm"), 2), number(told[1].at("cross_mm"), 2));
    EXPECT_NEAR(told[3].at("window").get<double>() / told[2].at("window").get<double>(),
                std::pow(1 + 5.0 / 200, 8), 1e-6);
    EXPECT_EQ(told[3].at("cross_mm"), told[2].at("cross_mm"));
    EXPECT_FALSE(told[4].at("deformed"));
    EXPECT_GT(told[5].at("time_s"), told[1].at("time_s"));  // the middle of the time line
    EXPECT_GT(told[6].at("time_s"), told[5].at("time_s"));
    EXPECT_GT(Picture(viewed.folder / "turned.png").width, 600);
}

/// Pixels of the target's ellipsoid over the pale green organ, of which it lets 45 % through. The
/// target's colour is (255, 102, 0).
std::size_t ellipsoid_pixels(const Picture& picture, int organ_end) {
    return picture.count({0, organ_end}, {195, 110, 50}, {230, 160, 100});
}

/// A press with a target, whose registration has these standard deviations along the axes (m) and
/// about them (rad).
struct ViewedTarget : Viewed {
    explicit ViewedTarget(const Vector3& shift = {0.004, 0.002, 0.005},
                          const Vector3& turn = Vector3::Zero()) {
        FiducialRegistration registration = read_registration(folder / "registration.json");
        registration.expected_error.emplace().covariance.diagonal() << shift.cwiseAbs2(),
            turn.cwiseAbs2();
        write_registration(folder / "registration.json", registration);
        set_track("targets: [{name: Tumour, point_mm: [100, 50, 60]}]");
        name_image();
    }
};

TEST(View, TargetsHaveTheirEllipsoids) {
    ViewedTarget viewed;
    (void)viewed.run();
    const auto outcome = viewed.script(
        "frame 1\ntell\ncross 100 50 60\nscreenshot through.png\nslices rest\nscreenshot "
        "rest.png\nslices deformed\ncross 150 20 20\nscreenshot beside.png\n",
        "--off-screen");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const json tumour = Viewed::told(outcome).at(0).at("targets").at("Tumour");
    EXPECT_EQ(tumour.at("at_mm"), json({100.0, 50.0, 60.0}));
    // 95 % of the largest deviation alone is 9.8 mm, the largest semi-axis 14 mm.
    EXPECT_GT(tumour.at("radius_95_mm"), 9.8);
    EXPECT_LT(tumour.at("radius_95_mm"), 14);

    constexpr int organ_end = 422;
    const Picture through(viewed.folder / "through.png"), rest(viewed.folder / "rest.png"),
        beside(viewed.folder / "beside.png");
    const auto contour = [&](const Picture& picture) {
        return picture.count({organ_end, 640}, {250, 97, 0}, {255, 107, 5});
    };
    EXPECT_GT(contour(through), 60u);  // three ellipses with semi-axes of 4 to 10 pixels
    EXPECT_EQ(contour(rest), 0u) << "places are those in the deformed organ";
    EXPECT_EQ(contour(beside), 0u) << "the slices pass the target";
    for (const Picture* picture : {&through, &rest, &beside}) {
        EXPECT_GT(ellipsoid_pixels(*picture, organ_end), 700u);  // semi-axes of 15 and 20 pixels
        EXPECT_LT(ellipsoid_pixels(*picture, organ_end), 1400u);
    }
}

/// Pixels in these columns whose colour is of the upper half of the bar; fixed nodes are less dark.
std::size_t blue_pixels(const Picture& picture, std::array<int, 2> columns) {
    return picture.count(columns, {0, 0, 45}, {60, 200, 230});
}

TEST(View, TheOrganIsColouredByTheStatedError) {
    // A registration that may turn about z: the error grows with the distance from (20, 100) mm.
    ViewedTarget viewed({1e-6, 1e-6, 1e-6}, {0, 0, 0.05});
    (void)viewed.run();
    const auto outcome = viewed.script(
        "frame 10\nlook front\ntell\nscreenshot displacement.png\ncolour error\nscreenshot "
        "error.png\nkey c\nscreenshot back.png\nkey c\nscreenshot key.png\n",
        "--off-screen");
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    // No sensor is placed yet: all of the error is the registration's. It is farthest out at
    // (200, 0) mm, along one line: 1.96 standard deviations hold 95 %.
    const json stated = Viewed::told(outcome).at(0).at("stated_error");
    EXPECT_NEAR(stated.at("max_mm"), 1.96 * 0.05 * std::hypot(180, 100), 0.1);
    EXPECT_LT(stated.at("min_mm"), 5);
    EXPECT_TRUE(stated.at("lacks_sources")) << "the one-euro filter states no error";

    const Picture displacement(viewed.folder / "displacement.png"),
        error(viewed.folder / "error.png");
    // Seen from the front, x = 200 mm is on the left. The bar ends before column 90.
    constexpr std::array far{90, 150}, near{270, 360};
    EXPECT_LT(blue_pixels(displacement, far), 300u);
    EXPECT_GT(blue_pixels(error, far), 5000u);
    EXPECT_LT(blue_pixels(error, near), 1500u);
    EXPECT_EQ(Picture(viewed.folder / "back.png").share_differing(displacement, 0), 0)
        << "there is no stress";
    EXPECT_EQ(Picture(viewed.folder / "key.png").share_differing(error, 0), 0);
    EXPECT_EQ(livetet(viewed.folder,
                      "view result.h5 --colour error --frame 10 --screenshot option.png --size 640 "
                      "400",
                      with_display)
                  .status,
              0);
    EXPECT_GT(blue_pixels(Picture(viewed.folder / "option.png"), {90, 422}), 3000u);
}

TEST(View, ALiveRunShowsTargetsToo) {
    ViewedTarget viewed;
    write_sequence(viewed.folder / "press.igs.mha", viewed.recording);
    test::write_text(viewed.folder / "look.txt",
                     "play 1\ntell\nscreenshot live.png\ncolour error\nplay 0.5\nscreenshot "
                     "error.png\n");
    const auto outcome =
        livetet(viewed.folder, "view scene.yaml --script look.txt --size 640 400", with_display);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const json told = Viewed::told(outcome).at(0);
    EXPECT_TRUE(told.at("targets").contains("Tumour")) << outcome.out;
    EXPECT_GT(told.at("stated_error").at("max_mm"), 9.8);
    const Picture live(viewed.folder / "live.png"), error(viewed.folder / "error.png");
    EXPECT_GT(ellipsoid_pixels(live, 422), 700u);
    EXPECT_GT(blue_pixels(error, {90, 422}), blue_pixels(live, {90, 422}) + 5000);
}

TEST(View, AScreenshotNeedsNoDisplayAndAWindowSaysThatItDoes) {
    Viewed viewed;
    const ResultReader run = viewed.run();
    test::expect_refused(livetet(viewed.folder, "view result.h5", without_display),
                         {"result.h5", "no X server", "--screenshot"});
    test::expect_refused(livetet(viewed.folder, "view scene.yaml", without_display),
                         {"no X server", "livetet track"});
    const auto outcome = livetet(
        viewed.folder, "view result.h5 --screenshot shot.png --size 640 400", without_display);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const Picture shot(viewed.folder / "shot.png");
    EXPECT_EQ(shot.width, 640);
    // of the deepest press
    std::size_t deepest = 0;
    for (std::size_t k = 0; k < run.frame_count(); ++k)
        if (run.values("press_mm", k, 1)[0] > run.values("press_mm", deepest, 1)[0]) deepest = k;
    const auto frame = [&](std::size_t k) {
        const std::string name = std::to_string(k) + ".png";
        EXPECT_EQ(livetet(viewed.folder,
                          "view result.h5 --frame " + std::to_string(k + 1) + " --screenshot " +
                              name + " --size 640 400",
                          without_display)
                      .status,
                  0);
        return Picture(viewed.folder / name);
    };
    EXPECT_EQ(shot.share_differing(frame(deepest), 10), 0);
    EXPECT_GT(shot.share_differing(frame(run.frame_count() - 1), 40), 0.004);
}

TEST(View, ALiveRunIsPulledByHandAndItsReplayIsTheSame) {
    Viewed viewed;
    viewed.tracker.press_depth = 1e-6;
    viewed.tracker.rest_s = 6;
    viewed.tracker.position_rms_mm = viewed.tracker.rotation_rms_deg =
        0;  // marks where the kept picture has them, whenever it is taken
    viewed.record();
    test::write_text(viewed.folder / "pull.txt",
                     "play 2\npull 30 50 100 0 0 -8\nplay 1.5\ntell\nscreenshot "
                     "pulled.png\nrelease\nplay 2.5\ntell\n");
    write_sequence(viewed.folder / "press.igs.mha", viewed.recording);
    const auto outcome =
        livetet(viewed.folder, "view scene.yaml --script pull.txt --size 640 400", with_display);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    const std::vector<json> told = Viewed::told(outcome);
    ASSERT_EQ(told.size(), 2u);
    EXPECT_NEAR(told[0].at("largest_mm"), 8, 0.5);
    EXPECT_NEAR(number(told[0].at("pull").at("to_mm"), 2), 92, 1e-6);
    EXPECT_LT(told[1].at("largest_mm"), 2);  // let go: held half a second, then released
    expect_as_kept(viewed.folder / "pulled.png", "pulled.png",
                   60);  // the strip tells what the moment's frame took
    const auto replayed = livetet(viewed.folder, "track --replay result.h5");
    EXPECT_EQ(replayed.status, 0) << replayed.out << replayed.err;
    // What was pulled is the patch about the marker.
    const ResultReader reader(viewed.folder / "result.h5");
    double deepest = 0;
    std::size_t node = 0;
    for (std::size_t n = 0; n < reader.mesh().nodes.size(); ++n)
        if ((reader.mesh().nodes[n] - Vector3(0.0333, 0.05, 0.1)).norm() < 0.005) node = n;
    for (std::size_t k = 0; k < reader.frame_count(); ++k)
        deepest = std::min(deepest, reader.displacement(k)[node].z());
    EXPECT_NEAR(deepest, -0.008, 1e-5);
}

TEST(View, ALiveRunIsCutAlongDrawnLines) {
    Viewed viewed;
    viewed.tracker.rest_s = 6;
    viewed.record();
    viewed.set_track("cut_by_hand_mm: 30, cut_interval_s: 0.2");
    viewed.name_image();
    test::write_text(viewed.folder / "cut.txt",
                     "play 1.5\nkey k\ndrag left 215 330 215 130\nplay 1\n"
                     "drag left 20 380 40 380\nplay 0.5\nscreenshot organ.png\n"
                     "drag left 500 260 500 170\ndrag left 520 260 520 170\nplay 1\n"
                     "key k\nscreenshot slice.png\n");
    write_sequence(viewed.folder / "press.igs.mha", viewed.recording);
    const auto outcome =
        livetet(viewed.folder, "view scene.yaml --script cut.txt --off-screen --size 640 400",
                with_display);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.err.find("nothing is cut here"), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find("vtk"), std::string::npos) << outcome.err;

    // A line over the organ, and two in the coronal slice, drawn without a frame between them; the
    // one beside the organ cuts nothing.
    const ResultReader reader(viewed.folder / "result.h5");
    const std::vector<double> edges = reader.rows("hand_cuts", 7);
    std::map<double, int> lines;
    for (std::size_t k = 0; k < edges.size(); k += 7) {
        ++lines[edges[k]];
        const Vector3 along(edges[k + 4] - edges[k + 1], edges[k + 5] - edges[k + 2],
                            edges[k + 6] - edges[k + 3]);
        if (lines.size() >= 2) {
            EXPECT_LT((along.cwiseAbs() - Vector3(0, 0.03, 0)).norm(), 1e-9);
        } else {
            EXPECT_NEAR(along.norm(), 0.032, 1e-9) << "from 2 mm above the surface";
        }
    }
    ASSERT_EQ(lines.size(), 3U);
    EXPECT_GT(reader.mesh().nodes.size(), reader.first_mesh().nodes.size() + 8);
    const auto replayed = livetet(viewed.folder, "track --replay result.h5");
    EXPECT_EQ(replayed.status, 0) << replayed.out << replayed.err;
}

TEST(View, TheKnifeIsOfRunsThatMayBeCut) {
    Viewed viewed;
    (void)viewed.run();
    const auto outcome = viewed.script("key k\ndrag left 215 330 215 130\ntell\n", "--off-screen");
    EXPECT_EQ(outcome.status, 0);
    EXPECT_NE(outcome.err.find("nothing is cut here, expected livetet view SCENE, and "
                               "track.cut_by_hand_mm"),
              std::string::npos)
        << outcome.err;
}

TEST(View, WithoutAnImageSlicesAreLeftOutAndSaid) {
    Tracked tracked;
    tracked.record();
    (void)tracked.run();
    const auto outcome = livetet(
        tracked.folder, "view result.h5 --screenshot shot.png --size 640 400", with_display);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("left out: slices"), std::string::npos) << outcome.err;
    EXPECT_EQ(Picture(tracked.folder / "shot.png").height, 400);
}

TEST(View, AKilledRunIsShownAsFarAsItIsWhole) {
    Viewed viewed;
    viewed.tracker.hold_s = 40;
    viewed.record();
    write_sequence(viewed.folder / "press.igs.mha", viewed.recording);
    EXPECT_EQ(livetet(viewed.folder, "track scene.yaml", "timeout -s KILL 12").status,
              128 + SIGKILL);
    for (const auto& entry : std::filesystem::directory_iterator(viewed.folder.path()))
        if (entry.path().filename().string().starts_with(".result.part"))
            std::filesystem::rename(entry.path(), viewed.folder / "left.h5");
    // `timeout` ends before the run that it killed, which holds its file for a moment more.
    const auto is_free = [&] {
        try {
            return ResultReader(viewed.folder / "left.h5").frame_count() > 0;
        } catch (const Error&) {
            return false;
        }
    };
    for (int i = 0; i < 100 && !is_free(); ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
    const std::size_t frames = ResultReader(viewed.folder / "left.h5").frame_count();
    EXPECT_GT(frames, 30u);
    const auto outcome =
        viewed.script("time 1000\ntell\nscreenshot last.png\n", "--off-screen", "left.h5");
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.err.find("killed"), std::string::npos) << outcome.err;
    EXPECT_NEAR(number(Viewed::told(outcome).at(0).at("sensors").at("Sensor").at("base_mm"), 2),
                100, 0.5);
}

TEST(View, ABodyThatIsCarriedAwayIsInThePicture) {
    Viewed viewed;
    test::write_text(
        viewed.folder / "solve.yaml",
        "mesh: {file: block.h5}\noutput: {file: solved.h5}\n"
        "drive: [{half_space_mm: [0, 0, 1, 0, 0, 1], displacement_mm: [400, 0, 0]}]\n");
    ASSERT_EQ(livetet(viewed.folder, "solve solve.yaml").status, 0);
    const auto outcome =
        livetet(viewed.folder, "view solved.h5 --screenshot far.png --size 640 400", with_display);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_GT(blue_pixels(Picture(viewed.folder / "far.png"), {80, 640}), 1000);
}

TEST(View, ASolveIsColouredByStress) {
    Viewed viewed;
    test::write_text(
        viewed.folder / "solve.yaml",
        "mesh: {file: block.h5}\nfix: [{half_space_mm: [0, 0, 1, 0, 0, 1]}]\nimage: block.nii.gz\n"
        "drive: [{sphere_mm: [100, 50, 100, 20], where: surface, displacement_mm: [0, 0, -10]}]\n"
        "output: {file: solved.h5, fields: [von_mises]}\n");
    ASSERT_EQ(livetet(viewed.folder, "solve solve.yaml").status, 0);
    const auto outcome = livetet(
        viewed.folder, "view solved.h5 --colour stress --screenshot stress.png --size 640 400",
        with_display);
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    expect_as_kept(viewed.folder / "stress.png", "stress.png");
}

TEST(View, WhatIsWrongIsOneLine) {
    Viewed viewed;
    (void)viewed.run();
    const auto refused = [&](const std::string& arguments,
                             std::initializer_list<std::string> parts) {
        test::expect_refused(livetet(viewed.folder, arguments, with_display), parts);
    };
    refused("view nowhere.h5", {"nowhere.h5"});
    refused("view block.h5 --screenshot a.png", {"block.h5"});
    refused("view result.h5 --off-screen", {"--off-screen", "--script"});
    refused("view result.h5 --frame 100000", {"--frame 100000", "result.h5", "expected 1 to"});
    refused("view result.h5 --colour stress --screenshot a.png", {"von_mises"});
    refused("view result.h5 --colour error --screenshot a.png", {"result.h5", "track.targets"});
    refused("view result.h5 --screenshot nowhere/a.png", {"nowhere"});
    refused("view result.h5 --record a.avi", {".avi", ".ogv"});
    refused("view result.h5 --for 3", {"--for", "scene"});
    refused("view scene.yaml --frame 2 --screenshot a.png", {"--frame", "recorded"});
    GreyImage away = striped_image();
    away.ras_from_voxel(0, 3) = 5;
    write_image(viewed.folder / "away.nii.gz", away);
    refused("view result.h5 --image away.nii.gz --screenshot a.png", {"away.nii.gz", "same place"});
    for (const auto& [text, part] :
         {std::pair("sceenshot a.png\n", "did you mean screenshot?"),
          {"screenshot result.h5\n", "expected a name that ends in .png"},
          {"\nframe\n", "script.txt:2"},
          {"frame 99999", "holds"},
          {"colour red", "expected one of displacement, stress, error"},
          {"frame 2\ncolour error", ":2: colour error: no error over the surface is stated"},
          {"colour stress", ":1: colour stress: there are no stresses"},
          {"pull 0 0 0 0 0 5", ":1: a recorded result cannot be pulled"},
          {"# nothing", "no command"}})
        test::expect_refused(viewed.script(text, "--off-screen"), {"script.txt", part});
    EXPECT_FALSE(std::filesystem::exists(viewed.folder / "a.png"));
}

TEST(View, ARecordingBecomesAVideoOrPictures) {
    Viewed viewed;
    (void)viewed.run();
    ASSERT_EQ(livetet(viewed.folder, "view result.h5 --record all.ogv --rate 5 --size 320 240",
                      with_display)
                  .status,
              0);
    EXPECT_EQ(test::text_of(viewed.folder / "all.ogv").substr(0, 4), "OggS");
    ASSERT_EQ(
        livetet(viewed.folder, "view result.h5 --record all --rate 2 --size 320 240", with_display)
            .status,
        0);
    EXPECT_EQ(Picture(viewed.folder / "all/000003.png").width, 320);
    ASSERT_EQ(
        livetet(viewed.folder, "view result.h5 --record all --rate 1 --size 400 300", with_display)
            .status,
        0);
    std::size_t pictures = 0;
    for (const auto& entry : std::filesystem::directory_iterator(viewed.folder / "all")) {
        EXPECT_EQ(Picture(entry.path()).width, 400)
            << entry.path() << " is of the recording before";
        ++pictures;
    }
    EXPECT_GT(pictures, 1u);
}

}  // namespace
}  // namespace livetet
#endif
