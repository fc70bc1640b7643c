#include "io/plus_pose.hpp"

namespace livetet {

namespace {

bool is_rigid(const Eigen::Matrix4d& m) {
    constexpr double tolerance = 0.02;
    const Eigen::Matrix3d rotation = m.topLeftCorner<3, 3>();
    return m.allFinite() && rotation.determinant() > 0 &&
           (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < tolerance &&
           (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < 1e-6;
}

}  // namespace

PoseStatus parse_pose_status(std::string_view word) {
    if (word == "OK") return PoseStatus::ok;
    for (const auto* missing : {"MISSING", "OUT_OF_VIEW", "OUT_OF_VOLUME", "REQ_TIMEOUT"})
        if (word == missing) return PoseStatus::missing;
    return PoseStatus::invalid;  // INVALID, PATH_NOT_FOUND, UNKNOWN and what later versions may say
}

std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool_of_mm(const Eigen::Matrix4d& matrix) {
    if (!is_rigid(matrix)) return std::nullopt;
    return RigidTransform<Tracker, Tool>{nearest_rotation(matrix.topLeftCorner<3, 3>()),
                                         metres_per_mm * matrix.topRightCorner<3, 1>()};
}

}  // namespace livetet
