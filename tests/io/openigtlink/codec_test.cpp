#include "io/openigtlink/codec.hpp"

#include <gtest/gtest.h>

#include <map>

#include "base/file.hpp"
#include "io/files.hpp"
#include "io/openigtlink/content.hpp"
#include "io/openigtlink/crc64.hpp"
#include "io/openigtlink/messages.hpp"

namespace livetet::igtl {
namespace {

using testing_files::error_of;
using testing_files::says;
using namespace testing_messages;

Bytes bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

Bytes bytes_of_file(const std::filesystem::path& path) { return bytes_of(read_text_file(path)); }

Message decode(ByteView bytes) {
    return decode_body(decode_header(bytes.first(header_size)), bytes.subspan(header_size));
}

/// A message of version 1 with a correct CRC for any content.
Bytes signed_message(std::string_view type, ByteView content) {
    ByteWriter out(type);
    out(std::uint16_t(1));
    out.name(type, 12);
    out.name("Device", 20);
    out(std::uint64_t(0));
    out(std::uint64_t(content.size()));
    out(crc64(content));
    for (const std::uint8_t byte : content) out(byte);
    return out.take();
}

TEST(OpenIgtLinkCrc, IsThatOfEcma182) {
    EXPECT_EQ(crc64(bytes_of("123456789")),
              0x6C40DF5F0B497347);  // check value of the CRC catalogue
    EXPECT_EQ(crc64({}), 0);
    EXPECT_EQ(crc64(bytes_of("6789"), crc64(bytes_of("12345"))), 0x6C40DF5F0B497347) << "in pieces";
}

TEST(OpenIgtLinkCodec, WritesATransformAsTheProtocolSays) {
    Message m =
        message("TRANSFORM", Transform{{1, 0, 0, 0, 1, 0, 0, 0, 1, 2, -2, 0.5}}, "StylusToTracker");
    m.time_stamp = 0x0000000180000000;
    const Bytes bytes = encode(m);
    ASSERT_EQ(bytes.size(), 106);
    EXPECT_EQ(Bytes(bytes.begin(), bytes.begin() + 2), (Bytes{0, 1}));
    EXPECT_EQ(std::string(bytes.begin() + 2, bytes.begin() + 14),
              std::string("TRANSFORM\0\0\0", 12));
    EXPECT_EQ(std::string(bytes.begin() + 14, bytes.begin() + 34),
              std::string("StylusToTracker\0\0\0\0\0", 20));
    EXPECT_EQ(Bytes(bytes.begin() + 34, bytes.begin() + 42), (Bytes{0, 0, 0, 1, 0x80, 0, 0, 0}));
    EXPECT_EQ(Bytes(bytes.begin() + 42, bytes.begin() + 50), (Bytes{0, 0, 0, 0, 0, 0, 0, 48}));
    EXPECT_EQ(Bytes(bytes.begin() + 58, bytes.begin() + 62), (Bytes{0x3f, 0x80, 0, 0}));  // R11
    EXPECT_EQ(Bytes(bytes.begin() + 94, bytes.end()),
              (Bytes{0x40, 0, 0, 0, 0xc0, 0, 0, 0, 0x3f, 0, 0, 0}));  // T
    EXPECT_EQ(seconds_of_stamp(decode(bytes).time_stamp), 1.5);
}

TEST(OpenIgtLinkCodec, WritesVersion2WithItsMetadataBehindTheContent) {
    Message m = with_metadata(message("STRING", String{3, "hi"}), {{"Key", "value"}});
    m.id = 9;
    const Bytes bytes = encode(m);
    EXPECT_EQ(Bytes(bytes.begin() + header_size, bytes.end()),
              (Bytes{0,   12,  0,   10,  0,   0,   0,   8,  0, 0, 0, 9,  //
                     0,   3,   0,   2,   'h', 'i',                       //
                     0,   1,   0,   3,   0,   3,   0,   0,  0, 5,        //
                     'K', 'e', 'y', 'v', 'a', 'l', 'u', 'e'}));
}

TEST(OpenIgtLinkCodec, EveryTypeComesBackFromTheWireInBothVersions) {
    for (Message m : one_of_each())
        for (const std::uint16_t version : {1, 2}) {
            m.version = version;
            if (version == 2) m = with_metadata(m, {{"a", "b"}, {"empty", ""}});
            const Bytes bytes = encode(m);
            const Message back = decode(bytes);
            EXPECT_EQ(back.content.index(), m.content.index()) << m.type;
            EXPECT_EQ(back.metadata.size(), m.metadata.size()) << m.type;
            EXPECT_EQ(encode(back), bytes) << m.type;
        }
}

TEST(OpenIgtLinkCodec, ReadsFieldsWhereTheyWereWritten) {
    std::map<std::string, Content> read;
    for (const Message& m : one_of_each()) read.try_emplace(m.type, decode(encode(m)).content);
    EXPECT_EQ(std::get<TrackingData>(read["TDATA"]).tools[1].name, "Reference");
    EXPECT_EQ(std::get<TrackingData>(read["TDATA"]).tools[1].matrix[11], -30.5f);
    EXPECT_EQ(std::get<Status>(read["STATUS"]).subcode, -7);
    EXPECT_EQ(std::get<Status>(read["STATUS"]).text, "no such device");
    EXPECT_EQ(std::get<Points>(read["POINT"]).points[0].owner, "CT");
    EXPECT_EQ(std::get<PolyData>(read["POLYDATA"]).attributes[0].name, "displacement");
    EXPECT_EQ(std::get<PolyData>(read["POLYDATA"]).attributes[1].values[4], 1);
    EXPECT_EQ(std::get<NdArray>(read["NDARRAY"]).values[3], -4);
    EXPECT_EQ(std::get<VideoList>(read["VIDEOMETA"]).videos[0].focal_length, 50.5);
    EXPECT_EQ(std::get<Bind>(read["BIND"]).messages[1].device, "bc");
    const auto bound = std::get<Bind>(read["BIND"]).messages[0];
    EXPECT_EQ(std::get<String>(decode_content(bound.type, bound.content)).text, "x");
}

TEST(OpenIgtLinkCodec, ALongNameIsCutInTheHeaderAndWholeInTheMetadata) {
    Message m = message("TRANSFORM", Transform{}, "LongInstrumentNameToTracker");
    EXPECT_EQ(whole_name(decode(encode(m))), "LongInstrumentNameTo");
    m.version = 2;
    EXPECT_EQ(whole_name(decode(encode(m))), "LongInstrumentNameToTracker");
}

TEST(OpenIgtLinkCodec, RefusesHeadersThatCannotBeOne) {
    const Bytes good = encode(message("TRANSFORM", Transform{}));
    const auto changed = [&](std::size_t place, std::uint8_t byte) {
        Bytes bytes(good.begin(), good.begin() + header_size);
        bytes[place] = byte;
        return error_of([&] { decode_header(bytes); });
    };
    EXPECT_EQ(changed(41, 7), "");
    EXPECT_TRUE(says(changed(1, 0), {"version 0"}));
    EXPECT_TRUE(says(changed(2, 0), {"type"}));
    EXPECT_TRUE(says(changed(2, 0xc3), {"type"}));
    EXPECT_TRUE(says(changed(2, '\n'), {"control"}));
    EXPECT_TRUE(says(changed(45, 0x10), {"TRANSFORM", "expected at most 268435456"}));
    EXPECT_TRUE(says(changed(42, 0x80), {"expected at most"}));
}

TEST(OpenIgtLinkCodec, RefusesContentsThatContradictTheirSizes) {
    const auto refused = [](std::string_view type, const Bytes& content) {
        return error_of([&] { decode(signed_message(type, content)); });
    };
    const auto changed = [&](std::string_view type, std::size_t place, std::uint8_t byte) {
        for (const Message& m : one_of_each())
            if (m.type == type) {
                Bytes content = encode_content(type, m.content);
                content.at(place) = byte;
                return refused(type, content);
            }
        return std::string("no such type");
    };
    EXPECT_TRUE(
        says(refused("TRANSFORM", Bytes(47)), {"TRANSFORM", "3 bytes are left, expected 4 more"}));
    EXPECT_TRUE(says(refused("TRANSFORM", Bytes(49)), {"1 bytes too many"}));
    EXPECT_TRUE(says(refused("POSITION", Bytes(27)), {"27 bytes", "28, 24 or 12"}));
    EXPECT_TRUE(says(refused("TDATA", Bytes(71)), {"left"}));
    EXPECT_TRUE(says(changed("TDATA", 3, '\n'), {"control characters"}));
    EXPECT_TRUE(says(changed("STRING", 2, 0xff), {"expected"}));
    EXPECT_TRUE(says(changed("COMMAND", 134, 0xff), {"expected"}));
    EXPECT_TRUE(says(changed("POLYDATA", 0, 0xff), {"values"}));
    EXPECT_TRUE(says(changed("POLYDATA", 24, 0xff), {"POLYDATA"}));          // size of polygons
    EXPECT_TRUE(says(changed("POLYDATA", 23, 3), {"2 cells, expected 3"}));  // polygons
    EXPECT_TRUE(says(changed("POLYDATA", 39, 9), {"POLYDATA"}));             // attributes
    EXPECT_TRUE(says(changed("POLYDATA", 36, 0xff), {"POLYDATA"}));          // 4 billion of them
    EXPECT_TRUE(says(changed("POLYDATA", 40 + 48 + 7, 4), {"point 4, expected less than 4"}));
    EXPECT_TRUE(says(changed("POLYDATA", 40 + 48 + 3, 7), {"a cell of 7 points"}));
    EXPECT_TRUE(says(changed("IMAGE", 3, 9), {"scalar type 9"}));
    EXPECT_TRUE(says(changed("IMAGE", 66, 0xff), {"along axis 0"}));
    EXPECT_TRUE(says(changed("IMAGE", 2, 3), {"expected"}));
    EXPECT_TRUE(says(changed("NDARRAY", 2, 0xff), {"expected"}));
    EXPECT_TRUE(says(refused("NDARRAY",
                             [] {
                                 Bytes b(512, 0xff);
                                 b[0] = 11;
                                 b[1] = 255;
                                 return b;
                             }()),
                     {"2^32"}));
    EXPECT_TRUE(says(changed("SENSOR", 0, 200), {"200 values"}));
    EXPECT_TRUE(says(changed("COLORT", 0, 4), {"index type 4"}));
    EXPECT_TRUE(says(changed("BIND", 0, 0xff), {"BIND"}));
    EXPECT_TRUE(says(changed("BIND", 14, 0x80), {"BIND"}));
    EXPECT_TRUE(says(refused("NOSUCHTYPE", {}), {"NOSUCHTYPE", "not known"}));
}

TEST(OpenIgtLinkCodec, RefusesAWrongCrcAndMetadataLargerThanItsBody) {
    Bytes bytes =
        encode(with_metadata(message("TRANSFORM", Transform{}), {{"TransformStatus", "OK"}}));
    bytes.back() ^= 1;
    EXPECT_TRUE(says(error_of([&] { decode(bytes); }), {"TRANSFORM", "CRC"}));
    bytes.back() ^= 1;
    const auto changed = [&](std::size_t place, std::uint8_t byte) {
        Bytes wrong = bytes;
        wrong[header_size + place] = byte;
        Header header = decode_header(ByteView(wrong).first(header_size));
        const ByteView body = ByteView(wrong).subspan(header_size);
        header.crc = crc64(body);
        return error_of([&] { decode_body(header, body); });
    };
    EXPECT_EQ(changed(11, 5), "");  // the message id
    EXPECT_TRUE(says(changed(1, 3), {"extended header has 3 bytes"}));
    EXPECT_TRUE(says(changed(0, 0xff), {"expected"}));
    EXPECT_TRUE(says(changed(4, 0xff), {"metadata"}));
    EXPECT_TRUE(says(changed(12 + 48, 9), {"metadata"}));  // 2305 items
    EXPECT_TRUE(says(changed(12 + 48 + 3, 200), {"metadata"}));
}

TEST(OpenIgtLinkCodec, EncodeRefusesWhatDoesNotFitItsField) {
    EXPECT_TRUE(says(error_of([] {
                         encode(message("STRING", String{3, std::string(70000, 'x')}));
                     }),
                     {"STRING", "70000"}));
    EXPECT_TRUE(says(error_of([] {
                         encode(message("TDATA", TrackingData{{{std::string(21, 'x'), 2, {}}}}));
                     }),
                     {"expected at most 20"}));
    EXPECT_TRUE(says(error_of([] { encode(message("STRING", Transform{})); }),
                     {"not that of a message of this type"}));
    EXPECT_TRUE(says(error_of([] { encode(message("A_TYPE_OF_13_", Raw{})); }), {"type"}));
}

/// The golden files with a whole message: its type and a distinguishing text.
TEST(OpenIgtLinkGolden, EveryMessageIsDecodedAndEncodedToTheSameBytes) {
    LIVETET_DATA_OR_SKIP(data);
    std::map<std::string, int> seen;
    for (const auto& entry : std::filesystem::directory_iterator(data / "igtl")) {
        const std::string name = entry.path().filename().string();
        if (name.starts_with("test_bind_message")) continue;  // in three files: see the test below
        const Bytes bytes = bytes_of_file(entry.path());
        const Message m = decode(bytes);
        EXPECT_EQ(encode(m), bytes) << name;
        ++seen[m.type + (m.version == 2 ? " 2" : "")];
    }
    EXPECT_EQ(seen, (std::map<std::string, int>{
                        {"CAPABILITY", 1}, {"COLORT", 1},   {"COMMAND", 1},    {"COMMAND 2", 1},
                        {"IMGMETA", 1},    {"LBMETA", 1},   {"NDARRAY", 1},    {"POINT", 1},
                        {"POLYDATA", 1},   {"POSITION", 1}, {"POSITION 2", 1}, {"SENSOR", 1},
                        {"STATUS", 1},     {"STRING", 1},   {"TDATA", 1},      {"TDATA 2", 1},
                        {"TRAJ", 1},       {"TRAJ 2", 1},   {"TRANSFORM", 1},  {"TRANSFORM 2", 1},
                        {"VIDEOMETA 2", 1}}));
}

TEST(OpenIgtLinkGolden, BindIsDecodedWithItsMessagesAndEncodedToTheSameBytes) {
    LIVETET_DATA_OR_SKIP(data);
    Bytes bytes;
    for (const char* part : {"header", "bind_header", "bind_body"}) {
        const Bytes piece =
            bytes_of_file(data / "igtl" / (std::string("test_bind_message_") + part + ".bin"));
        bytes.insert(bytes.end(), piece.begin(), piece.end());
    }
    const Message m = decode(bytes);
    EXPECT_EQ(encode(m), bytes);
    const auto& children = std::get<Bind>(m.content).messages;
    ASSERT_EQ(children.size(), 3);
    EXPECT_EQ(children[0].device, "ChildTrans");
    for (const BoundMessage& child : children)
        EXPECT_EQ(encode_content(child.type, decode_content(child.type, child.content)),
                  child.content)
            << child.type;
    const auto image = std::get<Image>(decode_content("IMAGE", children[1].content));
    EXPECT_EQ(image.size, (std::array<std::uint16_t, 3>{50, 50, 1}));
}

TEST(OpenIgtLinkGolden, ValuesAreThoseOfTheProtocolsOwnTests) {
    LIVETET_DATA_OR_SKIP(data);
    const auto read = [&](const char* name) { return decode(bytes_of_file(data / "igtl" / name)); };
    const Message m = read("test_transform_message_Format2.bin");
    EXPECT_EQ(m.device, "DeviceName");
    EXPECT_EQ(m.time_stamp, 1234567892);
    ASSERT_EQ(m.metadata.size(), 2);
    EXPECT_EQ(*find_metadata(m, "First patient age"), "22");
    EXPECT_NEAR(std::get<Transform>(m.content).matrix[9], 46.0531, 1e-4);
    const auto status = std::get<Status>(read("test_status_message.bin").content);
    EXPECT_EQ(status.code, 15);
    EXPECT_EQ(status.subcode, 10);
    EXPECT_EQ(status.error_name, "ACTUATOR_DISABLED");
    EXPECT_EQ(status.text, "Actuator A is disabled.");
    const auto poly = std::get<PolyData>(read("polydata_v1_full.bin").content);
    EXPECT_EQ(poly.points.size(), 8);
    EXPECT_EQ(poly.polygons.count, 6);
    EXPECT_EQ(poly.attributes.at(0).name, "attr");
    const auto video = std::get<VideoList>(read("test_videometa_message.bin").content).videos;
    ASSERT_EQ(video.size(), 3);
    EXPECT_EQ(video[1].zoom, -2);
    EXPECT_EQ(video[2].focal_length, 20.5);
    const auto array = std::get<NdArray>(read("ndarray_v1_full.bin").content);
    EXPECT_EQ(array.size, (std::vector<std::uint16_t>{5, 4, 3}));
    EXPECT_EQ(array.values.back(), 59);
    const auto sensor = std::get<Sensor>(read("test_sensor_message.bin").content);
    EXPECT_NEAR(sensor.values.at(0), 123456.78, 1e-9);
}

}  // namespace
}  // namespace livetet::igtl
