#ifdef LIVETET_IMAGES
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "apps/phantom/phantom_images.hpp"
#include "apps/phantom/phantom_shape.hpp"
#include "geometry/transform.hpp"
#include "image/image_markers.hpp"
#include "io/fiducial_file.hpp"
#include "io/image_file.hpp"
#include "io/registration_file.hpp"
#include "support/program.hpp"

namespace livetet {
namespace {

using test::expect_refused;
using test::Folder;
using test::livetet;
using test::text_of;

double distance_to_truth(const Vector3& x) {
    double least = 1;
    for (const NamedPoint& f : phantom::fiducials())
        least = std::min(least, (f.position - x).norm());
    return least;
}

/// The markers lie half in the container, whose shell is bright: voxels of 1.5 mm, noise of 16 on a
/// contrast of 900.
TEST(Fiducials, ThePhantomsAreFoundWithinAThirtiethOfAVoxel) {
    double squares = 0, worst = 0;
    for (const unsigned seed : {1, 2}) {
        const auto found =
            find_markers(make_phantom_images(0.0015, seed).image, {.diameter = 0.01});
        ASSERT_GE(found.size(), 5u);
        for (int m = 0; m < 5; ++m) {
            const double off = distance_to_truth(found[m].centre);
            squares += off * off / 10;
            worst = std::max(worst, off);
        }
        if (found.size() > 5) {
            EXPECT_LT(found[5].score(), 0.5 * found[4].score());
        }
    }
    RecordProperty("rms_um", static_cast<int>(1e6 * std::sqrt(squares)));
    EXPECT_LT(1e3 * std::sqrt(squares), 0.05);
    EXPECT_LT(1e3 * worst, 0.1);
}

TEST(Fiducials, FoundInTheImageTheyRegisterInAnyOrderAndAPictureShowsThem) {
    const Folder folder;
    write_image(folder / "image.nii.gz", make_phantom_images(0.002, 1).image);
    const auto outcome = livetet(
        folder,
        "fiducials image.nii.gz --diameter-mm 10 --count 5 -o found.mrk.json --picture found.png",
        "env -u DISPLAY");  // a virtual one is its own affair
    ASSERT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_EQ(outcome.out.find("warning"), std::string::npos) << outcome.out;
    EXPECT_EQ(text_of(folder / "found.png").substr(1, 3), "PNG");
    const auto found = read_fiducials(folder / "found.mrk.json");
    ASSERT_EQ(found.size(), 5u);
    for (const NamedPoint& p : found)
        EXPECT_LT(1e3 * distance_to_truth(p.position), 0.2);  // of voxels of 2 mm

    const RigidTransform<Tracker, ImageFrame> tracker_from_image{
        rotation_of_vector({0.7, -0.4, 1.1}), {0.3, 0.1, -0.2}};
    std::vector<NamedPoint> touched = phantom::fiducials();
    for (NamedPoint& p : touched) p.position = tracker_from_image * p.position;
    write_fiducials(folder / "touched.mrk.json", touched);
    const auto registered = livetet(folder,
                                    "register --tracker touched.mrk.json --image found.mrk.json "
                                    "--any-order -o registration.json");
    ASSERT_EQ(registered.status, 0) << registered.err;
    const FiducialRegistration r = read_registration(folder / "registration.json");
    EXPECT_LT(1e3 * r.fre, 0.2);
    EXPECT_LT(1e3 * (r.image_from_base * (tracker_from_image * phantom::organ_centre()) -
                     phantom::organ_centre())
                        .norm(),
              0.1);
}

TEST(Fiducials, RefusesWhatIsNotThereAndSaysWhereTheNextIsAsGood) {
    const Folder folder;
    write_image(folder / "image.nii.gz", make_phantom_images(0.002, 1).image);
    expect_refused(livetet(folder, "fiducials image.nii.gz --diameter-mm 10 --count 100"),
                   {"image.nii.gz", "100", "10 mm"});
    expect_refused(livetet(folder, "fiducials image.nii.gz --diameter-mm 3 --count 5"),
                   {"image.nii.gz", "two voxels"});
    expect_refused(
        livetet(folder, "fiducials image.nii.gz --diameter-mm 10 --count 5 --picture found.jpg"),
        {"found.jpg", ".png"});
    expect_refused(livetet(folder, "fiducials image.nii.gz --diameter-mm -1 --count 5"),
                   {"--diameter-mm"});
    expect_refused(livetet(folder, "fiducials gone.nii.gz --diameter-mm 10 --count 5"),
                   {"gone.nii.gz"});
    const auto four = livetet(folder, "fiducials image.nii.gz --diameter-mm 10 --count 4");
    EXPECT_EQ(four.status, 0);
    EXPECT_NE(four.out.find("warning: the next best"), std::string::npos) << four.out;
}

}  // namespace
}  // namespace livetet
#endif
