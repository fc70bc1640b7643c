#include "mesh/movable_nodes.hpp"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/sliced_task.hpp"
#include "mesh/least_dihedral.hpp"

namespace livetet {

namespace {

/// Moves leave no smaller angle, rad, but where one was smaller already.
constexpr double least_angle = 15 * std::numbers::pi / 180;
/// How far, by its length, a move along the boundary may lead off a triangle of it.
constexpr double boundary_slope = 0.15;
/// A node of the boundary moves onto a plane only if that stands on its way at least so steeply
/// (sine).
constexpr double least_steepness = 0.3;

}  // namespace

MovableNodes::MovableNodes(TetMesh& mesh) : mesh_(mesh) {
    stars_ = make_lists(mesh.nodes.size(), [&](auto&& add) {
        for (std::size_t e = 0; e < mesh.tets.size(); ++e)
            for (const std::int32_t n : mesh.tets[e]) add(n, static_cast<std::int32_t>(e));
    });
    pause_point();
    boundary_ = boundary_triangles(mesh.tets);
    pause_point();
    at_boundary_ = make_lists(mesh.nodes.size(), [&](auto&& add) {
        for (std::size_t i = 0; i < boundary_.size(); ++i)
            for (const std::int32_t n : boundary_[i]) add(n, static_cast<std::int32_t>(i));
    });
}

Vector3 MovableNodes::normal_of(std::int32_t triangle) const {
    const auto& [a, b, c] = boundary_[triangle];
    const Vector3& x = mesh_.nodes[a];
    return (mesh_.nodes[b] - x).cross(mesh_.nodes[c] - x).normalized();
}

bool MovableNodes::keeps_boundary(std::int32_t node, const Vector3& way) const {
    return std::ranges::all_of(at_boundary_[node], [&](std::int32_t i) {
        return std::abs(normal_of(i).dot(way)) <= boundary_slope * way.norm();
    });
}

/// Along the boundary, a way is in the span of the directions in which its triangles hardly rise:
/// the eigenvectors of the mean of their n n^T with small eigenvalues.
Vector3 MovableNodes::way_to_plane(std::int32_t node, const Vector3& point,
                                   const Vector3& normal) const {
    const double distance = (point - mesh_.nodes[node]).dot(normal);
    if (at_boundary_[node].empty()) return distance * normal;
    Eigen::Matrix3d rise = Eigen::Matrix3d::Zero();
    for (const std::int32_t i : at_boundary_[node])
        rise += normal_of(i) * normal_of(i).transpose() /
                static_cast<double>(at_boundary_[node].size());
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(rise);
    Vector3 along = Vector3::Zero();
    for (int k = 0; k < 3; ++k)
        if (eigen.eigenvalues()[k] <= boundary_slope * boundary_slope)
            along += eigen.eigenvectors().col(k).dot(normal) * eigen.eigenvectors().col(k);
    if (along.norm() < least_steepness) return Vector3::Zero();
    const Vector3 way = distance / along.squaredNorm() * along;
    return keeps_boundary(node, way) ? way : Vector3::Zero();
}

double MovableNodes::least_angle_around(std::int32_t node) const {
    double least = std::numbers::pi;
    for (const std::int32_t e : stars_[node])
        least = std::min(least, least_dihedral(mesh_.nodes, mesh_.tets[e]));
    return least;
}

Vector3 MovableNodes::move(std::int32_t node, const Vector3& way) {
    const Vector3 from = mesh_.nodes[node];
    const double enough = std::min(least_angle, least_angle_around(node));
    for (const double part : {1.0, 0.75, 0.5, 0.25}) {
        mesh_.nodes[node] = from + part * way;
        if (least_angle_around(node) >= enough) return part * way;
    }
    mesh_.nodes[node] = from;
    return Vector3::Zero();
}

}  // namespace livetet
