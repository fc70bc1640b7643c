// Exchanges every message type of header version 1 with Debian's libopenigtlink, in both
// directions, over sockets.
#include <gtest/gtest.h>
#include <igtlBindMessage.h>
#include <igtlCapabilityMessage.h>
#include <igtlClientSocket.h>
#include <igtlColorTableMessage.h>
#include <igtlImageMessage.h>
#include <igtlImageMetaMessage.h>
#include <igtlLabelMetaMessage.h>
#include <igtlNDArrayMessage.h>
#include <igtlPointMessage.h>
#include <igtlPolyDataMessage.h>
#include <igtlPositionMessage.h>
#include <igtlQuaternionTrackingDataMessage.h>
#include <igtlSensorMessage.h>
#include <igtlServerSocket.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTrackingDataMessage.h>
#include <igtlTrajectoryMessage.h>
#include <igtlTransformMessage.h>

#include <cstring>
#include <vector>

#include "io/openigtlink/messages.hpp"
#include "io/openigtlink/server.hpp"
#include "io/openigtlink/sockets.hpp"

namespace livetet::igtl {
namespace {

using namespace testing_messages;
using namespace testing_sockets;

/// Decodes what the library sends and encodes it again; the body must be the same to the byte.
/// `unset`: bytes that the library leaves uninitialised.
template <class Theirs>
Message from_library(typename Theirs::Pointer theirs, const std::vector<std::size_t>& unset = {}) {
    theirs->SetDeviceName("Device");
    theirs->SetTimeStamp(1234567890, 0x80000000);
    theirs->Pack();
    ::igtl::ServerSocket::Pointer server = ::igtl::ServerSocket::New();
    if (server->CreateServer(0) < 0) throw std::runtime_error("the library cannot listen");
    Peer peer = connect_to(static_cast<std::uint16_t>(server->GetServerPort()));
    ::igtl::ClientSocket::Pointer socket = server->WaitForConnection(patience_ms);
    socket->Send(theirs->GetPackPointer(), theirs->GetPackSize());
    Bytes bytes = peer.receive(static_cast<std::size_t>(theirs->GetPackSize()));
    const Header header = decode_header(ByteView(bytes).first(header_size));
    const Message message = decode_body(header, ByteView(bytes).subspan(header_size));
    for (const std::size_t place : unset) bytes.at(header_size + place) = 0;
    const Bytes ours = encode(message);
    EXPECT_EQ(Bytes(ours.begin() + header_size, ours.end()),
              Bytes(bytes.begin() + header_size, bytes.end()))
        << message.type;
    if (unset.empty()) {
        EXPECT_EQ(ours, bytes) << message.type << ", header";
    }
    EXPECT_EQ(message.device, "Device");
    EXPECT_EQ(seconds_of_stamp(message.time_stamp), 1234567890.5);
    return message;
}

/// Reads what our server publishes with the library, which checks the CRC.
template <class Theirs>
typename Theirs::Pointer to_library(const Message& message) {
    OpenIgtLinkServer server({"127.0.0.1", 0});
    ::igtl::ClientSocket::Pointer socket = ::igtl::ClientSocket::New();
    EXPECT_EQ(socket->ConnectToServer("127.0.0.1", server.port()), 0);
    EXPECT_TRUE(eventually([&] { return server.statistics().clients == 1; }));
    server.publish({message});
    socket->SetReceiveTimeout(patience_ms);
    ::igtl::MessageHeader::Pointer header = ::igtl::MessageHeader::New();
    header->InitPack();
    EXPECT_EQ(socket->Receive(header->GetPackPointer(), header->GetPackSize()), 58);
    header->Unpack();
    EXPECT_EQ(header->GetDeviceType(), message.type);
    EXPECT_STREQ(header->GetDeviceName(), message.device.c_str());
    typename Theirs::Pointer theirs = Theirs::New();
    theirs->SetMessageHeader(header);
    theirs->AllocatePack();
    if (theirs->GetPackBodySize() == 0) return theirs;
    EXPECT_EQ(socket->Receive(theirs->GetPackBodyPointer(), theirs->GetPackBodySize()),
              theirs->GetPackBodySize());
    EXPECT_TRUE(theirs->Unpack(1) & ::igtl::MessageHeader::UNPACK_BODY)
        << message.type << ": CRC or content";
    return theirs;
}

template <class T>
T content_of(const Message& message) {
    return std::get<T>(message.content);
}

template <class T>
Message one(const char* type) {
    for (const Message& m : one_of_each())
        if (m.type == type && std::holds_alternative<T>(m.content)) return m;
    throw std::runtime_error(type);
}

/// The pose in the messages of `one_of_each`: a quarter turn about z and a translation.
void set_matrix(::igtl::Matrix4x4& m) {
    const float rows[4][4] = {{0, -1, 0, 10}, {1, 0, 0, 20}, {0, 0, 1, -30.5f}, {0, 0, 0, 1}};
    std::memcpy(m, rows, sizeof rows);
}
const std::array<float, 12> matrix{0, 1, 0, -1, 0, 0, 0, 0, 1, 10, 20, -30.5f};

void expect_matrix(::igtl::Matrix4x4& m) {
    for (int i = 0; i < 12; ++i) EXPECT_EQ(m[i % 3][i / 3], matrix[i]) << i;
}

TEST(Interop, Transform) {
    auto theirs = ::igtl::TransformMessage::New();
    ::igtl::Matrix4x4 m;
    set_matrix(m);
    theirs->SetMatrix(m);
    EXPECT_EQ(content_of<Transform>(from_library<::igtl::TransformMessage>(theirs)).matrix, matrix);
    to_library<::igtl::TransformMessage>(one<Transform>("TRANSFORM"))->GetMatrix(m);
    expect_matrix(m);
}

TEST(Interop, Position) {
    // Complete layouts only: for the two shorter ones this library writes beyond its buffer.
    auto theirs = ::igtl::PositionMessage::New();
    theirs->SetPosition(1, -2, 3.5);
    theirs->SetQuaternion(0.5, -0.5, 0.5, 0.5);
    const auto ours = content_of<Position>(from_library<::igtl::PositionMessage>(theirs));
    EXPECT_EQ(ours.layout, Position::Layout::whole);
    EXPECT_EQ(ours.position, (std::array<float, 3>{1, -2, 3.5f}));
    EXPECT_EQ(ours.quaternion, (std::array<float, 4>{0.5f, -0.5f, 0.5f, 0.5f}));
    float q[4];
    to_library<::igtl::PositionMessage>(one<Position>("POSITION"))->GetQuaternion(q);
    EXPECT_EQ(q[1], -0.5f);
}

TEST(Interop, TrackingData) {
    auto theirs = ::igtl::TrackingDataMessage::New();
    ::igtl::Matrix4x4 m;
    set_matrix(m);
    for (const char* name : {"Stylus", "Reference"}) {
        auto tool = ::igtl::TrackingDataElement::New();
        tool->SetName(name);
        tool->SetType(::igtl::TrackingDataElement::TYPE_6D);
        tool->SetMatrix(m);
        theirs->AddTrackingDataElement(tool);
    }
    const auto ours =
        content_of<TrackingData>(from_library<::igtl::TrackingDataMessage>(theirs, {21, 91}));
    ASSERT_EQ(ours.tools.size(), 2);
    EXPECT_EQ(ours.tools[1].name, "Reference");
    EXPECT_EQ(ours.tools[1].matrix, matrix);
    auto back = to_library<::igtl::TrackingDataMessage>(one<TrackingData>("TDATA"));
    ASSERT_EQ(back->GetNumberOfTrackingDataElements(), 2);
    ::igtl::TrackingDataElement::Pointer tool;
    back->GetTrackingDataElement(1, tool);
    EXPECT_STREQ(tool->GetName(), "Reference");
    EXPECT_EQ(tool->GetType(), 3);
    tool->GetMatrix(m);
    expect_matrix(m);
}

TEST(Interop, QuaternionTrackingData) {
    auto theirs = ::igtl::QuaternionTrackingDataMessage::New();
    auto tool = ::igtl::QuaternionTrackingDataElement::New();
    tool->SetName("Stylus");
    tool->SetType(4);
    tool->SetPosition(1, -2, 3.5);
    tool->SetQuaternion(0.5, -0.5, 0.5, 0.5);
    theirs->AddQuaternionTrackingDataElement(tool);
    const auto ours = content_of<QuaternionTrackingData>(
        from_library<::igtl::QuaternionTrackingDataMessage>(theirs, {21}));
    EXPECT_EQ(ours.tools.at(0).quaternion[1], -0.5f);
    auto back =
        to_library<::igtl::QuaternionTrackingDataMessage>(one<QuaternionTrackingData>("QTDATA"));
    back->GetQuaternionTrackingDataElement(0, tool);
    float p[3];
    tool->GetPosition(p);
    EXPECT_EQ(p[1], -2);
}

TEST(Interop, QueriesForTrackingData) {
    auto start = ::igtl::StartTrackingDataMessage::New();
    start->SetResolution(50);
    start->SetCoordinateName("Patient");
    EXPECT_EQ(content_of<StartTracking>(from_library<::igtl::StartTrackingDataMessage>(start))
                  .coordinates,
              "Patient");
    EXPECT_EQ(to_library<::igtl::StartTrackingDataMessage>(one<StartTracking>("STT_TDATA"))
                  ->GetResolution(),
              50);
    auto start_q = ::igtl::StartQuaternionTrackingDataMessage::New();
    start_q->SetResolution(20);
    EXPECT_EQ(
        content_of<StartTracking>(from_library<::igtl::StartQuaternionTrackingDataMessage>(start_q))
            .resolution_ms,
        20);
    auto stop = ::igtl::StopTrackingDataMessage::New();
    EXPECT_TRUE(content_of<Raw>(from_library<::igtl::StopTrackingDataMessage>(stop)).bytes.empty());
    auto ready = ::igtl::RTSTrackingDataMessage::New();
    ready->SetStatus(1);
    EXPECT_EQ(content_of<Reply>(from_library<::igtl::RTSTrackingDataMessage>(ready)).status, 1);
    EXPECT_EQ(to_library<::igtl::RTSTrackingDataMessage>(one<Reply>("RTS_TDATA"))->GetStatus(), 1);
}

TEST(Interop, QueriesWithoutContent) {
    EXPECT_EQ(from_library<::igtl::GetTransformMessage>(::igtl::GetTransformMessage::New()).type,
              "GET_TRANS");
    EXPECT_EQ(from_library<::igtl::GetPolyDataMessage>(::igtl::GetPolyDataMessage::New()).type,
              "GET_POLYDATA");
    EXPECT_EQ(from_library<::igtl::GetPointMessage>(::igtl::GetPointMessage::New()).type,
              "GET_POINT");
    EXPECT_EQ(from_library<::igtl::GetCapabilityMessage>(::igtl::GetCapabilityMessage::New()).type,
              "GET_CAPABIL");
    EXPECT_EQ(from_library<::igtl::GetColorTableMessage>(::igtl::GetColorTableMessage::New()).type,
              "GET_COLORT");
    to_library<::igtl::GetPolyDataMessage>(message("GET_POLYDATA", Raw{}));
}

TEST(Interop, Status) {
    auto theirs = ::igtl::StatusMessage::New();
    theirs->SetCode(4);
    theirs->SetSubCode(-7);
    theirs->SetErrorName("NOT_FOUND");
    theirs->SetStatusString("no such device");
    const auto ours =
        content_of<livetet::igtl::Status>(from_library<::igtl::StatusMessage>(theirs));
    EXPECT_EQ(ours.subcode, -7);
    EXPECT_EQ(ours.text, "no such device");
    auto back = to_library<::igtl::StatusMessage>(one<livetet::igtl::Status>("STATUS"));
    EXPECT_EQ(back->GetCode(), 4);
    EXPECT_EQ(back->GetSubCode(), -7);
    EXPECT_STREQ(back->GetErrorName(), "NOT_FOUND");
    EXPECT_STREQ(back->GetStatusString(), "no such device");
}

TEST(Interop, String) {
    auto theirs = ::igtl::StringMessage::New();
    theirs->SetString("Leber");
    theirs->SetEncoding(106);
    EXPECT_EQ(content_of<livetet::igtl::String>(from_library<::igtl::StringMessage>(theirs)).text,
              "Leber");
    auto back = to_library<::igtl::StringMessage>(one<livetet::igtl::String>("STRING"));
    EXPECT_STREQ(back->GetString(), "Leber");
    EXPECT_EQ(back->GetEncoding(), 106);
}

TEST(Interop, Points) {
    auto theirs = ::igtl::PointMessage::New();
    auto point = ::igtl::PointElement::New();
    point->SetName("F1");
    point->SetGroupName("Fiducial");
    point->SetRGBA(1, 2, 3, 4);
    point->SetPosition(1, -2, 3.5);
    point->SetRadius(2);
    point->SetOwner("CT");
    theirs->AddPointElement(point);
    EXPECT_EQ(content_of<livetet::igtl::Points>(from_library<::igtl::PointMessage>(theirs))
                  .points.at(0)
                  .owner,
              "CT");
    auto back = to_library<::igtl::PointMessage>(one<livetet::igtl::Points>("POINT"));
    back->GetPointElement(0, point);
    EXPECT_STREQ(point->GetGroupName(), "Fiducial");
    EXPECT_EQ(point->GetRadius(), 2);
}

TEST(Interop, Trajectories) {
    auto theirs = ::igtl::TrajectoryMessage::New();
    auto trajectory = ::igtl::TrajectoryElement::New();
    trajectory->SetName("T1");
    trajectory->SetGroupName("Trajectory");
    trajectory->SetType(3);
    trajectory->SetRGBA(9, 8, 7, 6);
    trajectory->SetEntryPosition(1, -2, 3.5);
    trajectory->SetTargetPosition(4, 5, 6);
    trajectory->SetRadius(1.5);
    trajectory->SetOwner("CT");
    theirs->AddTrajectoryElement(trajectory);
    const auto ours = content_of<Trajectories>(from_library<::igtl::TrajectoryMessage>(theirs));
    EXPECT_EQ(ours.trajectories.at(0).target[2], 6);
    auto back = to_library<::igtl::TrajectoryMessage>(one<Trajectories>("TRAJ"));
    back->GetTrajectoryElement(0, trajectory);
    EXPECT_STREQ(trajectory->GetName(), "T1");
    EXPECT_EQ(trajectory->GetRadius(), 1.5f);
}

TEST(Interop, PolyData) {
    auto theirs = ::igtl::PolyDataMessage::New();
    auto points = ::igtl::PolyDataPointArray::New();
    for (int i = 0; i < 4; ++i) points->AddPoint(float(i), 0, 1);
    auto polygons = ::igtl::PolyDataCellArray::New();
    igtlUint32 first[] = {0, 1, 2}, second[] = {0, 2, 3};
    polygons->AddCell(3, first);
    polygons->AddCell(3, second);
    auto scalars = ::igtl::PolyDataAttribute::New();
    scalars->SetType(::igtl::PolyDataAttribute::POINT_SCALAR);
    scalars->SetSize(4);
    scalars->SetName("displacement");
    igtlFloat32 values[] = {0, 1, 2, 3};
    scalars->SetData(values);
    theirs->SetPoints(points);
    theirs->SetPolygons(polygons);
    theirs->AddAttribute(scalars);
    const auto ours =
        content_of<livetet::igtl::PolyData>(from_library<::igtl::PolyDataMessage>(theirs));
    EXPECT_EQ(ours.polygons.list, (std::vector<std::uint32_t>{3, 0, 1, 2, 3, 0, 2, 3}));
    EXPECT_EQ(ours.attributes.at(0).values[3], 3);

    auto back = to_library<::igtl::PolyDataMessage>(one<livetet::igtl::PolyData>("POLYDATA"));
    EXPECT_EQ(back->GetPoints()->GetNumberOfPoints(), 4);
    EXPECT_EQ(back->GetLines()->GetNumberOfCells(), 1u);
    ASSERT_EQ(back->GetPolygons()->GetNumberOfCells(), 2u);
    igtlUint32 cell[3];
    back->GetPolygons()->GetCell(1, cell);
    EXPECT_EQ(cell[2], 3u);
    ASSERT_EQ(back->GetNumberOfAttributes(), 2);
    EXPECT_STREQ(back->GetAttribute(0)->GetName(), "displacement");
    back->GetAttribute(0)->GetData(values);
    EXPECT_EQ(values[3], 3);
    EXPECT_STREQ(back->GetAttribute(1)->GetName(), "n");
}

TEST(Interop, Image) {
    auto theirs = ::igtl::ImageMessage::New();
    theirs->SetDimensions(4, 3, 2);
    theirs->SetSpacing(1, 2, 3);
    theirs->SetScalarTypeToInt16();
    theirs->SetSubVolume(4, 3, 2, 0, 0, 0);
    theirs->AllocateScalars();
    std::memset(theirs->GetScalarPointer(), 7, 48);
    const auto ours = content_of<livetet::igtl::Image>(from_library<::igtl::ImageMessage>(theirs));
    EXPECT_EQ(ours.size, (std::array<std::uint16_t, 3>{4, 3, 2}));
    EXPECT_EQ(ours.voxels.size(), 48);
    EXPECT_EQ(ours.matrix[8], 3);
    auto back = to_library<::igtl::ImageMessage>(one<livetet::igtl::Image>("IMAGE"));
    int size[3], offset[3];
    back->GetSubVolume(size, offset);
    EXPECT_EQ(size[2], 3);
    EXPECT_EQ(offset[1], 2);
    EXPECT_EQ(static_cast<std::uint8_t*>(back->GetScalarPointer())[23], 7);
}

TEST(Interop, ListsOfImagesAndLabels) {
    auto images = ::igtl::ImageMetaMessage::New();
    auto image = ::igtl::ImageMetaElement::New();
    image->SetName("liver");
    image->SetDeviceName("I1");
    image->SetModality("MR");
    image->SetPatientName("N.N.");
    image->SetPatientID("17");
    image->SetSize(5, 6, 7);
    image->SetScalarType(4);
    images->AddImageMetaElement(image);
    const auto ours =
        content_of<ImageList>(from_library<::igtl::ImageMetaMessage>(images, {259})).images;
    EXPECT_EQ(ours.at(0).patient_id, "17");
    to_library<::igtl::ImageMetaMessage>(one<ImageList>("IMGMETA"))->GetImageMetaElement(0, image);
    EXPECT_STREQ(image->GetModality(), "MR");

    auto labels = ::igtl::LabelMetaMessage::New();
    auto label = ::igtl::LabelMetaElement::New();
    label->SetName("liver");
    label->SetDeviceName("L1");
    label->SetLabel(3);
    label->SetRGBA(1, 2, 3, 4);
    label->SetSize(5, 6, 7);
    label->SetOwner("I1");
    labels->AddLabelMetaElement(label);
    EXPECT_EQ(content_of<LabelList>(from_library<::igtl::LabelMetaMessage>(labels, {85}))
                  .labels.at(0)
                  .label,
              3);
    to_library<::igtl::LabelMetaMessage>(one<LabelList>("LBMETA"))->GetLabelMetaElement(0, label);
    EXPECT_STREQ(label->GetOwner(), "I1");
}

TEST(Interop, ColorTable) {
    auto theirs = ::igtl::ColorTableMessage::New();
    theirs->SetIndexType(::igtl::ColorTableMessage::INDEX_UINT8);
    theirs->SetMapType(::igtl::ColorTableMessage::MAP_RGB);
    theirs->AllocateTable();
    std::memset(theirs->GetTablePointer(), 9, 768);
    EXPECT_EQ(content_of<livetet::igtl::ColorTable>(from_library<::igtl::ColorTableMessage>(theirs))
                  .table,
              Bytes(768, 9));
    auto back = to_library<::igtl::ColorTableMessage>(one<livetet::igtl::ColorTable>("COLORT"));
    EXPECT_EQ(static_cast<std::uint8_t*>(back->GetTablePointer())[100], 100);
}

TEST(Interop, Capability) {
    auto theirs = ::igtl::CapabilityMessage::New();
    theirs->SetTypes({"TRANSFORM", "GET_POLYDATA"});
    EXPECT_EQ(content_of<livetet::igtl::Capability>(from_library<::igtl::CapabilityMessage>(theirs))
                  .types,
              (std::vector<std::string>{"TRANSFORM", "GET_POLYDATA"}));
    auto back = to_library<::igtl::CapabilityMessage>(one<livetet::igtl::Capability>("CAPABILITY"));
    EXPECT_STREQ(back->GetType(1), "GET_POLYDATA");
}

TEST(Interop, Sensor) {
    auto theirs = ::igtl::SensorMessage::New();
    theirs->SetLength(3);
    theirs->SetUnit(::igtl::igtlUnit(0x44E000000000000));
    for (unsigned i = 0; i < 3; ++i) theirs->SetValue(i, 1.5 * i);
    EXPECT_EQ(content_of<livetet::igtl::Sensor>(from_library<::igtl::SensorMessage>(theirs)).values,
              (std::vector<double>{0, 1.5, 3}));
    auto back = to_library<::igtl::SensorMessage>(one<livetet::igtl::Sensor>("SENSOR"));
    EXPECT_EQ(back->GetValue(1), -2.5);
    EXPECT_EQ(back->GetUnit(), ::igtl::igtlUnit(0x44E000000000000));
}

TEST(Interop, NdArray) {
    auto theirs = ::igtl::NDArrayMessage::New();
    ::igtl::Array<igtlInt16> array;
    array.SetSize({2, 3});
    const igtlInt16 values[] = {1, 2, 3, -4, -5, 32767};
    std::memcpy(array.GetRawArray(), values, sizeof values);
    theirs->SetArray(::igtl::NDArrayMessage::TYPE_INT16, &array);
    const auto ours =
        content_of<livetet::igtl::NdArray>(from_library<::igtl::NDArrayMessage>(theirs));
    EXPECT_EQ(ours.size, (std::vector<std::uint16_t>{2, 3}));
    EXPECT_EQ(ours.values, (std::vector<double>{1, 2, 3, -4, -5, 32767}));
    auto back = to_library<::igtl::NDArrayMessage>(one<livetet::igtl::NdArray>("NDARRAY"));
    EXPECT_EQ(std::memcmp(back->GetArray()->GetRawArray(), values, sizeof values), 0);
}

TEST(Interop, Bind) {
    auto theirs = ::igtl::BindMessage::New();
    auto text = ::igtl::StringMessage::New();  // odd size, to test the padding
    text->SetDeviceName("a");
    text->SetString("x");
    text->Pack();
    auto transform = ::igtl::TransformMessage::New();
    ::igtl::Matrix4x4 m;
    set_matrix(m);
    transform->SetDeviceName("bc");
    transform->SetMatrix(m);
    transform->Pack();
    theirs->AppendChildMessage(text);
    theirs->AppendChildMessage(transform);
    const auto ours =
        content_of<livetet::igtl::Bind>(from_library<::igtl::BindMessage>(theirs)).messages;
    ASSERT_EQ(ours.size(), 2);
    EXPECT_EQ(ours[1].device, "bc");
    EXPECT_EQ(std::get<Transform>(decode_content(ours[1].type, ours[1].content)).matrix, matrix);
    auto back = to_library<::igtl::BindMessage>(one<livetet::igtl::Bind>("BIND"));
    ASSERT_EQ(back->GetNumberOfChildMessages(), 2);
    auto child = ::igtl::StringMessage::New();
    back->GetChildMessage(0, child);
    child->Unpack();
    EXPECT_STREQ(child->GetString(), "x");
}

}  // namespace
}  // namespace livetet::igtl
