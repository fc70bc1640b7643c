// Tests NRRD and MetaImage with hand-written headers, so that a writer cannot share a reader's
// mistake.
#include <zlib.h>

#include <cstring>
#include <numeric>

#include "base/file.hpp"
#include "files.hpp"
#include "io/image_file.hpp"

namespace livetet {
namespace {

using namespace testing_files;

/// An image of 4 x 3 x 2 voxels; voxel n has the value n.
std::string voxels() {
    std::string bytes(24, '\0');
    std::iota(bytes.begin(), bytes.end(), '\0');
    return bytes;
}

/// Compresses in zlib's or gzip's format.
std::string packed(std::string bytes, bool gzip) {
    z_stream stream{};
    EXPECT_EQ(deflateInit2(&stream, 9, Z_DEFLATED, gzip ? 15 + 16 : 15, 8, Z_DEFAULT_STRATEGY),
              Z_OK);
    std::string out(bytes.size() + 1000, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(bytes.data());
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

// Oblique and left-handed: in RAS, mm, i steps by (0.6, 0.8, 0), j by 2 (-0.8, 0.6, 0), k by 3 (0,
// 0, -1), from (10, 20, 30).
const std::string ras_lines =
    "space: right-anterior-superior\nspace directions: (0.6,0.8,0) (-1.6,1.2,0) (0,0,-3)\nspace "
    "origin: (10,20,30)\n";
const std::string lps_lines =
    "space: left-posterior-superior\nspace directions: (-0.6,-0.8,0) (1.6,-1.2,0) (0,0,-3)\nspace "
    "origin: "
    "(-10,-20,30)\n";
const std::string las_lines =
    "space: LAS\nspace directions: (-0.6,0.8,0) (1.6,1.2,0) (0,0,-3)\nspace origin: (-10,20,30)\n";

std::string nrrd(const std::string& lines, const std::string& encoding = "raw") {
    return "NRRD0005\n# by hand\ntype: uint8\ndimension: 3\nsizes: 4 3 2\nencoding: " + encoding +
           "\n" + lines;
}

const std::string meta_place =
    "TransformMatrix = -0.6 -0.8 0 0.8 -0.6 0 0 0 -1\nOffset = -10 -20 30\nElementSpacing = 1 2 "
    "3\n";

std::string meta(const std::string& place, const std::string& data = "LOCAL",
                 const std::string& more = "") {
    return "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n" +
           more + place + "DimSize = 4 3 2\nElementType = MET_UCHAR\nElementDataFile = " + data +
           "\n";
}

std::string meta_packed(const std::string& bytes) {
    const std::string z = packed(bytes, false);
    return meta(meta_place, "LOCAL",
                "CompressedData = True\nCompressedDataSize = " + std::to_string(z.size()) + "\n") +
           z;
}

std::string nifti() {
    std::string h(352, '\0');
    const auto put = [&](std::size_t at, auto... values) {
        ((std::memcpy(h.data() + at, &values, sizeof values), at += sizeof values), ...);
    };
    using I = std::int16_t;
    put(0, 348);
    put(40, I{3}, I{4}, I{3}, I{2}, I{1}, I{1}, I{1}, I{1});
    put(70, I{2}, I{8});
    put(76, -1.0f, 1.0f, 2.0f, 3.0f);
    put(108, 352.0f, 1.0f, 0.0f);
    h[123] = 2;
    put(254, I{1});
    put(280, 0.6f, -1.6f, 0.0f, 10.0f, 0.8f, 1.2f, 0.0f, 20.0f, 0.0f, 0.0f, -3.0f, 30.0f);
    std::memcpy(h.data() + 344, "n+1", 4);
    return h + voxels();
}

Eigen::Vector3d mm(const LabelImage& image, double i, double j, double k) {
    return 1e3 * (image.ras_from_voxel * Eigen::Vector4d(i, j, k, 1)).head<3>();
}

/// Computed by hand from the steps above.
void expect_known_points(const LabelImage& image) {
    ASSERT_EQ(image.size, (std::array<int, 3>{4, 3, 2}));
    EXPECT_LT((mm(image, 0, 0, 0) - Eigen::Vector3d(10, 20, 30)).norm(), 1e-5);
    EXPECT_LT((mm(image, 3, 0, 0) - Eigen::Vector3d(11.8, 22.4, 30)).norm(), 1e-5);
    EXPECT_LT((mm(image, 0, 2, 0) - Eigen::Vector3d(6.8, 22.4, 30)).norm(), 1e-5);
    EXPECT_LT((mm(image, 3, 2, 1) - Eigen::Vector3d(8.6, 24.8, 27)).norm(), 1e-5);
    for (int n = 0; n < 24; ++n) ASSERT_EQ(image.values[n], n);
}

TEST(ImageFormats, OneImageInEveryFormatLiesAtTheSamePoints) {
    const auto folder = fresh_folder();
    const std::string raw = voxels();
    write_bytes(folder / "apart.raw", raw);
    write_bytes(folder / "apart.raw.gz", packed(raw, true));
    const std::string z = packed(raw, false);
    write_bytes(folder / "apart.zraw", z);
    std::string numbers;
    for (int n = 0; n < 24; ++n) numbers += std::to_string(n) + (n % 4 == 3 ? "\n" : " ");
    const std::pair<const char*, std::string> files[] = {
        {"sform.nii", nifti()},
        {"ras.nrrd", nrrd(ras_lines) + "\n" + raw},
        {"lps.nrrd", nrrd(lps_lines) + "\n" + raw},
        {"las.nrrd", nrrd(las_lines) + "\n" + raw},
        {"gz.nrrd", nrrd(lps_lines, "gzip") + "\n" + packed(raw, true)},
        {"members.nrrd", nrrd(lps_lines, "gzip") + "\n" + packed(raw.substr(0, 9), true) +
                             packed(raw.substr(9), true)},
        {"text.nrrd", nrrd(ras_lines, "ascii") + "\n" + numbers},
        {"upper.NRRD", nrrd(lps_lines) + "\n" + raw},
        {"apart.nhdr", nrrd(lps_lines) + "data file: apart.raw\n"},
        {"apart_gz.nhdr", nrrd(ras_lines, "gz") + "data file: apart.raw.gz\n\n"},
        {"metres.nrrd",
         nrrd("space: RAS\nspace units: \"m\" \"m\" \"m\"\nspace directions: (0.0006,0.0008,0) "
              "(-0.0016,0.0012,0) (0,0,-0.003)\nspace origin: (0.01,0.02,0.03)\n") +
             "\n" + raw},
        {"a.mha", meta(meta_place) + raw},
        {"z.mha", meta_packed(raw)},
        {"apart.mhd", meta(meta_place, "apart.raw")},
        {"apart_z.mhd",
         meta(meta_place, "apart.zraw",
              "CompressedData = True\nCompressedDataSize = " + std::to_string(z.size()) + "\n")},
        // The direction flips the j axis and the spacing flips it back.
        {"negative.mha", meta("TransformMatrix = -0.6 -0.8 0 -0.8 0.6 0 0 0 -1\nOffset = -10 -20 "
                              "30\nElementSpacing = 1 "
                              "-2 3\n") +
                             raw},
        // AnatomicalOrientation beside a TransformMatrix is ignored, as in ITK and Slicer.
        {"oriented.mha", meta("AnatomicalOrientation = RAS\n" + meta_place) + raw},
        {"cm.mha",
         meta("DistanceUnits = cm\nTransformMatrix = -0.6 -0.8 0 0.8 -0.6 0 0 0 -1\nOffset = -1 -2 "
              "3\nElementSpacing = 0.1 0.2 0.3\n") +
             raw},
        {"text.mha",
         meta(meta_place)
                 .replace(meta(meta_place).find("BinaryData = True"), 17, "BinaryData = False") +
             numbers},
    };
    for (const auto& [name, bytes] : files) {
        SCOPED_TRACE(name);
        EXPECT_EQ(error_of([&] {
                      expect_known_points(read_label_image(write_bytes(folder / name, bytes)));
                  }),
                  "");
    }
}

TEST(ImageFormats, SlicesInFilesOfTheirOwnAreRead) {
    const auto folder = fresh_folder();
    write_bytes(folder / "s0.raw", voxels().substr(0, 12));
    write_bytes(folder / "s1.raw", voxels().substr(12));
    write_bytes(folder / "list.mhd", meta(meta_place, "LIST") + "s0.raw\ns1.raw\n");
    write_bytes(folder / "list.nhdr", nrrd(lps_lines) + "data file: LIST 2\ns0.raw\ns1.raw\n");
    write_bytes(folder / "numbered.nhdr", nrrd(ras_lines) + "data file: s%d.raw 0 1 1 2\n");
    const auto names = {"list.mhd", "list.nhdr", "numbered.nhdr"};
    for (const char* name : names) {
        SCOPED_TRACE(name);
        EXPECT_EQ(error_of([&] { expect_known_points(read_label_image(folder / name)); }), "");
    }
    truncate_to(folder / "s1.raw", 0.5);
    for (const char* name : names)
        EXPECT_TRUE(says(error_of([&] { read_label_image(folder / name); }), {name}));
}

TEST(ImageFormats, SpacingsWithoutASpaceLieAlongLps) {
    const auto path = fresh_folder() / "a.nrrd";
    write_bytes(path, nrrd("spacings: -1 2 3\n") + "\n" + voxels());
    const LabelImage image = read_label_image(path);
    EXPECT_LT((mm(image, 1, 0, 0) - mm(image, 0, 0, 0) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-9);
    EXPECT_LT((mm(image, 0, 1, 0) - mm(image, 0, 0, 0) - Eigen::Vector3d(0, -2, 0)).norm(), 1e-9);
    EXPECT_LT((mm(image, 0, 0, 1) - mm(image, 0, 0, 0) - Eigen::Vector3d(0, 0, 3)).norm(), 1e-9);
}

TEST(ImageFormats, ShearedAxesStaySheared) {
    const auto path = fresh_folder() / "a.nrrd";
    write_bytes(
        path,
        nrrd("space: RAS\nspace directions: (1,0,0) (0.5,1,0) (0,0,3)\nspace origin: (0,0,0)\n") +
            "\n" + voxels());
    EXPECT_LT((mm(read_label_image(path), 2, 2, 1) - Eigen::Vector3d(3, 2, 3)).norm(), 1e-9);
}

TEST(ImageFormats, TypesAndByteOrdersAreRead) {
    const auto folder = fresh_folder();
    const std::string place = "DimSize = 2 1 1\nElementSpacing = 1 1 1\n";
    const std::string nrrd_head =
        "NRRD0004\ndimension: 3\nsizes: 2 1 1\nspacings: 1 1 1\nencoding: raw\n";
    const std::string big = {'\x01', '\x02', '\xff', '\xfe'},
                      little = {'\x02', '\x01', '\xfe', '\xff'};
    const std::vector<std::int32_t> expected{258, -2};
    write_bytes(folder / "big.nrrd", nrrd_head + "type: short\nendian: big\n\n" + big);
    write_bytes(folder / "little.nrrd", nrrd_head + "type: int16\nendian: little\n\n" + little);
    write_bytes(folder / "big.mha", "NDims = 3\nBinaryDataByteOrderMSB = True\n" + place +
                                        "ElementType = MET_SHORT\nElementDataFile = LOCAL\n" + big);
    write_bytes(folder / "little.mha", "NDims = 3\nElementByteOrderMSB = False\n" + place +
                                           "ElementType = MET_SHORT\nElementDataFile = LOCAL\n" +
                                           little);
    for (const char* name : {"big.nrrd", "little.nrrd", "big.mha", "little.mha"})
        EXPECT_EQ(read_label_image(folder / name).values, expected) << name;
    const float values[2] = {1.5f, -1000};
    const std::string floats(reinterpret_cast<const char*>(values), 8);
    write_bytes(folder / "f.nrrd", nrrd_head + "type: float\nendian: little\n\n" + floats);
    EXPECT_EQ(read_grey_image(folder / "f.nrrd").values, (std::vector<float>{1.5f, -1000}));
    EXPECT_TRUE(says(error_of([&] { read_label_image(folder / "f.nrrd"); }),
                     {"voxel (0, 0, 0) is 1.5", "whole number"}));
    const float nan[2] = {0, NAN};
    write_bytes(folder / "n.mha", "NDims = 3\n" + place +
                                      "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n" +
                                      std::string(reinterpret_cast<const char*>(nan), 8));
    EXPECT_TRUE(says(error_of([&] { read_grey_image(folder / "n.mha"); }),
                     {"voxel (1, 0, 0)", "nan", "finite"}));
    const std::int64_t labels[2] = {70000, 5'000'000'000};
    write_bytes(folder / "l.nrrd", nrrd_head + "type: int64\nendian: little\n\n" +
                                       std::string(reinterpret_cast<const char*>(labels), 16));
    EXPECT_TRUE(says(error_of([&] { read_label_image(folder / "l.nrrd"); }),
                     {"voxel (1, 0, 0)", "5000000000"}));
}

const std::string segments =
    "Segment0_ID:=Segment_1\nSegment0_LabelValue:=1\nSegment0_Layer:=0\nSegment0_Name:=liver\n"
    "Segmentation_MasterRepresentation:=Binary labelmap\n";

TEST(ImageFormats, SlicersSegmentationIsReadWhereItHasOneLayer) {
    const auto folder = fresh_folder();
    write_bytes(folder / "one.seg.nrrd", nrrd("kinds: domain domain domain\n" + lps_lines, "gzip") +
                                             segments + "\n" + packed(voxels(), true));
    expect_known_points(read_label_image(folder / "one.seg.nrrd"));
    const auto layers = [&](int count, const std::string& bytes) {
        std::string lines = lps_lines;
        lines.insert(lines.find("directions: ") + 12, "none ");
        return "NRRD0005\ntype: uint8\ndimension: 4\nsizes: " + std::to_string(count) +
               " 4 3 2\nkinds: list domain domain domain\nencoding: raw\n" + lines + segments +
               "\n" + bytes;
    };
    write_bytes(folder / "list.seg.nrrd", layers(1, voxels()));
    expect_known_points(read_label_image(folder / "list.seg.nrrd"));
    write_bytes(folder / "two.seg.nrrd", layers(2, voxels() + voxels()));
    EXPECT_TRUE(says(error_of([&] { read_label_image(folder / "two.seg.nrrd"); }),
                     {"two.seg.nrrd", "2 layers", "overlap", "export", "labelmap"}));
}

TEST(ImageFormats, TruncationIsSeenAtAnyPlace) {
    const auto folder = fresh_folder();
    const std::pair<const char*, std::string> files[] = {
        {"a.nrrd", nrrd(lps_lines) + "\n" + voxels()},
        {"z.nrrd", nrrd(lps_lines, "gzip") + "\n" + packed(voxels(), true)},
        {"a.mha", meta(meta_place) + voxels()},
        {"z.mha", meta_packed(voxels())},
    };
    for (const auto& [name, whole] : files)
        for (std::size_t n = 0; n < whole.size(); ++n) {
            write_bytes(folder / name, whole.substr(0, n));
            ASSERT_TRUE(says(error_of([&] { read_label_image(folder / name); }), {name}))
                << n << " bytes";
        }
    write_bytes(folder / "short.raw", voxels().substr(5));
    write_bytes(folder / "a.mhd", meta(meta_place, "short.raw"));
    write_bytes(folder / "a.nhdr", nrrd(lps_lines) + "data file: short.raw\n");
    for (const char* name : {"a.mhd", "a.nhdr"})
        EXPECT_TRUE(says(error_of([&] { read_label_image(folder / name); }),
                         {name, "found 19 bytes", "expected 24"}));
}

/// Expects errors for images with wrong headers, made from a good NRRD `n` and MetaImage `m`.
class WrongImageHeaders : public testing::Test {
  protected:
    void refuses(const char* name, const std::string& bytes,
                 std::initializer_list<const char*> words) const {
        write_bytes(folder / name, bytes);
        const std::string error = error_of([&] { read_label_image(folder / name); });
        EXPECT_TRUE(says(error, {name}));
        EXPECT_TRUE(says(error, words));
    }
    static std::string with(std::string text, const std::string& from, const std::string& to) {
        EXPECT_NE(text.find(from), std::string::npos) << from;
        return text.replace(text.find(from), from.size(), to);
    }

    const std::filesystem::path folder = fresh_folder();
    const std::string n = nrrd(lps_lines) + "\n" + voxels(), m = meta(meta_place) + voxels();
};

// Also hostile sizes, for which nothing may be allocated.
TEST_F(WrongImageHeaders, SizesThatDoNotMatchTheData) {
    for (const char* size : {"1500 1500 1500", "4 3 3"}) {
        refuses("a.nrrd", with(n, "4 3 2", size), {"found 24 bytes", "truncated"});
        refuses("a.mha", with(m, "4 3 2", size), {"found 24 bytes", "truncated"});
        refuses("z.nrrd",
                with(nrrd(lps_lines, "gzip") + "\n" + packed(voxels(), true), "4 3 2", size),
                {"found 24 bytes", "truncated"});
        refuses("z.mha", with(meta_packed(voxels()), "4 3 2", size),
                {"found 24 bytes", "truncated"});
    }
    refuses("a.nrrd", with(n, "4 3 2", "4 3 1"), {"expected 12", "wrong size"});
    refuses("a.mha", with(m, "4 3 2", "4 3 1"), {"expected 12", "wrong size"});
    refuses("z.mha", with(meta_packed(voxels()), "4 3 2", "4 3 1"), {"expected 12", "wrong size"});
    refuses("a.nrrd", with(n, "4 3 2", "4294967300 3 2"),
            {"4294967300", "1048576"});  // 4 in 32 bits
    refuses("a.mha", with(m, "4 3 2", "4294967300 3 2"), {"4294967300"});
    refuses("a.mha", with(m, "4 3 2", "-4 3 2"), {"-4"});
    refuses("a.nrrd", with(n, "4 3 2", "1000000 1000000 1000000"), {"4e9"});
    refuses("a.nrrd", with(n, "sizes: 4 3 2", "sizes: 4 3"), {"dimension"});
    refuses(
        "z.mha",
        with(meta_packed(voxels()), "CompressedDataSize = ", "CompressedDataSize = 99999999999"),
        {"truncated"});
    refuses("z.mha", with(meta_packed(voxels()), "CompressedDataSize", "Comment"),
            {"CompressedDataSize"});
    refuses(
        "z.mha",
        with(meta_packed(voxels()), "CompressedDataSize = ", "CompressedDataSize = 8\nComment = "),
        {"truncated"});
    refuses("a.mha", with(m, "DimSize", "HeaderSize = 12\nDimSize"), {"HeaderSize"});
}

TEST_F(WrongImageHeaders, SizesThatDoNotMatchTheDataFile) {
    write_bytes(folder / "whole.raw", voxels());
    refuses("a.mhd", with(meta(meta_place, "whole.raw"), "DimSize", "HeaderSize = 12\nDimSize"),
            {"found 12", "expected 24"});
    write_bytes(folder / "long.raw", voxels() + voxels());  // as if of 16 bits
    refuses("a.mhd", meta(meta_place, "long.raw"), {"found 48", "expected 24", "wrong size"});
    refuses("a.nhdr", nrrd(lps_lines) + "data file: long.raw\n",
            {"found 48", "expected 24", "wrong size"});
    refuses("a.nii", nifti() + "x", {"more bytes"});
    refuses("a.nii.gz", packed(nifti() + "x", true), {"more bytes"});
}

// Readers that prefer different counts must not disagree.
TEST_F(WrongImageHeaders, CountsThatContradictEachOther) {
    refuses("a.mha", with(m, "DimSize", "nDIMS = 3\nDimSize"), {"ndims", "twice"});
    refuses("a.mha", with(m, "DimSize", "Comment: x = 3\nDimSize"), {"Name = value"});
    refuses("a.mha", with(m, "ElementDataFile", "nothing to tell\nElementDataFile"),
            {"nothing to tell", "Name = value"});
    refuses("a.nrrd", with(n, "sizes: 4 3 2", "sizes: 4 3 2\nsizes: 4 3 2"), {"sizes", "twice"});
    refuses("a.mhd",
            with(meta(meta_place, std::string(90, 'x') + "%d.raw 1 2 1"), "4 3 2", "4 3 2"),
            {"at most 79"});
    refuses("a.mhd", with(meta(meta_place, "LIST"), "4 3 2", "4000 1000 900"), {"beside it"});
}

TEST_F(WrongImageHeaders, DamagedCompressedData) {
    std::string damaged = nrrd(lps_lines, "gzip") + "\n" + packed(voxels(), true);
    damaged[damaged.size() - 12] ^= 0x55;
    refuses("z.nrrd", damaged, {"damaged"});
}

TEST_F(WrongImageHeaders, NotOneGreyImageOfThreeDimensions) {
    refuses(
        "a.mha",
        with(m, "ElementType", "ElementNumberOfChannels = 3\nElementType") + voxels() + voxels(),
        {"3 values a voxel"});
    refuses("a.nrrd",
            "NRRD0005\ntype: uint8\ndimension: 4\nsizes: 3 2 2 2\nkinds: RGB-color domain domain "
            "domain\nspacings: nan 1 1 1\nencoding: raw\n\n" +
                voxels(),
            {"3 values a voxel"});
    refuses("a.nrrd",
            "NRRD0005\ntype: uint8\ndimension: 4\nsizes: 3 2 2 2\nspacings: 1 1 1 1\nencoding: "
            "raw\n\n" +
                voxels(),
            {"4 dimensions"});
    refuses("a.nrrd",
            "NRRD0005\ntype: uint8\ndimension: 2\nsizes: 6 4\nspacings: 1 1\nencoding: raw\n\n" +
                voxels(),
            {"2 dimensions"});
    refuses("a.mha", "NDims = 30\nElementDataFile = LOCAL\n", {"NDims", "30"});
    refuses("a.igs.mha", with(m, "ElementType", "Seq_Frame0000_Timestamp = 1\nElementType"),
            {"sequence"});
}

TEST_F(WrongImageHeaders, InvalidPositions) {
    refuses("a.nrrd", nrrd("") + "\n" + voxels(), {"no spacing"});
    refuses("a.nrrd", nrrd("spacings: 1 nan 1\n") + "\n" + voxels(), {"spacings"});
    refuses("a.mha", with(m, "ElementSpacing = 1 2 3\n", ""), {"no spacing"});
    refuses("a.nrrd", with(n, "left-posterior-superior", "scanner-xyz"), {"scanner-xyz", "RAS"});
    refuses("a.nrrd", with(n, "space: left-posterior-superior", "space dimension: 3"), {"space"});
    refuses("a.nrrd", with(n, "(0,0,-3)", "(0.6,0.8,0)"), {"span space"});
    refuses("a.mha", with(m, "1 2 3", "1 0 3"), {"span space"});
    refuses("a.mha", with(m, "Offset = -10", "DistanceUnits = inch\nOffset = -10"), {"inch", "mm"});
}

TEST_F(WrongImageHeaders, EncodingsTypesAndNames) {
    refuses("a.nrrd", with(n, "raw", "bzip2"), {"bzip2", "gzip"});
    refuses("a.nrrd", with(n, "uint8", "block\nblock size: 1"), {"a.nrrd"});
    refuses("a.nrrd", "PNG\n", {"expected NRRD"});
    refuses("a.mha", "", {"does not end"});
    refuses("a.mhd", meta(meta_place, "none.raw"), {"none.raw", "not there"});
    refuses("a.nhdr", nrrd(lps_lines) + "data file: none.raw\n", {"none.raw", "not there"});
    // A printf pattern with other conversions than one integer (found by fuzzing: a crash).
    for (const char* pattern :
         {"s%ls.raw", "s%s.raw", "s%n.raw", "%d%d.raw", "s%9999d.raw", "s%"}) {
        refuses("a.mhd", meta(meta_place, std::string(pattern) + " 1 2 1"), {pattern, "%03d"});
        refuses("a.nhdr", nrrd(lps_lines) + "data file: " + std::string(pattern) + " 0 1 1 2\n",
                {pattern, "%03d"});
    }
    EXPECT_TRUE(says(error_of([&] { read_label_image(folder / "none.nrrd"); }),
                     {"none.nrrd", "no such file"}));
    EXPECT_TRUE(
        says(error_of([&] { read_label_image(folder / "a.tiff"); }), {"'.tiff'", ".nrrd", ".mha"}));
}

}  // namespace
}  // namespace livetet
