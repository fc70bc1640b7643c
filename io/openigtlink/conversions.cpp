#include "io/openigtlink/conversions.hpp"

#include "io/openigtlink/codec.hpp"
#include "io/openigtlink/plus_pose.hpp"

namespace livetet::igtl {

namespace {

std::array<float, 3> wire_point(const Eigen::Vector3d& x) {
    const Eigen::Vector3f x_mm = (x / metres_per_mm).cast<float>();
    return {x_mm[0], x_mm[1], x_mm[2]};
}

}  // namespace

std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool(
    const std::array<float, 12>& matrix) {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    for (int i = 0; i < 12; ++i) m(i % 3, i / 3) = matrix[i];
    return tracker_from_tool_mm(m);
}

std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool(
    const std::array<float, 3>& position, const std::array<float, 4>& quaternion) {
    const Eigen::Quaterniond q(quaternion[3], quaternion[0], quaternion[1], quaternion[2]);
    if (!(std::abs(q.norm() - 1) < 0.01)) return std::nullopt;
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = q.normalized().toRotationMatrix();
    m.topRightCorner<3, 1>() << position[0], position[1], position[2];
    return tracker_from_tool_mm(m);
}

std::array<float, 12> wire_matrix(const Eigen::Matrix3d& rotation,
                                  const Eigen::Vector3d& translation) {
    std::array<float, 12> matrix;
    for (int i = 0; i < 9; ++i) matrix[i] = static_cast<float>(rotation(i % 3, i / 3));
    std::ranges::copy(wire_point(translation), matrix.begin() + 9);
    return matrix;
}

Message dated_message(std::string type, std::string device, double time_s) {
    Message m;
    m.type = std::move(type);
    m.device = std::move(device);
    m.time_stamp = stamp_of_seconds(time_s);
    return m;
}

Message status_message(std::string device, std::uint16_t code, std::string text, double time_s) {
    Message m = dated_message("STATUS", std::move(device), time_s);
    m.content = Status{code, 0, {}, std::move(text)};
    return m;
}

Message string_message(std::string device, std::string text, double time_s) {
    Message m = dated_message("STRING", std::move(device), time_s);
    m.content = String{106, std::move(text)};
    return m;
}

Message surface_message(std::string device, std::span<const Eigen::Vector3d> points,
                        std::span<const Triangle> triangles, std::span<const PointScalars> scalars,
                        double time_s) {
    Message m = dated_message("POLYDATA", std::move(device), time_s);
    PolyData& surface = m.content.emplace<PolyData>();
    surface.points.reserve(points.size());
    for (const Eigen::Vector3d& x : points) surface.points.push_back(wire_point(x));
    surface.polygons.count = static_cast<std::uint32_t>(triangles.size());
    surface.polygons.list.reserve(4 * triangles.size());
    for (const Triangle& triangle : triangles) {
        surface.polygons.list.push_back(3);
        for (const std::int32_t node : triangle) {
            if (node < 0 || static_cast<std::size_t>(node) >= points.size())
                fail("{}: a triangle with point {}, expected 0 to {}", m.device, node,
                     points.size() - 1);
            surface.polygons.list.push_back(static_cast<std::uint32_t>(node));
        }
    }
    for (const PointScalars& s : scalars) {
        if (s.values.size() != points.size())
            fail("{}: {} values of {}, expected {}, one for each point", m.device, s.values.size(),
                 s.name, points.size());
        surface.attributes.push_back({0, 1, s.name, {s.values.begin(), s.values.end()}});
    }
    return m;
}

}  // namespace livetet::igtl
