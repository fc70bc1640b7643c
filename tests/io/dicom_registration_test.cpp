// The written objects by the eyes of pydicom, which shares no code with GDCM.
#ifdef LIVETET_IMAGES
#include "io/dicom_registration.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <sstream>

#include "dicom_writer.hpp"
#include "files.hpp"
#include "io/image_file.hpp"

namespace livetet {
namespace {

using namespace testing_files;
using namespace testing_dicom;

namespace fs = std::filesystem;

const DicomDerivation test_derivation{"Deformed for a test", "deformed", "0.2.0", 1};

bool have_pydicom() { return std::system("python3 -c 'import pydicom' 2>/dev/null") == 0; }

/// Prints, for some points of the registered frame, the point and the place in the source's images
/// that it shows, by equation C.20.3-1 of DICOM PS3.3, in mm (LPS).
constexpr const char* apply_registration = R"(
import struct, sys
import pydicom
object = pydicom.dcmread(sys.argv[1])
assert object.SOPClassUID == '1.2.840.10008.5.1.4.1.1.66.3' and object.Modality == 'REG'
assert object.FrameOfReferenceUID == '1.2.826.0.1.33333333'
assert object.StudyInstanceUID == '1.2.826.0.1.22222222'
assert str(object.PatientName) == 'Secret^Name'
item = object.DeformableRegistrationSequence[0]
assert item.SourceFrameOfReferenceUID == object.FrameOfReferenceUID
assert [str(r.ReferencedSOPInstanceUID) for r in item.ReferencedImageSequence] == ['1.2.3.1', '1.2.3.101', '1.2.3.201']
def matrix(sequence):
    assert sequence[0].FrameOfReferenceTransformationMatrixType == 'RIGID'
    m = [float(v) for v in sequence[0].FrameOfReferenceTransformationMatrix]
    return [m[4 * r:4 * r + 4] for r in range(4)]
pre = matrix(item.PreDeformationMatrixRegistrationSequence)
post = matrix(item.PostDeformationMatrixRegistrationSequence)
def times(m, x):
    return [sum(m[r][c] * x[c] for c in range(3)) + m[r][3] for r in range(3)]
grid = item.DeformableRegistrationGridSequence[0]
size = [int(v) for v in grid.GridDimensions]
step = [float(v) for v in grid.GridResolution]
origin = [float(v) for v in grid.ImagePositionPatient]
row, column = [float(v) for v in grid.ImageOrientationPatient[:3]], [float(v) for v in grid.ImageOrientationPatient[3:]]
depth = [row[1] * column[2] - row[2] * column[1], row[2] * column[0] - row[0] * column[2], row[0] * column[1] - row[1] * column[0]]
assert len(grid.VectorGridData) == 12 * size[0] * size[1] * size[2]
registered = object.DeformableRegistrationSequence[1]
assert str(registered.ReferencedImageSequence[0].ReferencedSOPInstanceUID) == '1.2.9.1'
assert 'DeformableRegistrationGridSequence' not in registered
print(*size)
for k in range(size[2]):
    for j in range(size[1]):
        for i in range(size[0]):
            at = 12 * (i + size[0] * (j + size[1] * k))
            d = struct.unpack('<3f', grid.VectorGridData[at:at + 12])
            x = [origin[a] + i * step[0] * row[a] + j * step[1] * column[a] + k * step[2] * depth[a] for a in range(3)]
            moved = [p + v for p, v in zip(times(pre, x), d)]
            print(*x, *times(post, moved))
)";

std::string run_python(const fs::path& folder, const char* script, const fs::path& argument) {
    write_bytes(folder / "script.py", script);
    const std::string command =
        fmt::format("python3 '{}' '{}' >'{}' 2>&1", (folder / "script.py").string(),
                    argument.string(), (folder / "printed.txt").string());
    const int status = std::system(command.c_str());
    std::ifstream in(folder / "printed.txt");
    std::ostringstream text;
    text << in.rdbuf();
    EXPECT_EQ(status, 0) << text.str();
    return text.str();
}

/// Where the tissue that is at x (m, RAS) was at rest.
Eigen::Vector3d rest_place(const Eigen::Vector3d& x) {
    return x + Eigen::Vector3d(0.004 + 0.3 * x.y(), -0.002 + 0.1 * x.x(), 0.5 * x.z() * x.x());
}

Image<Eigen::Vector3f> field_on(const ImageGrid& grid) {
    Image<Eigen::Vector3f> field{grid.size, grid.ras_from_voxel, {}};
    for (int k = 0; k < grid.size[2]; ++k)
        for (int j = 0; j < grid.size[1]; ++j)
            for (int i = 0; i < grid.size[0]; ++i) {
                const Eigen::Vector3d x =
                    (grid.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>();
                field.values.push_back((rest_place(x) - x).cast<float>());
            }
    return field;
}

TEST(DicomRegistration, PydicomFindsTheRestPlaceOfEachVoxel) {
    if (!have_pydicom()) GTEST_SKIP() << "python3-pydicom is not installed: objects are not read";
    for (const bool left_handed : {false, true}) {
        const fs::path folder = fresh_folder();
        auto slices = series_of(3);
        write_series(folder / "ct", slices);
        ImageGrid grid = grid_of(read_grey_image(folder / "ct"));
        // An oblique grid; its slices may run against row x column.
        const Eigen::Matrix3d turn =
            Eigen::AngleAxisd(0.6, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
        grid.ras_from_voxel.topLeftCorner<3, 3>() =
            turn * grid.ras_from_voxel.topLeftCorner<3, 3>();
        if (left_handed) grid.ras_from_voxel.col(2) *= -1;
        write_dicom_registration(folder / "reg.dcm", {folder / "ct", {}}, field_on(grid),
                                 test_derivation, {"1.2.9", {{ct_image, "1.2.9.1"}}, 0});
        std::istringstream printed(run_python(folder, apply_registration, folder / "reg.dcm"));
        std::array<int, 3> size{};
        printed >> size[0] >> size[1] >> size[2];
        EXPECT_EQ(size, grid.size);
        double worst_mm = 0, moved_mm = 0, place_mm = 0;
        int points = 0;
        const Eigen::Array3d ras_m_from_lps_mm(-1e-3, -1e-3, 1e-3);
        const Eigen::Matrix4d voxel_from_ras = grid.ras_from_voxel.inverse();
        for (Eigen::Vector3d x, y; printed >> x[0] >> x[1] >> x[2] >> y[0] >> y[1] >> y[2];
             ++points) {
            const Eigen::Vector3d at = ras_m_from_lps_mm * x.array(),
                                  rest = ras_m_from_lps_mm * y.array();
            worst_mm = std::max(worst_mm, 1e3 * (rest - rest_place(at)).norm());
            moved_mm = std::max(moved_mm, 1e3 * (rest - at).norm());
            const Eigen::Vector3d voxel = (voxel_from_ras * at.homogeneous()).head<3>();
            place_mm = std::max(place_mm, (grid.spacing().array() *
                                           (voxel - voxel.array().round().matrix()).array())
                                                  .matrix()
                                                  .norm() *
                                              1e3);
        }
        EXPECT_EQ(points, 4 * 3 * 3);
        EXPECT_LT(worst_mm, 0.01);
        EXPECT_LT(place_mm, 0.01);  // the points are voxels of the grid
        EXPECT_GT(moved_mm, 4);     // or it would show nothing
    }
}

constexpr const char* read_series = R"(
import glob, struct, sys
import pydicom
for file in sorted(glob.glob(sys.argv[1] + '/*.dcm')):
    slice = pydicom.dcmread(file)
    count = slice.Rows * slice.Columns
    values = struct.unpack('<%dH' % count, slice.PixelData)
    print(*slice.ImagePositionPatient, slice.PixelSpacing[0], slice.PixelSpacing[1], slice.Rows, slice.Columns,
          *[v * slice.RescaleSlope + slice.RescaleIntercept for v in values])
)";

TEST(DicomRegistration, PydicomReadsADerivedSeries) {
    if (!have_pydicom()) GTEST_SKIP() << "python3-pydicom is not installed: objects are not read";
    const fs::path folder = fresh_folder();
    write_series(folder / "ct", series_of(3));
    GreyImage image = read_grey_image(folder / "ct");
    for (float& value : image.values) value = std::round(value / 2) + 7;
    fs::create_directories(folder / "out");
    write_dicom_series(folder / "out", {folder / "ct", {}}, image, test_derivation);
    std::istringstream printed(run_python(folder, read_series, folder / "out"));
    for (int k = 0; k < 3; ++k) {
        Eigen::Vector3d position;
        double row_step = 0, column_step = 0;
        int rows = 0, columns = 0;
        printed >> position[0] >> position[1] >> position[2] >> row_step >> column_step >> rows >>
            columns;
        EXPECT_LT((position - Eigen::Vector3d(10, 20, 30 + 3 * k)).norm(), 0.01);
        EXPECT_EQ(row_step, 2);
        EXPECT_EQ(column_step, 0.5);
        ASSERT_EQ(std::pair(rows, columns), std::pair(3, 4));
        for (int n = 0; n < 12; ++n) {
            double value = 0;
            printed >> value;
            EXPECT_EQ(value, image.at(n % 4, n / 4, k)) << n << ' ' << k;
        }
    }
}

TEST(DicomRegistration, WhatCannotBeStatedIsRefused) {
    const fs::path folder = fresh_folder();
    write_series(folder / "ct", series_of(2));
    ImageGrid grid = grid_of(read_grey_image(folder / "ct"));
    const auto write = [&](const fs::path& source) {
        write_dicom_registration(folder / "reg.dcm", {source, {}}, field_on(grid), test_derivation,
                                 {});
    };
    gdcm::DataSet set = slice_elements({});
    set.Remove(gdcm::Tag(0x0020, 0x0052));
    fs::create_directories(folder / "unplaced");
    write_object(folder / "unplaced" / "s.dcm", set, ct_image);
    EXPECT_TRUE(
        says(error_of([&] { write(folder / "unplaced"); }), {"s.dcm", "Frame of Reference UID"}));
    grid.ras_from_voxel(0, 1) += 1e-3;
    EXPECT_TRUE(says(error_of([&] { write(folder / "ct"); }), {"reg.dcm", "right angles"}));
    EXPECT_FALSE(fs::exists(folder / "reg.dcm"));
}

}  // namespace
}  // namespace livetet
#endif
