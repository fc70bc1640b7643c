#include "apps/scene/cut_options.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include "base/error.hpp"
#include "config/key_places.hpp"

namespace livetet {

namespace {

void check_edges(const std::vector<double>& edges, const std::string& key,
                 const std::string& place) {
    if (edges.size() != 6)
        fail("{}.edges_mm has {} numbers, expected 6 ({})", key, edges.size(), place);
    const Eigen::Vector3d a(edges[0], edges[1], edges[2]), b(edges[3], edges[4], edges[5]);
    if (!(a.cross(b).norm() > 1e-6 * a.norm() * b.norm()))
        fail(
            "{}.edges_mm = [{:g}, {:g}, {:g}, {:g}, {:g}, {:g}] span no area, expected two edges "
            "that are neither zero nor parallel ({})",
            key, a.x(), a.y(), a.z(), b.x(), b.y(), b.z(), place);
}

}  // namespace

void check_cut(const CutOptions& cut, const std::string& key, const KeyPlaces& places) {
    const bool is_plane = cut.point_mm || cut.normal || cut.radius_mm || cut.edges_mm;
    if (!is_plane && cut.file.empty())
        fail("{} is empty, expected point_mm with normal or edges_mm, or file ({})", key,
             places(key));
    if (is_plane && !cut.file.empty())
        fail("{} names both a plane and a file, expected one ({})", key, places(key));
    if (!is_plane) return;
    if (cut.space != Space::ras)
        fail("{}.space: applies to a file, expected file in place of a plane ({})", key,
             places(key + ".space"));
    if (!cut.point_mm)
        fail("{}.point_mm is missing, expected a point of the plane ({})", key, places(key));
    if (cut.normal.has_value() == cut.edges_mm.has_value())
        fail("{} names {} of normal and edges_mm, expected one ({})", key,
             cut.normal ? "both" : "neither", places(key));
    if (cut.edges_mm && cut.radius_mm)
        fail("{} names both radius_mm and edges_mm, expected one ({})", key, places(key));
    if (cut.normal && !(cut.normal->lpNorm<Eigen::Infinity>() > 0))
        fail("{}.normal = (0, 0, 0) has no direction, expected a length above 0 ({})", key,
             places(key + ".normal"));
    if (cut.edges_mm) check_edges(*cut.edges_mm, key, places(key + ".edges_mm"));
}

}  // namespace livetet
