#pragma once

#include <optional>
#include <span>
#include <string>

#include "geometry/transform.hpp"
#include "io/openigtlink/message.hpp"
#include "mesh/tet_mesh.hpp"

namespace livetet::igtl {

// Conversions between the wire (mm, single precision, unchecked numbers) and the program (m, rigid
// transforms).

/// The pose in a TRANSFORM or TDATA matrix; nothing if it is not finite or not rigid
/// (`tracker_from_tool_mm`).
std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool(const std::array<float, 12>& matrix);

/// The pose in a POSITION or QTDATA; nothing if it is not finite or the quaternion's norm differs
/// from 1 by 1 % or more.
std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool(
    const std::array<float, 3>& position, const std::array<float, 4>& quaternion);

/// The matrix of a TRANSFORM message, in mm.
std::array<float, 12> wire_matrix(const Eigen::Matrix3d& rotation,
                                  const Eigen::Vector3d& translation);

/// A message without content. `time_s`: seconds since 1970, UTC; 0 for none.
Message dated_message(std::string type, std::string device, double time_s);

/// Messages to send, with time stamp `time_s` (as above). In 3D Slicer the node has the device's
/// name; TRANSFORM becomes a linear transform, POLYDATA a model, STRING a text.
template <class To, class From>
Message transform_message(std::string device, const RigidTransform<To, From>& to_from_from,
                          double time_s) {
    Message m = dated_message("TRANSFORM", std::move(device), time_s);
    m.content = Transform{wire_matrix(to_from_from.rotation, to_from_from.translation)};
    return m;
}
Message status_message(std::string device, std::uint16_t code, std::string text, double time_s);
Message string_message(std::string device, std::string text, double time_s);

/// Point data of a surface: one value for each point, in the unit that the name states.
struct PointScalars {
    std::string name;
    std::span<const float> values;
};

/// A surface as POLYDATA; points in metres, RAS. Throws Error if a triangle has an invalid point
/// index or the number of scalars differs from the number of points.
Message surface_message(std::string device, std::span<const Eigen::Vector3d> points,
                        std::span<const Triangle> triangles, std::span<const PointScalars> scalars,
                        double time_s);

}  // namespace livetet::igtl
