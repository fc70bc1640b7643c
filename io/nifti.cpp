#include "io/nifti.hpp"

#include <Eigen/Dense>
#include <Eigen/Geometry>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <string>

#include <zlib.h>

#include "base/error.hpp"
#include "base/file.hpp"
#include "geometry/transform.hpp"
#include "io/text.hpp"

namespace livetet::nifti {

namespace {

namespace fs = std::filesystem;
static_assert(std::endian::native == std::endian::little,
              "the voxels are written in the machine's byte order");

/// Reads a plain or gzip-compressed file.
class GzReader {
  public:
    explicit GzReader(const fs::path& path)
        : where_(path.string()), file_(gzopen(path.c_str(), "rb")) {
        if (!file_) fail("{}: cannot be read", where_);
        gzbuffer(file_, 1 << 17);
    }
    ~GzReader() {
        if (file_) gzclose_r(file_);
    }
    GzReader(const GzReader&) = delete;
    GzReader& operator=(const GzReader&) = delete;

    /// Appends up to `count` bytes to `bytes`.
    void read(std::vector<char>& bytes, std::size_t count) {
        // Grow in steps, so that a wrong size in a header does not allocate memory before the data
        // exist.
        constexpr std::size_t piece = 1 << 24;
        while (count > 0) {
            const std::size_t wanted = std::min(count, piece), before = bytes.size();
            bytes.resize(before + wanted);
            const int got = gzread(file_, bytes.data() + before, static_cast<unsigned>(wanted));
            if (got < 0) fail("{}: its compressed data are damaged", where_);
            bytes.resize(before + got);
            if (static_cast<std::size_t>(got) < wanted) return;
            count -= wanted;
        }
    }
    /// Checks that the file ends here and, if compressed, its checksum.
    void finish() {
        char rest = 0;
        const int more = gzread(file_, &rest, 1);
        if (more > 0)
            fail(
                "{}: holds more bytes than its header's voxels: the header gives a wrong size or "
                "type",
                where_);
        const bool damaged = more < 0;
        if (gzclose_r(std::exchange(file_, nullptr)) != Z_OK || damaged)
            fail("{}: its compressed data are truncated or damaged at the end", where_);
    }

  private:
    std::string where_;
    gzFile file_;
};

/// Reads header fields in the machine's byte order.
class Fields {
  public:
    Fields(const std::vector<char>& bytes, bool swapped) : bytes_(bytes), swapped_(swapped) {}
    template <class T>
    T get(std::size_t offset, std::size_t index = 0) const {
        char raw[sizeof(T)];
        std::memcpy(raw, bytes_.data() + offset + index * sizeof(T), sizeof(T));
        if (swapped_) std::reverse(raw, raw + sizeof(T));
        T value;
        std::memcpy(&value, raw, sizeof(T));
        return value;
    }

  private:
    const std::vector<char>& bytes_;
    bool swapped_;
};

struct Header {
    bool swapped = false;
    std::array<std::int64_t, 8> dim{};
    int type = 0, xyz_units = 0, qform = 0, sform = 0;
    std::array<double, 4> pixdim{};
    double offset = 0, slope = 0, intercept = 0;
    std::array<double, 6> q{};  ///< quaternion b, c, d; offset x, y, z
    Eigen::Matrix<double, 3, 4> srow;
};

/// Parses a header. Version 1 (348 bytes) has 16-bit sizes and floats, version 2 (540 bytes) 64-bit
/// sizes and doubles. The arguments are byte offsets of the fields.
template <class Size, class Real, class Code>
Header parse(const Fields& f, std::size_t dim, std::size_t type, std::size_t pixdim,
             std::size_t offset, std::size_t slope, std::size_t units, std::size_t qform,
             std::size_t q) {
    Header h;
    for (int i = 0; i < 8; ++i) h.dim[i] = f.get<Size>(dim, i);
    h.type = f.get<std::int16_t>(type);
    for (int i = 0; i < 4; ++i) h.pixdim[i] = f.get<Real>(pixdim, i);
    h.slope = f.get<Real>(slope);
    h.intercept = f.get<Real>(slope, 1);
    h.xyz_units = f.get<Code>(units) & 7;
    h.qform = f.get<Code>(qform);
    h.sform = f.get<Code>(qform, 1);
    for (int i = 0; i < 6; ++i) h.q[i] = f.get<Real>(q, i);
    for (int i = 0; i < 12; ++i) h.srow(i / 4, i % 4) = f.get<Real>(q + 6 * sizeof(Real), i);
    h.offset =
        sizeof(Real) == 4 ? f.get<float>(offset) : static_cast<double>(f.get<std::int64_t>(offset));
    return h;
}

Header read_header(GzReader& in, std::vector<char>& bytes, const std::string& where) {
    in.read(bytes, 348);
    if (bytes.size() < 348)
        fail("{}: found {} bytes, expected a NIfTI header of 348: truncated", where, bytes.size());
    const Fields native(bytes, false), turned(bytes, true);
    for (const bool swapped : {false, true}) {
        const Fields& f = swapped ? turned : native;
        const int size = f.get<std::int32_t>(0);
        Header header;
        if (size == 348 && std::memcmp(bytes.data() + 344, "n+1", 4) == 0) {
            header =
                parse<std::int16_t, float, std::int16_t>(f, 40, 70, 76, 108, 112, 123, 252, 256);
            header.xyz_units = bytes[123] & 7;
        } else if (size == 540 && std::memcmp(bytes.data() + 4, "n+2", 4) == 0) {
            in.read(bytes, 540 - 348);
            if (bytes.size() < 540)
                fail("{}: found {} bytes, expected a header of 540: truncated", where,
                     bytes.size());
            header =
                parse<std::int64_t, double, std::int32_t>(f, 16, 12, 104, 168, 176, 500, 344, 352);
        } else {
            continue;
        }
        header.swapped = swapped;
        return header;
    }
    fail("{}: is not a single-file NIfTI image, expected its header to hold 'n+1' or 'n+2'", where);
}

/// Rotation of the unit quaternion times the spacing; a negative pixdim[0] flips the third axis.
Eigen::Matrix4d qform_affine(const Header& h) {
    const double bcd = h.q[0] * h.q[0] + h.q[1] * h.q[1] + h.q[2] * h.q[2];
    const Eigen::Quaterniond quaternion(std::sqrt(std::max(0.0, 1 - bcd)), h.q[0], h.q[1], h.q[2]);
    const Eigen::Vector3d spacing(h.pixdim[1], h.pixdim[2],
                                  h.pixdim[0] < 0 ? -h.pixdim[3] : h.pixdim[3]);
    Eigen::Matrix4d affine = Eigen::Matrix4d::Identity();
    affine.topLeftCorner<3, 3>() =
        quaternion.normalized().toRotationMatrix() * spacing.asDiagonal();
    affine.topRightCorner<3, 1>() << h.q[3], h.q[4], h.q[5];
    return affine;
}

Eigen::Matrix4d affine_of(const Header& h, const std::string& where) {
    Eigen::Matrix4d affine = Eigen::Matrix4d::Identity();
    if (h.sform > 0)
        affine.topRows<3>() = h.srow;
    else if (h.qform > 0)
        affine = qform_affine(h);
    else
        affine.diagonal().head<3>() << h.pixdim[1], h.pixdim[2], h.pixdim[3];
    const double unit = h.xyz_units == 1 ? 1 : h.xyz_units == 3 ? 1e-6 : 1e-3;  // mm is the default
    affine.topRows<3>() *= unit;
    check_spans_space(affine, where, h.sform > 0 ? "sform" : h.qform > 0 ? "qform" : "spacing");
    return affine;
}

std::array<int, 3> size_of(const Header& h, const std::string& where) {
    const auto& d = h.dim;
    const bool flat = d[0] < 3 || d[0] > 7;
    for (int i = 4; !flat && i <= d[0]; ++i)
        if (d[i] > 1)
            fail("{}: has {} dimensions ({} volumes), expected one image of three", where, d[0],
                 d[i]);
    if (flat)
        fail("{}: has {} dimensions of {} x {} x {} voxels, expected an image of three", where,
             d[0], d[1], d[2], d[3]);
    checked_voxel_count({d[1], d[2], d[3]}, where);
    return {static_cast<int>(d[1]), static_cast<int>(d[2]), static_cast<int>(d[3])};
}

struct Kind {
    int code;
    ScalarType type;
};
constexpr Kind kinds[] = {{2, ScalarType::uint8},    {4, ScalarType::int16},
                          {8, ScalarType::int32},    {16, ScalarType::float32},
                          {64, ScalarType::float64}, {256, ScalarType::int8},
                          {512, ScalarType::uint16}, {768, ScalarType::uint32},
                          {1024, ScalarType::int64}, {1280, ScalarType::uint64}};

ScalarType type_of(const Header& h, const std::string& where) {
    if (h.type == 128 || h.type == 2304)
        fail("{}: is a colour image (NIfTI type {}), expected grey or labels", where, h.type);
    for (const Kind& kind : kinds)
        if (kind.code == h.type) return kind.type;
    fail("{}: has voxels of NIfTI type {}, expected integers of 8 to 64 bits, float or double",
         where, h.type);
}

template <class T>
void put(std::vector<char>& header, std::size_t offset, std::initializer_list<double> values) {
    for (const double v : values) {
        const T value = static_cast<T>(v);
        std::memcpy(header.data() + offset, &value, sizeof(T));
        offset += sizeof(T);
    }
}

int code_of(ScalarType type) {
    return std::find_if(std::begin(kinds), std::end(kinds),
                        [&](const Kind& k) { return k.type == type; })
        ->code;
}

std::vector<char> make_header(const std::array<int, 3>& size, const Eigen::Matrix4d& affine_mm,
                              ScalarType type, Values values) {
    std::vector<char> header(352, 0);
    const Eigen::Matrix3d axes = affine_mm.topLeftCorner<3, 3>();
    const Eigen::Vector3d spacing = axes.colwise().norm().transpose();
    const double qfac = axes.determinant() < 0 ? -1 : 1;
    Eigen::Matrix3d directions = axes * spacing.cwiseInverse().asDiagonal();
    directions.col(2) *= qfac;
    const bool square =
        (directions.transpose() * directions - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <
        1e-5;
    Eigen::Quaterniond q(nearest_rotation(directions));
    if (q.w() < 0) q.coeffs() *= -1;
    const Eigen::Vector3d origin = affine_mm.topRightCorner<3, 1>();

    constexpr double vector_intent = 1007;
    const bool vectors = values == Values::vectors;
    put<std::int32_t>(header, 0, {348});
    put<std::int16_t>(header, 40,
                      {vectors ? 5.0 : 3.0, 1.0 * size[0], 1.0 * size[1], 1.0 * size[2], 1,
                       vectors ? 3.0 : 1.0, 1, 1});
    put<std::int16_t>(header, 68,
                      {vectors ? vector_intent : 0, 1.0 * code_of(type),
                       8.0 * static_cast<double>(bytes_of(type))});
    put<float>(header, 76, {qfac, spacing[0], spacing[1], spacing[2], 1, 1, 1, 1});
    put<float>(header, 108, {352, 1, 0});
    header[123] = 2;                                          // mm
    put<std::int16_t>(header, 252, {square ? 1.0 : 0.0, 1});  // code 1: scanner coordinates
    put<float>(header, 256, {q.x(), q.y(), q.z(), origin[0], origin[1], origin[2]});
    for (int i = 0; i < 3; ++i)
        put<float>(header, 280 + 16 * i,
                   {affine_mm(i, 0), affine_mm(i, 1), affine_mm(i, 2), affine_mm(i, 3)});
    std::memcpy(header.data() + 344, "n+1", 4);
    return header;
}

void check_ending(const fs::path& path, const char* expected) {
    const std::string end = ending(path);
    if (end != ".nii" && end != ".nii.gz")
        fail("{}: the name ends in '{}', expected an image: {}", path.string(), end, expected);
}

}  // namespace

Volume read(const fs::path& path) {
    check_ending(path, ".nii, .nii.gz, .nrrd, .nhdr, .mha or .mhd");
    const std::string where = path.string();
    check_is_file(path);
    GzReader in(path);
    std::vector<char> bytes;
    const Header header = read_header(in, bytes, where);
    Volume volume;
    volume.size = size_of(header, where);
    volume.ras_from_voxel = affine_of(header, where);
    volume.type = type_of(header, where);
    const std::size_t voxel = bytes_of(volume.type);
    if (!(header.offset >= static_cast<double>(bytes.size()) && header.offset <= 1e9))
        fail("{}: its voxels begin at byte {}, expected behind the header", where, header.offset);
    const std::size_t offset = static_cast<std::size_t>(header.offset);
    in.read(bytes, offset - bytes.size());
    const bool whole_header = bytes.size() == offset;
    bytes.clear();
    const std::size_t count =
        static_cast<std::size_t>(volume.size[0]) * volume.size[1] * volume.size[2];
    if (whole_header) in.read(bytes, count * voxel);
    if (bytes.size() < count * voxel)
        fail(
            "{}: found {} bytes of voxels, expected {} x {} x {} of {} bytes: the file is "
            "truncated",
            where, bytes.size(), volume.size[0], volume.size[1], volume.size[2], voxel);
    in.finish();
    if (header.swapped)
        for (std::size_t n = 0; n < count; ++n)
            std::reverse(bytes.begin() + n * voxel, bytes.begin() + (n + 1) * voxel);
    volume.bytes = std::move(bytes);
    if (std::isfinite(header.slope) && std::isfinite(header.intercept) && header.slope != 0) {
        volume.slope = header.slope;
        volume.intercept = header.intercept;
    }
    return volume;
}

void write(const fs::path& path, const ImageGrid& grid, ScalarType type,
           std::span<const char> bytes, Values values) {
    check_ending(path, ".nii or .nii.gz");
    for (const int n : grid.size)
        if (n < 1 || n > 32767)
            fail("{}: the image has {} voxels along an axis, expected 1 to 32767", path.string(),
                 n);
    Eigen::Matrix4d affine_mm = grid.ras_from_voxel;
    affine_mm.topRows<3>() *= 1e3;
    const std::vector<char> header = make_header(grid.size, affine_mm, type, values);
    PendingFile pending(path);
    const gzFile file = gzopen(pending.path().c_str(), ending(path) == ".nii" ? "wbT" : "wb6");
    if (!file) fail("{}: cannot be written", path.string());
    const bool written = gzfwrite(header.data(), 1, header.size(), file) == header.size() &&
                         gzfwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
    if (gzclose_w(file) != Z_OK || !written)
        fail("{}: cannot be written (is the disk full?)", path.string());
    pending.commit();
}

}  // namespace livetet::nifti
