#include "io/dicom_planes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "files.hpp"

namespace livetet::dicom {
namespace {

using namespace testing_files;

std::vector<Plane> planes_at(const std::vector<double>& z) {
    std::vector<Plane> planes;
    for (const double height : z)
        planes.push_back({fmt::format("at {}", height),
                          {5, 4},
                          Eigen::Vector3d(1, 2, height),
                          Eigen::Vector3d::UnitX(),
                          Eigen::Vector3d::UnitY(),
                          {0.5, 0.7},
                          {},
                          {}});
    return planes;
}

TEST(DicomPlanes, AnyOrderGivesOneGrid) {
    std::vector<double> z;
    for (int n = 0; n < 40; ++n) z.push_back(-7 + 1.25 * n);
    const ImageGrid expected = stack_image(planes_at(z), "ct").grid;
    EXPECT_EQ(expected.size, (std::array<int, 3>{5, 4, 40}));
    EXPECT_LT((1e3 * expected.spacing() - Eigen::Vector3d(0.5, 0.7, 1.25)).norm(), 1e-12);
    std::mt19937 random(1);
    for (int times = 0; times < 10; ++times) {
        std::shuffle(z.begin(), z.end(), random);
        const Stack stack = stack_image(planes_at(z), "ct");
        EXPECT_TRUE(stack.grid.ras_from_voxel.isApprox(expected.ras_from_voxel, 1e-12));
        for (std::size_t p = 0; p < z.size(); ++p)
            EXPECT_EQ(stack.slice_of_plane[p], std::lround((z[p] + 7) / 1.25));
    }
}

TEST(DicomPlanes, RoundedPositionsAreEvenAndMissingSlicesAreFoundAnywhere) {
    std::vector<double> z;
    for (int n = 0; n < 30; ++n) z.push_back(std::round(100 * 0.624 * n) / 100);
    EXPECT_EQ(error_of([&] { stack_image(planes_at(z), "ct"); }), "");
    for (std::size_t gone = 1; gone + 1 < z.size(); ++gone) {
        auto some = z;
        some.erase(some.begin() + static_cast<std::ptrdiff_t>(gone));
        EXPECT_TRUE(says(error_of([&] { stack_image(planes_at(some), "ct"); }),
                         {fmt::format("at {}:", z[gone + 1]).c_str(), "1 slice", "missing"}))
            << gone;
    }
}

TEST(DicomPlanes, SpacingsThatDriftAreUneven) {
    std::vector<double> z{0};
    for (int n = 1; n < 60; ++n) z.push_back(z.back() + (n < 30 ? 1.0 : 1.05));
    EXPECT_TRUE(says(error_of([&] { stack_image(planes_at(z), "ct"); }), {"evenly spaced"}));
}

TEST(DicomPlanes, AShiftThatIsAcceptedIsKept) {
    std::vector<double> z;
    for (int n = 0; n < 200; ++n) z.push_back(0.6 * n);
    const auto tilted = [&](double degrees) {
        auto planes = planes_at(z);
        for (Plane& p : planes)
            p.position.y() += std::tan(degrees * std::numbers::pi / 180) * p.position.z();
        return planes;
    };
    EXPECT_TRUE(says(error_of([&] { stack_image(tilted(0.3), "ct"); }),
                     {"at 119.", "sideways by 0.625 mm", "tilt"}));
    const auto planes = tilted(0.1);
    const Eigen::Vector3d last = planes.back().position;
    for (const Stack& stack : {stack_image(planes, "ct"), stack_segmentation(planes, "seg")}) {
        const Eigen::Vector4d place = stack.grid.ras_from_voxel * Eigen::Vector4d(0, 0, 199, 1);
        EXPECT_LT((1e3 * place.head<3>() - Eigen::Vector3d(-last.x(), -last.y(), last.z())).norm(),
                  1e-9);
    }
}

TEST(DicomPlanes, OneSliceHasItsStatedThickness) {
    auto planes = planes_at({3});
    EXPECT_TRUE(says(error_of([&] { stack_image(planes, "ct"); }), {"ct", "thickness"}));
    planes[0].thickness = 5;
    EXPECT_NEAR(stack_image(planes, "ct").grid.spacing()[2], 5e-3, 1e-12);
    planes[0].slice_step = 4;
    EXPECT_NEAR(stack_image(planes, "ct").grid.spacing()[2], 4e-3, 1e-12);
    EXPECT_NEAR(stack_segmentation(planes, "seg").grid.spacing()[2], 4e-3, 1e-12);
}

TEST(DicomPlanes, FramesOfASegmentationLeaveGaps) {
    auto planes = planes_at({4, 0, 4, 10});
    EXPECT_TRUE(says(error_of([&] { stack_segmentation(planes, "seg"); }),
                     {"at 10:", "6 mm above", "multiple of 4 mm"}));
    for (Plane& p : planes) p.slice_step = 2;
    const Stack stack = stack_segmentation(planes, "seg");
    EXPECT_EQ(stack.grid.size[2], 6);
    EXPECT_EQ(stack.slice_of_plane, (std::vector<int>{2, 0, 2, 5}));
}

TEST(DicomPlanes, PositionsThatDICOMDoesNotAllowAreRefused) {
    const auto refuses = [](const std::function<void(Plane&)>& change,
                            std::initializer_list<const char*> words) {
        Plane plane = planes_at({0}).front();
        change(plane);
        EXPECT_TRUE(says(error_of([&] { check_plane(plane); }), words));
    };
    refuses([](Plane& p) { p.position[1] = INFINITY; }, {"Image Position"});
    refuses([](Plane& p) { p.spacing[0] = 0; }, {"Pixel Spacing", "positive"});
    refuses([](Plane& p) { p.spacing[1] = NAN; }, {"Pixel Spacing", "positive"});
    refuses([](Plane& p) { p.row *= 1.1; }, {"Image Orientation", "unit vectors"});
    refuses([](Plane& p) { p.column = p.row; }, {"right angles"});
    refuses([](Plane& p) { p.row[0] = NAN; }, {"Image Orientation"});
    Plane rounded = planes_at({0}).front();
    rounded.row = {0.9999, 0.001, 0};
    EXPECT_EQ(error_of([&] { check_plane(rounded); }), "");
    EXPECT_NEAR(rounded.row.norm(), 1, 1e-15);
    EXPECT_NEAR(rounded.row.dot(rounded.column), 0, 1e-15);
}

}  // namespace
}  // namespace livetet::dicom
