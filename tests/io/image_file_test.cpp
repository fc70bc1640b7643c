#include "io/image_file.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <cstring>
#include <map>

#include "base/file.hpp"
#include "files.hpp"

namespace livetet {
namespace {

using namespace testing_files;

/// An image with oblique axes; `handed` = -1 makes them left-handed.
LabelImage oblique(int handed, int largest) {
    LabelImage image{{4, 3, 5}, Eigen::Matrix4d::Identity(), std::vector<std::int32_t>(60, 0)};
    image.ras_from_voxel.topLeftCorner<3, 3>() =
        Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix() *
        Eigen::Vector3d(0.0007, 0.0009, 0.0013 * handed).asDiagonal();
    image.ras_from_voxel.topRightCorner<3, 1>() << -0.1, 0.05, 0.2;
    image.at(0, 0, 0) = 1;
    image.at(3, 0, 0) = 2;
    image.at(0, 2, 0) = 3;
    image.at(1, 1, 4) = largest;
    return image;
}

void expect_same_image(const LabelImage& a, const LabelImage& b) {
    EXPECT_EQ(a.size, b.size);
    EXPECT_EQ(a.values, b.values);
    EXPECT_LT((a.ras_from_voxel - b.ras_from_voxel).cwiseAbs().maxCoeff(), 1e-8);  // float, in mm
}

template <class T>
void patch(const std::filesystem::path& path, std::size_t offset, T value) {
    std::string bytes = read_text_file(path);
    std::memcpy(bytes.data() + offset, &value, sizeof(T));
    write_bytes(path, bytes);
}

TEST(ImageFile, LabelsComeBackAtTheirPlaceInSpace) {
    const auto folder = fresh_folder();
    for (const int handed : {1, -1})
        for (const char* name : {"a.nii", "a.nii.gz"}) {
            write_image(folder / name, oblique(handed, 7));
            expect_same_image(read_label_image(folder / name), oblique(handed, 7));
        }
}

TEST(ImageFile, LabelsAreStoredInTheSmallestTypeThatFits) {
    const auto folder = fresh_folder();
    for (const auto& [largest, bytes] :
         std::map<int, int>{{255, 1}, {256, 2}, {-1, 2}, {70000, 4}}) {
        write_image(folder / "a.nii", oblique(1, largest));
        EXPECT_EQ(std::filesystem::file_size(folder / "a.nii"), 352u + 60 * bytes) << largest;
        expect_same_image(read_label_image(folder / "a.nii"), oblique(1, largest));
    }
}

TEST(ImageFile, TheQformSaysTheSameAsTheSform) {
    const auto path = fresh_folder() / "a.nii";
    for (const int handed : {1, -1}) {
        write_image(path, oblique(handed, 7));
        patch<std::int16_t>(path, 254, 0);  // no sform
        expect_same_image(read_label_image(path), oblique(handed, 7));
    }
}

TEST(ImageFile, WithoutQformAndSformTheSpacingCounts) {
    const auto path = fresh_folder() / "a.nii";
    write_image(path, oblique(1, 7));
    patch<std::int32_t>(path, 252, 0);
    const Eigen::Matrix4d affine = read_label_image(path).ras_from_voxel;
    EXPECT_LT((affine.diagonal() - Eigen::Vector4d(0.0007, 0.0009, 0.0013, 1)).norm(), 1e-8);
    patch<char>(path, 123, 1);  // the file says metres
    EXPECT_NEAR(read_label_image(path).ras_from_voxel(0, 0), 0.7, 1e-6);
}

TEST(ImageFile, GreyValuesAreScaledAsTheHeaderSays) {
    GreyImage image{{2, 1, 1}, Eigen::Matrix4d::Identity(), {1.5f, -3}};
    const auto path = fresh_folder() / "g.nii";
    write_image(path, image);
    EXPECT_EQ(read_grey_image(path).values, image.values);
    patch<float>(path, 112, 2);
    patch<float>(path, 116, 10);
    EXPECT_EQ(read_grey_image(path).values, (std::vector<float>{13, 4}));
    EXPECT_TRUE(says(error_of([&] {
                         patch<float>(path, 112, 0.3f);
                         read_label_image(path);
                     }),
                     {"voxel (0, 0, 0)", "whole number"}));
    patch<float>(path, 356, NAN);
    EXPECT_TRUE(
        says(error_of([&] { read_grey_image(path); }), {"voxel (1, 0, 0)", "nan", "finite"}));
}

TEST(ImageFile, TruncationIsSeenAtAnyPlace) {
    const auto folder = fresh_folder();
    LabelImage image = oblique(1, 7);
    for (std::size_t n = 0; n < image.values.size(); ++n)
        image.values[n] = static_cast<int>(n * 37 % 251);
    for (const char* name : {"a.nii", "a.nii.gz"}) {
        write_image(folder / name, image);
        const std::string whole = read_text_file(folder / name);
        for (std::size_t n = 0; n < whole.size(); ++n) {
            write_bytes(folder / name, whole.substr(0, n));
            ASSERT_TRUE(says(error_of([&] { read_label_image(folder / name); }), {name}))
                << n << " bytes";
        }
    }
    write_image(folder / "a.nii", image);
    truncate_to(folder / "a.nii", 0.95);
    EXPECT_TRUE(says(error_of([&] { read_label_image(folder / "a.nii"); }),
                     {"expected 4 x 3 x 5", "truncated"}));
}

TEST(ImageFile, HostileHeadersAreRefused) {
    const auto path = fresh_folder() / "a.nii";
    const auto refuses = [&](std::size_t offset, auto value,
                             std::initializer_list<const char*> words) {
        write_image(path, oblique(1, 7));
        patch(path, offset, value);
        EXPECT_TRUE(says(error_of([&] { read_label_image(path); }), words)) << "at " << offset;
    };
    refuses(0, std::int32_t{7}, {"NIfTI image"});
    refuses(344, 'x', {"NIfTI image"});
    refuses(42, std::int16_t{-4}, {"-4 x 3 x 5"});
    refuses(42, std::int16_t{0}, {"0 x 3 x 5"});
    refuses(40, std::int16_t{2}, {"2 dimensions"});
    refuses(42, std::int16_t{32767}, {"found 60 bytes", "truncated"});
    refuses(70, std::int16_t{128}, {"colour"});
    refuses(70, std::int16_t{1792}, {"1792"});
    refuses(108, -1.0f, {"begin at byte -1"});
    refuses(108, float{NAN}, {"begin at byte nan"});
    refuses(280, float{NAN}, {"sform", "span"});
    const float zeros[12] = {};
    write_image(path, oblique(1, 7));
    std::string bytes = read_text_file(path);
    std::memcpy(bytes.data() + 280, zeros, sizeof zeros);
    write_bytes(path, bytes);
    EXPECT_TRUE(says(error_of([&] { read_label_image(path); }), {"sform", "span"}));
    write_image(path, oblique(1, 7));
    patch<std::int16_t>(path, 40, 4);
    patch<std::int16_t>(path, 48, 2);
    EXPECT_TRUE(says(error_of([&] { read_label_image(path); }), {"4 dimensions (2 volumes)"}));
}

TEST(ImageFile, OtherEndingsAndMissingFilesAreErrors) {
    const auto folder = fresh_folder();
    EXPECT_TRUE(
        says(error_of([&] { read_grey_image(folder / "a.tif"); }), {"'.tif'", ".nii.gz", ".nrrd"}));
    EXPECT_TRUE(
        says(error_of([&] { read_grey_image(folder / "a.nii"); }), {"a.nii", "no such file"}));
    EXPECT_TRUE(says(error_of([&] { write_image(folder / "a.png", GreyImage{}); }), {"'.png'"}));
    EXPECT_TRUE(
        says(error_of([&] { write_image(folder / "a.nii", LabelImage{}); }), {"no voxels"}));
    EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST(ImageFile, RealLabelsHaveTheirKnownVolumes) {
    LIVETET_DATA_OR_SKIP(data);
    const LabelImage image = read_label_image(data / "liver" / "cgal_liver_labels.nii.gz");
    EXPECT_EQ(image.size, (std::array<int, 3>{438, 353, 165}));
    std::map<int, double> millilitres;
    const double voxel = std::abs(image.ras_from_voxel.topLeftCorner<3, 3>().determinant()) * 1e6;
    for (const int label : image.values) millilitres[label] += voxel;
    EXPECT_NEAR(millilitres[1], 1605.2, 0.05);
    EXPECT_NEAR(millilitres[2], 159.5, 0.05);
    EXPECT_NEAR(millilitres[3], 9.0, 0.05);
}

TEST(ImageFile, RealCtShowsALiverWhereItsSegmentationDoes) {
    LIVETET_DATA_OR_SKIP(data);
    const GreyImage ct = read_grey_image(data / "ct" / "totalseg_example_ct.nii.gz");
    const LabelImage labels = read_label_image(data / "ct" / "totalseg_example_seg.nii.gz");
    EXPECT_EQ(ct.size, (std::array<int, 3>{122, 101, 112}));
    EXPECT_EQ(ct.ras_from_voxel, labels.ras_from_voxel);
    EXPECT_NEAR(ct.ras_from_voxel(0, 3), -0.17795632934570312, 1e-9);
    // The header places the segmentation on the CT's lowest slices, its content on the 30 highest.
    const int shift = ct.size[2] - labels.size[2];
    double sum = 0;
    int count = 0;
    for (int k = 0; k < labels.size[2]; ++k)
        for (int j = 0; j < labels.size[1]; ++j)
            for (int i = 0; i < labels.size[0]; ++i)
                if (labels.at(i, j, k) == 5) {
                    sum += ct.at(i, j, k + shift);
                    ++count;
                }
    ASSERT_GT(count, 100);
    EXPECT_NEAR(sum / count, 45, 5)
        << "Hounsfield units of a liver: the voxels' order is wrong otherwise";
}

}  // namespace
}  // namespace livetet
