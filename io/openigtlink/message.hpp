#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace livetet::igtl {

// The contents of OpenIGTLink messages as they are on the wire: RAS, millimetres, single precision.
// conversions.hpp converts them to metres and transforms. Source: the protocol's page for each type
// (openigtlink.org, protocol versions 2 and 3).

/// TRANSFORM: R11 R21 R31 R12 R22 R32 R13 R23 R33 Tx Ty Tz, the columns of a 3 x 4 matrix; mm.
struct Transform {
    std::array<float, 12> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
};

/// POSITION, QTRANS: position in mm and unit quaternion (x y z w). The wire may leave out w, or all
/// of the rotation.
struct Position {
    enum class Layout { whole, without_w, without_rotation };
    std::array<float, 3> position{};
    std::array<float, 4> quaternion{0, 0, 0, 1};
    Layout layout = Layout::whole;
};

/// One tool of TDATA. `kind`: 1 tracker, 2 6-D, 3 3-D (tip only), 4 5-D instrument.
struct TrackedTool {
    std::string name;
    std::uint8_t kind = 2;
    std::array<float, 12> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
};
struct TrackingData {
    std::vector<TrackedTool> tools;
};

/// One tool of QTDATA.
struct QuaternionTool {
    std::string name;
    std::uint8_t kind = 2;
    std::array<float, 3> position{};
    std::array<float, 4> quaternion{0, 0, 0, 1};
};
struct QuaternionTrackingData {
    std::vector<QuaternionTool> tools;
};

/// STT_TDATA, STT_QTDATA: requests tracking data at intervals of at least `resolution_ms` (0: as
/// fast as possible).
struct StartTracking {
    std::int32_t resolution_ms = 0;
    std::string coordinates;
};

/// RTS_*: the answer to a query; 0 is success.
struct Reply {
    std::int8_t status = 0;
};

/// STATUS. Codes: 1 ok, 4 not found, 6 busy, 7 timeout or lost, 8 overflow, 9 checksum, 13 not
/// ready, 16 not present, 17 version, 18 hardware.
struct Status {
    std::uint16_t code = 1;
    std::int64_t subcode = 0;
    std::string error_name, text;
};

/// STRING. Encodings are numbered as in IANA's list: 3 is US-ASCII, 106 UTF-8.
struct String {
    std::uint16_t encoding = 3;
    std::string text;
};

/// One point of POINT, mm.
struct Point {
    std::string name, group;
    std::array<std::uint8_t, 4> rgba{};
    std::array<float, 3> position{};
    float diameter = 0;
    std::string owner;
};
struct Points {
    std::vector<Point> points;
};

/// One trajectory of TRAJ, mm. `kind`: 1 entry only, 2 target only, 3 both.
struct Trajectory {
    std::string name, group;
    std::int8_t kind = 3;
    std::array<std::uint8_t, 4> rgba{};
    std::array<float, 3> entry{}, target{};
    float radius = 0;
    std::string owner;
};
struct Trajectories {
    std::vector<Trajectory> trajectories;
};

/// Consecutive cells: for each the number of nodes and then their indices. `count` cells.
struct Cells {
    std::uint32_t count = 0;
    std::vector<std::uint32_t> list;
};

/// Point data or, with 0x10 added to `kind`, cell data. `kind`: 0 scalar, 1 vector, 2 normal, 3
/// tensor, 4 RGBA.
struct Attribute {
    std::uint8_t kind = 0, components = 1;
    std::string name;
    std::vector<float> values;  ///< all components of one point, then the next point
};

/// POLYDATA, points in mm.
struct PolyData {
    std::vector<std::array<float, 3>> points;
    Cells vertices, lines, polygons, strips;
    std::vector<Attribute> attributes;
};

/// Scalar types of IMAGE, NDARRAY and similar: 2 i8, 3 u8, 4 i16, 5 u16, 6 i32, 7 u32, 10 f32, 11
/// f64, 13 complex.
using ScalarType = std::uint8_t;

/// IMAGE. `matrix`: the axes times the spacing, then the image's centre, mm. `voxels`: the bytes of
/// the sub-volume as on the wire, in the byte order of `endian` (1 big, 2 little).
struct Image {
    std::uint16_t version = 1;
    std::uint8_t components = 1;
    ScalarType scalar = 3;
    std::uint8_t endian = 1, coordinates = 1;  ///< coordinates: 1 RAS, 2 LPS
    std::array<std::uint16_t, 3> size{};
    std::array<float, 12> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
    std::array<std::uint16_t, 3> offset{}, part_size{};
    std::vector<std::uint8_t> voxels;
};

/// One image of IMGMETA.
struct ImageDescription {
    std::string name, device, modality, patient_name, patient_id;
    std::uint64_t time_stamp = 0;
    std::array<std::uint16_t, 3> size{};
    ScalarType scalar = 3;
};
struct ImageList {
    std::vector<ImageDescription> images;
};

/// One label of LBMETA.
struct LabelDescription {
    std::string name, device;
    std::uint8_t label = 0;
    std::array<std::uint8_t, 4> rgba{};
    std::array<std::uint16_t, 3> size{};
    std::string owner;
};
struct LabelList {
    std::vector<LabelDescription> labels;
};

/// One video of VIDEOMETA.
struct VideoDescription {
    std::string name, device, patient_name, patient_id;
    std::int16_t zoom = 0;
    double focal_length = 0;
    std::array<std::uint16_t, 3> size{};
    std::array<float, 12> matrix{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0};
    ScalarType scalar = 3;
};
struct VideoList {
    std::vector<VideoDescription> videos;
};

/// COLORT. `index` 3 (256 entries) or 5 (65,536); `map` 3 (one byte each), 5 (two, big-endian) or
/// 19 (RGB).
struct ColorTable {
    std::int8_t index = 3, map = 3;
    std::vector<std::uint8_t> table;
};

/// CAPABILITY: types of message.
struct Capability {
    std::vector<std::string> types;
};

/// COMMAND and RTS_COMMAND.
struct Command {
    std::uint32_t id = 0;
    std::string name;
    std::uint16_t encoding = 3;
    std::string text;
};

/// SENSOR: values in the SI unit encoded in `unit` (see the protocol's page on units).
struct Sensor {
    std::uint8_t status = 0;
    std::uint64_t unit = 0;
    std::vector<double> values;
};

/// NDARRAY: the last index varies fastest; a complex value is two numbers.
struct NdArray {
    ScalarType scalar = 11;
    std::vector<std::uint16_t> size;
    std::vector<double> values;
};

/// One message in a BIND; `content` is as on the wire, for `decode_content`.
struct BoundMessage {
    std::string type, device;
    std::vector<std::uint8_t> content;
};
struct Bind {
    std::vector<BoundMessage> messages;
};

/// GET_BIND and STT_BIND (which has a resolution): the requested messages; empty: all.
struct BindQuery {
    std::uint64_t resolution = 0;
    std::vector<std::pair<std::string, std::string>> types_and_devices;
};

/// Content of a query whose layout the protocol does not state; usually empty.
struct Raw {
    std::vector<std::uint8_t> bytes;
};

using Content =
    std::variant<Raw, Transform, Position, TrackingData, QuaternionTrackingData, StartTracking,
                 Reply, Status, String, Points, Trajectories, PolyData, Image, ImageList, LabelList,
                 VideoList, ColorTable, Capability, Command, Sensor, NdArray, Bind, BindQuery>;

struct MetadataItem {
    std::string key;
    std::uint16_t encoding = 3;
    std::string value;
};

/// One message. `type` and `content` belong together: see `blank_content`.
struct Message {
    std::uint16_t version = 1;  ///< of the header: 1 for protocols 1 and 2, 2 for protocol 3
    std::string type;
    std::string device;  ///< device name; the header has 20 bytes for it
    /// UTC seconds in the high half and their binary fraction (2^-32 s) in the low half; 0 if
    /// unused.
    std::uint64_t time_stamp = 0;
    Content content;
    std::uint32_t id = 0;                ///< version 2 only
    std::vector<MetadataItem> metadata;  ///< version 2 only
};

}  // namespace livetet::igtl
