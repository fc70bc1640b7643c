#pragma once

#include <utility>
#include <vector>

#include "io/openigtlink/codec.hpp"
#include "io/openigtlink/content.hpp"

namespace livetet::igtl::testing_messages {

/// Each message has a time stamp of its own, 1/8 s after the one before.
inline Message message(std::string type, Content content, std::string device = "Device") {
    Message m;
    m.type = std::move(type);
    m.device = std::move(device);
    static double sent_s = 1234567890.5;
    m.time_stamp = stamp_of_seconds(sent_s += 0.125);
    m.content = std::move(content);
    return m;
}

inline Message with_metadata(Message m, std::vector<std::pair<std::string, std::string>> items) {
    m.version = 2;
    for (auto& [key, value] : items) m.metadata.push_back({key, 3, value});
    return m;
}

/// A message of every type; no field has its default value.
inline std::vector<Message> one_of_each() {
    const std::array<float, 12> matrix{0, 1, 0, -1, 0, 0, 0, 0, 1, 10, 20, -30.5f};
    const std::array<float, 3> place{1, -2, 3.5f};
    const std::array<float, 4> turn{0.5f, -0.5f, 0.5f, 0.5f};
    PolyData body{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                  {1, {1, 3}},
                  {1, {2, 0, 1}},
                  {2, {3, 0, 1, 2, 3, 0, 2, 3}},
                  {1, {4, 0, 1, 2, 3}},
                  {{0, 1, "displacement", {0, 1, 2, 3}}, {0x11, 3, "n", {1, 0, 0, 0, 1, 0}}}};
    std::vector<std::uint8_t> colours(256 * 3);
    for (std::size_t i = 0; i < colours.size(); ++i) colours[i] = static_cast<std::uint8_t>(i);
    return {
        message("TRANSFORM", Transform{matrix}),
        message("POSITION", Position{place, turn, Position::Layout::whole}),
        message("POSITION", Position{place, turn, Position::Layout::without_w}),
        message("QTRANS", Position{place, {0, 0, 0, 1}, Position::Layout::without_rotation}),
        message("TDATA", TrackingData{{{"Stylus", 2, matrix}, {"Reference", 3, matrix}}}),
        message("QTDATA", QuaternionTrackingData{{{"Stylus", 4, place, turn}}}),
        message("STT_TDATA", StartTracking{50, "Patient"}),
        message("STT_QTDATA", StartTracking{0, "Tracker"}),
        message("RTS_TDATA", Reply{1}),
        message("STP_TDATA", Raw{}),
        message("GET_TRANSFOR", Raw{}),
        message("STATUS", Status{4, -7, "NOT_FOUND", "no such device"}),
        message("STRING", String{106, "Leber"}),
        message("POINT", Points{{{"F1", "Fiducial", {1, 2, 3, 4}, place, 2, "CT"}}}),
        message(
            "TRAJ",
            Trajectories{{{"T1", "Trajectory", 3, {9, 8, 7, 6}, place, {4, 5, 6}, 1.5f, "CT"}}}),
        message("POLYDATA", body),
        message("IMAGE",
                Image{1, 2, 5, 2, 1, {4, 4, 4}, matrix, {1, 2, 0}, {2, 1, 3}, Bytes(24, 7)}),
        message("IMGMETA", ImageList{{{"liver", "I1", "MR", "N.N.", "17", 99, {5, 6, 7}, 4}}}),
        message("LBMETA", LabelList{{{"liver", "L1", 3, {1, 2, 3, 4}, {5, 6, 7}, "I1"}}}),
        message("VIDEOMETA",
                VideoList{{{"camera", "V1", "N.N.", "17", -2, 50.5, {640, 480, 1}, matrix, 3}}}),
        message("COLORT", ColorTable{3, 19, colours}),
        message("CAPABILITY", Capability{{"TRANSFORM", "GET_POLYDATA"}}),
        message("COMMAND", Command{7, "start", 3, "<Command/>"}),
        message("RTS_COMMAND", Command{7, "start", 3, "<Result/>"}),
        message("SENSOR", Sensor{1, 0x44E000000000000, {1.5, -2.5, 1e300}}),
        message("NDARRAY", NdArray{4, {2, 3}, {1, 2, 3, -4, -5, 32767}}),
        message("NDARRAY", NdArray{13, {1, 2}, {1, -1, 0.5, 2}}),
        message("BIND", Bind{{{"STRING", "a", {0, 3, 0, 1, 'x'}}, {"TRANSFORM", "bc", Bytes(48)}}}),
        message("GET_BIND", BindQuery{0, {{"STRING", "a"}, {"TRANSFORM", "bc"}}}),
        message("STT_BIND", BindQuery{20, {{"STRING", "ab"}}}),
    };
}

}  // namespace livetet::igtl::testing_messages
