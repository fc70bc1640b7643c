#include "io/openigtlink/plus_pose.hpp"

namespace livetet {

namespace {

bool is_rigid(const Eigen::Matrix4d& m) {
    constexpr double tolerance = 0.02;
    const Eigen::Matrix3d rotation = m.topLeftCorner<3, 3>();
    return m.allFinite() && rotation.determinant() > 0 &&
           (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <
               tolerance &&
           (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < 1e-6;
}

}  // namespace

PoseStatus parse_pose_status(std::string_view word) {
    if (word == "OK") return PoseStatus::ok;
    if (word == "MISSING" || word == "OUT_OF_VIEW") return PoseStatus::missing;
    if (word == "OUT_OF_VOLUME") return PoseStatus::out_of_volume;
    if (word == "REQ_TIMEOUT") return PoseStatus::stale;
    return PoseStatus::invalid;  // INVALID, PATH_NOT_FOUND, UNKNOWN, and words of later versions
}

std::string_view pose_status_word(PoseStatus status) {
    switch (status) {
        case PoseStatus::ok:
            return "OK";
        case PoseStatus::missing:
            return "MISSING";
        case PoseStatus::out_of_volume:
            return "OUT_OF_VOLUME";
        case PoseStatus::stale:
            return "REQ_TIMEOUT";
        case PoseStatus::invalid:
        case PoseStatus::broken:
            return "INVALID";
    }
    return "";
}

std::optional<RigidTransform<Tracker, Tool>> tracker_from_tool_mm(const Eigen::Matrix4d& matrix) {
    if (!is_rigid(matrix)) return std::nullopt;
    return RigidTransform<Tracker, Tool>{nearest_rotation(matrix.topLeftCorner<3, 3>()),
                                         metres_per_mm * matrix.topRightCorner<3, 1>()};
}

}  // namespace livetet
