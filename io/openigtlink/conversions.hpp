#pragma once

#include <optional>
#include <span>
#include <string>

#include "geometry/transform.hpp"
#include "io/openigtlink/message.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet::igtl {

// The border between the wire (mm, single precision, unchecked numbers) and the inside (m, rigid
// transforms).

/// A TRANSFORM's or TDATA's matrix; nothing where it is not finite or not rigid
/// (`tracker_from_tool_mm`).
std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool(const std::array<float, 12>& matrix);

/// A POSITION's or QTDATA's; nothing where it is not finite, or the quaternion's norm is not 1
/// within 1 %.
std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool(
    const std::array<float, 3>& position, const std::array<float, 4>& quaternion);

/// A transform as TRANSFORM has it.
std::array<float, 12> wire_matrix(const Eigen::Matrix3d& rotation,
                                  const Eigen::Vector3d& translation);

/// A message with nothing but its header. `time_s`: seconds since 1970, UTC; 0 for none.
Message dated_message(std::string type, std::string device, double time_s);

/// Messages to send, at `time_s` (as above). In 3D Slicer, whose node gets the device's name,
/// TRANSFORM becomes a linear transform, POLYDATA a model, STRING a text.
template <class To, class From>
Message transform_message(std::string device, const RigidTransform<To, From>& to_from_from,
                          double time_s) {
    Message m = dated_message("TRANSFORM", std::move(device), time_s);
    m.content = Transform{wire_matrix(to_from_from.rotation, to_from_from.translation)};
    return m;
}
Message status_message(std::string device, std::uint16_t code, std::string text, double time_s);
Message string_message(std::string device, std::string text, double time_s);

/// One value for each point of a surface, in whatever unit its name says.
struct PointScalars {
    std::string name;
    std::span<const float> values;
};

/// A surface, points in metres, RAS. Throws Error where a triangle names a point that is not there,
/// or there are not as many scalars as points.
Message surface_message(std::string device, std::span<const Eigen::Vector3d> points,
                        std::span<const Triangle> triangles, std::span<const PointScalars> scalars,
                        double time_s);

}  // namespace livetet::igtl
