// The fields and images of `livetet warp` by the eyes of ITK: its readers, its transforms, its
// resampling.
#ifdef LIVETET_IMAGES
#define ITK_USE_SYSTEM_EIGEN
#include <itkAffineTransform.h>
#include <itkDisplacementFieldTransform.h>
#include <itkImageFileReader.h>
#include <itkNiftiImageIO.h>
#include <itkResampleImageFilter.h>

#include "apps/commands/warped_block.hpp"

namespace livetet {
namespace {

using test::livetet;
using test::WarpedBlock;
using Grey = itk::Image<float, 3>;
using Field = itk::Image<itk::Vector<double, 3>, 3>;

template <class ImageType>
typename ImageType::Pointer read(const std::filesystem::path& path) {
    auto reader = itk::ImageFileReader<ImageType>::New();
    reader->SetImageIO(itk::NiftiImageIO::New());
    reader->SetFileName(path.string());
    reader->Update();
    return reader->GetOutput();
}

Grey::Pointer resample(Grey* image, const itk::Transform<double, 3, 3>* transform) {
    auto filter = itk::ResampleImageFilter<Grey, Grey>::New();
    filter->SetInput(image);
    filter->SetReferenceImage(image);
    filter->UseReferenceImageOn();
    filter->SetTransform(transform);
    filter->Update();
    return filter->GetOutput();
}

itk::DisplacementFieldTransform<double, 3>::Pointer transform_of(
    const std::filesystem::path& path) {
    auto transform = itk::DisplacementFieldTransform<double, 3>::New();
    transform->SetDisplacementField(read<Field>(path));
    return transform;
}

/// x' = A x + t about the block's middle, RAS.
Eigen::Affine3d affine_motion() {
    Eigen::Affine3d motion = Eigen::Affine3d::Identity();
    const Vector3 middle(0.03, 0.025, 0.02);
    motion.linear() << 1.1, 0.08, 0, -0.1, 0.95, 0.05, 0.03, 0, 0.9;
    motion.translation() = middle + Vector3(0.004, -0.006, 0.005) - motion.linear() * middle;
    return motion;
}

/// Grey values that are no plane: interpolation counts.
float wave(const Vector3& x) {
    return static_cast<float>(500 + 200 * std::sin(150 * x.x()) +
                              100 * std::cos(130 * x.y() + 90 * x.z()));
}

/// The largest difference of two images, over the block's inside as `motion` leaves it.
double largest_difference(const WarpedBlock& block, const Eigen::Affine3d& motion,
                          const GreyImage& ours, Grey* theirs) {
    double worst = 0;
    std::size_t compared = 0;
    for (int k = 0; k < 40; ++k)
        for (int j = 0; j < 40; ++j)
            for (int i = 0; i < 40; ++i) {
                const Vector3 rest = motion.inverse() * block.place(i, j, k);
                if ((rest.array() < 1e-4).any() ||
                    (rest.array() > Eigen::Array3d(0.06, 0.05, 0.04) - 1e-4).any())
                    continue;
                worst = std::max<double>(worst,
                                         std::abs(ours.at(i, j, k) - theirs->GetPixel({i, j, k})));
                ++compared;
            }
    EXPECT_GT(compared, 5000u);
    return worst;
}

class WarpByItk : public testing::TestWithParam<bool> {
  protected:
    WarpedBlock block{GetParam()};

    GreyImage warp(const WarpedBlock::Move& move) {
        write_image(block.folder / "image.nii.gz", block.image<float>(wave));
        block.write_result("result.h5", {move});
        const auto outcome =
            livetet(block.folder,
                    "warp result.h5 --image image.nii.gz -o out.nii.gz --rind-mm 0 "
                    "--inverse-field inverse.nii.gz --forward-field forward.nii.gz");
        EXPECT_EQ(outcome.status, 0) << outcome.err;
        return read_grey_image(block.folder / "out.nii.gz");
    }
};

TEST_P(WarpByItk, AnAffineMotionIsItsAffineResample) {
    const Eigen::Affine3d motion = affine_motion(), back = motion.inverse();
    const GreyImage ours = warp([&](const Vector3& x) { return Vector3(motion * x); });
    // ITK's world is LPS, mm; it resamples by the way back.
    auto transform = itk::AffineTransform<double, 3>::New();
    itk::Matrix<double, 3, 3> A;
    itk::Vector<double, 3> t;
    constexpr double lps[] = {-1, -1, 1};
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) A[r][c] = lps[r] * lps[c] * back.linear()(r, c);
        t[r] = 1e3 * lps[r] * back.translation()[r];
    }
    transform->SetMatrix(A);
    transform->SetOffset(t);
    const Grey::Pointer image = read<Grey>(block.folder / "image.nii.gz");
    EXPECT_LT(largest_difference(block, motion, ours, resample(image, transform)),
              0.05);  // of values of 200 to 800
}

TEST_P(WarpByItk, ItsResamplingByTheInverseFieldGivesTheSameImage) {
    const Eigen::Affine3d motion = affine_motion();
    const auto bend = [&](const Vector3& x) {
        return Vector3(motion * x + Vector3(0, 0, 4 * x.x() * x.y()));
    };
    const GreyImage ours = warp(bend);
    const Grey::Pointer image = read<Grey>(block.folder / "image.nii.gz");
    const Grey::Pointer theirs = resample(image, transform_of(block.folder / "inverse.nii.gz"));
    const float empty = *std::min_element(ours.values.begin(), ours.values.end());
    std::size_t same = 0, moved = 0;
    for (int k = 0; k < 40; ++k)
        for (int j = 0; j < 40; ++j)
            for (int i = 0; i < 40; ++i) {
                const double mine = ours.at(i, j, k), its = theirs->GetPixel({i, j, k});
                if (mine == empty) continue;  // empty: a field cannot say so
                EXPECT_NEAR(mine, its, 0.05) << i << ' ' << j << ' ' << k;
                ++same;
                moved += std::abs(mine - image->GetPixel({i, j, k})) > 5;
            }
    EXPECT_GT(same, 55000u);
    EXPECT_GT(moved, 5000u);
}

TEST_P(WarpByItk, ItMovesPointsByTheForwardField) {
    const auto bend = [](const Vector3& x) {
        return Vector3(x.x() + 0.004, x.y() + 2 * x.x() * x.x(), x.z() - 0.1 * x.y());
    };
    warp(bend);
    const auto transform = transform_of(block.folder / "forward.nii.gz");
    for (const Vector3& x :
         {Vector3(0.03, 0.025, 0.02), Vector3(0.012, 0.041, 0.008), Vector3(0.05, 0.01, 0.03)}) {
        const double lps[] = {-1e3 * x.x(), -1e3 * x.y(), 1e3 * x.z()};
        const auto moved = transform->TransformPoint(itk::Point<double, 3>(lps));
        const Vector3 ras(-moved[0] / 1e3, -moved[1] / 1e3, moved[2] / 1e3);
        EXPECT_LT((ras - bend(x)).norm(), 1e-4);  // P1 tets of 1 cm, of what bends by 2/m
        EXPECT_GT((ras - x).norm(), 4e-3);
    }
}

INSTANTIATE_TEST_SUITE_P(OfAnUprightAndAnObliqueImage, WarpByItk, testing::Bool());

}  // namespace
}  // namespace livetet
#endif
