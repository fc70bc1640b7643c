#pragma once

#include <concepts>

#include "io/openigtlink/bytes.hpp"
#include "io/openigtlink/message.hpp"

namespace livetet::igtl {

template <class T, class Of>
concept Is = std::same_as<std::remove_const_t<T>, Of>;

/// Size of a scalar in bytes; 0 if the type is unknown.
constexpr std::size_t scalar_size(ScalarType type) {
    switch (type) {
        case 2:
        case 3:
            return 1;
        case 4:
        case 5:
            return 2;
        case 6:
        case 7:
        case 10:
            return 4;
        case 11:
            return 8;
        case 13:
            return 16;
        default:
            return 0;
    }
}

inline std::size_t known_scalar_size(ScalarType type, const std::string& what) {
    const std::size_t size = scalar_size(type);
    if (size == 0) fail("{}: scalar type {}, expected 2 to 7, 10, 11 or 13", what, type);
    return size;
}

// The fields of each content, in wire order; used for reading and writing.

template <class Wire, Is<Raw> T>
void fields(Wire& wire, T& x) {
    if constexpr (Wire::reading)
        wire.bytes(x.bytes, wire.left());
    else
        wire.bytes(x.bytes, 0);
}

template <class Wire, Is<Transform> T>
void fields(Wire& wire, T& x) {
    wire(x.matrix);
}

template <class Wire, Is<TrackedTool> T>
void fields(Wire& wire, T& x) {
    wire.name(x.name, 20);
    wire(x.kind);
    wire.unused(1);
    wire(x.matrix);
}

template <class Wire, Is<TrackingData> T>
void fields(Wire& wire, T& x) {
    wire.rest(x.tools, [&](auto& element) { fields(wire, element); });
}

template <class Wire, Is<QuaternionTool> T>
void fields(Wire& wire, T& x) {
    wire.name(x.name, 20);
    wire(x.kind);
    wire.unused(1);
    wire(x.position);
    wire(x.quaternion);
}

template <class Wire, Is<QuaternionTrackingData> T>
void fields(Wire& wire, T& x) {
    wire.rest(x.tools, [&](auto& element) { fields(wire, element); });
}

template <class Wire, Is<StartTracking> T>
void fields(Wire& wire, T& x) {
    wire(x.resolution_ms);
    wire.name(x.coordinates, 32);
}

template <class Wire, Is<Reply> T>
void fields(Wire& wire, T& x) {
    wire(x.status);
}

template <class Wire, Is<String> T>
void fields(Wire& wire, T& x) {
    wire(x.encoding);
    wire.template counted_text<std::uint16_t>(x.text);
}

template <class Wire, Is<Point> T>
void fields(Wire& wire, T& x) {
    wire.name(x.name, 64);
    wire.name(x.group, 32);
    wire(x.rgba);
    wire(x.position);
    wire(x.diameter);
    wire.name(x.owner, 20);
}

template <class Wire, Is<Points> T>
void fields(Wire& wire, T& x) {
    wire.rest(x.points, [&](auto& element) { fields(wire, element); });
}

template <class Wire, Is<Trajectory> T>
void fields(Wire& wire, T& x) {
    wire.name(x.name, 64);
    wire.name(x.group, 32);
    wire(x.kind);
    wire.unused(1);
    wire(x.rgba);
    wire(x.entry);
    wire(x.target);
    wire(x.radius);
    wire.name(x.owner, 20);
}

template <class Wire, Is<Trajectories> T>
void fields(Wire& wire, T& x) {
    wire.rest(x.trajectories, [&](auto& element) { fields(wire, element); });
}

template <class Wire, Is<ImageDescription> T>
void fields(Wire& wire, T& x) {
    wire.name(x.name, 64);
    wire.name(x.device, 20);
    wire.name(x.modality, 32);
    wire.name(x.patient_name, 64);
    wire.name(x.patient_id, 64);
    wire(x.time_stamp);
    wire(x.size);
    wire(x.scalar);
    wire.unused(1);
}

template <class Wire, Is<ImageList> T>
void fields(Wire& wire, T& x) {
    wire.rest(x.images, [&](auto& element) { fields(wire, element); });
}

template <class Wire, Is<LabelDescription> T>
void fields(Wire& wire, T& x) {
    wire.name(x.name, 64);
    wire.name(x.device, 20);
    wire(x.label);
    wire.unused(1);
    wire(x.rgba);
    wire(x.size);
    wire.name(x.owner, 20);
}

template <class Wire, Is<LabelList> T>
void fields(Wire& wire, T& x) {
    wire.rest(x.labels, [&](auto& element) { fields(wire, element); });
}

template <class Wire, Is<VideoDescription> T>
void fields(Wire& wire, T& x) {
    wire.name(x.name, 64);
    wire.name(x.device, 64);
    wire.name(x.patient_name, 64);
    wire.name(x.patient_id, 64);
    wire(x.zoom);
    wire(x.focal_length);
    wire(x.size);
    wire(x.matrix);
    wire(x.scalar);
    wire.unused(1);
}

template <class Wire, Is<VideoList> T>
void fields(Wire& wire, T& x) {
    wire.rest(x.videos, [&](auto& element) { fields(wire, element); });
}

template <class Wire, Is<std::string> T>
void fields(Wire& wire, T& type) {
    wire.name(type, 12);
}

template <class Wire, Is<Capability> T>
void fields(Wire& wire, T& x) {
    wire.rest(x.types, [&](auto& element) { fields(wire, element); });
}

template <class Wire, Is<Command> T>
void fields(Wire& wire, T& x) {
    wire(x.id);
    wire.name(x.name, 128);
    wire(x.encoding);
    wire.template counted_text<std::uint32_t>(x.text);
}

template <class Wire, Is<ColorTable> T>
void fields(Wire& wire, T& x) {
    wire(x.index);
    wire(x.map);
    const std::size_t entries = x.index == 3 ? 256 : x.index == 5 ? 65536 : 0;
    const std::size_t size = x.map == 3 ? 1 : x.map == 5 ? 2 : x.map == 19 ? 3 : 0;
    if (entries * size == 0)
        fail("{}: index type {} and map type {}, expected 3 or 5, and 3, 5 or 19", wire.what(),
             x.index, x.map);
    if (!Wire::reading && x.table.size() != entries * size)
        fail("{}: a table of {} bytes, expected {}", wire.what(), x.table.size(), entries * size);
    wire.bytes(x.table, entries * size);
}

template <class Wire, Is<Image> T>
void fields(Wire& wire, T& x) {
    wire(x.version);
    wire(x.components);
    wire(x.scalar);
    wire(x.endian);
    wire(x.coordinates);
    wire(x.size);
    wire(x.matrix);
    wire(x.offset);
    wire(x.part_size);
    const std::uint64_t voxels = std::uint64_t(x.part_size[0]) * x.part_size[1] * x.part_size[2];
    const std::uint64_t size =
        voxels * x.components * known_scalar_size(x.scalar, wire.what());  // < 2^60
    for (int i = 0; i < 3; ++i)
        if (x.offset[i] + x.part_size[i] > x.size[i])
            fail("{}: voxels {} to {} along axis {}, expected at most {}", wire.what(), x.offset[i],
                 x.offset[i] + x.part_size[i], i, x.size[i]);
    if (!Wire::reading && x.voxels.size() != size)
        fail("{}: {} bytes of voxels, expected {}", wire.what(), x.voxels.size(), size);
    wire.bytes(x.voxels, size);
}

}  // namespace livetet::igtl
