#include "apps/simulation/measured_organ.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "geometry/nearest_triangle.hpp"

namespace livetet {

namespace {

constexpr std::size_t min_surface_points = 10;

/// RMS distance of points from their mean.
double spread_of(std::span<const Vector3> points) {
    Vector3 mean = Vector3::Zero();
    for (const Vector3& c : points) mean += c / static_cast<double>(points.size());
    double squares = 0;
    for (const Vector3& c : points) squares += (c - mean).squaredNorm();
    return std::sqrt(squares / static_cast<double>(points.size()));
}

double diagonal_of(std::span<const Vector3> nodes) {
    Eigen::AlignedBox3d box;
    for (const Vector3& x : nodes) box.extend(x);
    return box.diagonal().norm();
}

/// Of points that are as wide as an organ may be seen. `diagonal`: of the organ, m.
void check_spread(const MeasuredOrgan& measured, double diagonal) {
    constexpr double unit_share = 0.002, spot_share = 0.03, wide_share = 5;  // of the diagonal
    const double spread = spread_of(measured.points);
    const bool may_be_metres =
        spread < unit_share * diagonal && 1000 * spread > spot_share * diagonal;
    if (may_be_metres || spread > wide_share * diagonal)
        fail(
            "{}: the points spread over {:.3g} mm RMS and the organ measures {:.0f} mm: another "
            "unit, expected points in mm",
            measured.source, 1e3 * spread, 1e3 * diagonal);
    if (spread < spot_share * diagonal)
        fail(
            "{}: all points lie on one spot, {:.2g} mm RMS about their mean, expected {:.1f} mm or "
            "more on an organ of {:.0f} mm, in mm",
            measured.source, 1e3 * spread, 1e3 * spot_share * diagonal, 1e3 * diagonal);
}

}  // namespace

double median_distance(std::span<const Vector3> points, const TriangleMesh& surface) {
    const NearestTriangle triangles(surface.nodes, surface.triangles);
    std::vector<double> distances;
    for (const Vector3& c : points) distances.push_back(triangles.find(c).distance);
    const auto middle = distances.begin() + std::ssize(distances) / 2;
    std::nth_element(distances.begin(), middle, distances.end());
    return *middle;
}

void check_landmarks(std::span<const MeasuredLandmark> landmarks, std::span<const Vector3> rest) {
    constexpr double unit_ratio = 20, near_share = 0.1, far_share = 0.5;  // shares of the diagonal
    if (landmarks.empty()) return;
    const double diagonal = diagonal_of(rest);
    std::vector<Vector3> measured, at_rest;
    double squares = 0, mirrored_squares = 0;
    for (const MeasuredLandmark& l : landmarks) {
        measured.push_back(l.measured);
        at_rest.push_back(l.at_rest);
        squares += (l.measured - l.at_rest).squaredNorm();
        const Vector3 mirrored(-l.measured.x(), -l.measured.y(), l.measured.z());
        mirrored_squares += (mirrored - l.at_rest).squaredNorm();
    }
    const double spread = spread_of(measured), expected = spread_of(at_rest);
    if (expected > near_share * diagonal &&
        (spread * unit_ratio < expected || spread > unit_ratio * expected))
        fail(
            "landmarks: found {:.3g} mm RMS about their mean where they are measured and {:.3g} mm "
            "at rest: another unit, expected both in mm",
            1e3 * spread, 1e3 * expected);
    const auto count = static_cast<double>(landmarks.size());
    const double far = std::sqrt(squares / count), other = std::sqrt(mirrored_squares / count);
    if (far > near_share * diagonal && other < far / 2 && other < near_share * diagonal)
        fail(
            "landmarks: found {:.0f} mm RMS from their places at rest, and {:.0f} mm with x and y "
            "negated: LPS, expected RAS",
            1e3 * far, 1e3 * other);
    if (far > far_share * diagonal)
        fail(
            "landmarks: found {:.0f} mm RMS from their places at rest, expected less than {:.0f} "
            "mm, half of the organ's diagonal: same frame, unit and names?",
            1e3 * far, 1e3 * far_share * diagonal);
}

void check_measured(const MeasuredOrgan& measured, const TriangleMesh& surface,
                    std::size_t unknowns) {
    const std::size_t points = measured.points.size();
    if (points < min_surface_points)
        fail("{}: found {} surface points, expected at least {}", measured.source, points,
             min_surface_points);
    const std::size_t numbers = points + 3 * measured.landmarks.size();
    if (numbers < unknowns)
        fail(
            "{}: {} surface points and {} landmarks give {} numbers, expected at least {}, as many "
            "as forces and motions are sought: measure more, or lower deform.forces[].centres",
            measured.source, points, measured.landmarks.size(), numbers, unknowns);
    const double diagonal = diagonal_of(surface.nodes);
    check_spread(measured, diagonal);
    check_landmarks(measured.landmarks, surface.nodes);

    constexpr double far_share = 0.2, near_share = 0.1;  // of the diagonal
    const double median = median_distance(measured.points, surface);
    if (median < near_share * diagonal) return;
    std::vector<Vector3> mirrored = measured.points;
    for (Vector3& c : mirrored) c.head<2>() *= -1;
    if (const double other = median_distance(mirrored, surface);
        other < near_share * diagonal && other < median / 2)
        fail(
            "{}: the points are {:.0f} mm (median) from the organ's surface, and {:.0f} mm with x "
            "and y negated: LPS, expected RAS",
            measured.source, 1e3 * median, 1e3 * other);
    if (median > far_share * diagonal)
        fail(
            "{}: no points near the organ: {:.0f} mm (median) from its surface, expected less than "
            "{:.0f} mm: they must be given in the mesh's frame, or with --registration",
            measured.source, 1e3 * median, 1e3 * far_share * diagonal);
}

}  // namespace livetet
